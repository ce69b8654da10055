// youbot-gap on published measurements: the same files and the same path as the command. Others identified
// the effects of each drive with other methods; tests/data/*/README.md has their numbers.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <set>
#include <string>

#include "analysis/explain.h"
#include "analysis/inputs.h"
#include "model/effects/effect_chain.h"
#include "runtime/configuration/drive_model_file.h"
#include "tests/gap/real/converted_drive.h"
#include "tests/support/built_paths.h"
#include "tests/support/measured_data.h"
#include "tests/support/temporary_directory.h"

namespace real_data_test {

namespace fs = std::filesystem;
using nlohmann::json;
using real_recordings::ConvertedDrive;

const fs::path kData = support::source_dir() + "/tests/data";

class RealData : public testing::Test {
 protected:
  /// Converts to files and runs the command's steps on them.
  void explain(const ConvertedDrive& drive) {
    const fs::path directory = directory_ / drive.base.name;
    real_recordings::write_drive(drive, directory);
    analysis::GapOptions options{.inputs = {.model = directory / "base.toml", .data = {directory / "data"}},
                                 .out = directory / "gap"};
    if (!drive.held_out.empty()) options.inputs.held_out = {directory / "held_out"};
    const analysis::Inputs inputs = analysis::read_inputs(options.inputs);
    EXPECT_EQ(inputs.rig, drive.base.name);
    analysis::write_findings(inputs, options, {});
    gap_ = json::parse(std::ifstream(options.out / "gap.json"));
    model_ = runtime::read_drive_model(options.out / "model.toml");
    std::printf("%s: %s, gap %.3g, refitted %.3g, left %.3g N·m; found %s\n", inputs.rig.c_str(),
                gap_.at("verdict").get<std::string>().c_str(), gap("before"), gap("refitted"), gap("after"),
                types().c_str());
  }

  double gap(const char* which) const { return gap_.at("gap").at(which); }
  /// The first found effect of that name, or one that has it among its equivalents.
  const json* found(const std::string& name) const {
    for (const json& effect : gap_.at("effects"))
      if (effect.at("type") == name) return &effect;
    for (const json& effect : gap_.at("effects"))
      for (const json& rival : effect.at("equivalent"))
        if (rival == name) return &effect;
    return nullptr;
  }
  std::string types() const {
    std::string all;
    for (const json& effect : gap_.at("effects")) all += effect.at("type").get<std::string>() + " ";
    return all;
  }

  /// Torque of the model that was written, sliding at a constant velocity in the middle of a run.
  double sliding_Nm(double velocity_rad_per_s) const {
    constexpr double kMiddle_s = 6;
    const model::effects::EffectChain chain(model_.effects);
    const double direction = velocity_rad_per_s < 0 ? -1 : 1;
    const auto* const offset = model_.find<model::effects::TorqueOffset>();
    return direction * chain.level_Nm({.speed_rad_per_s = std::abs(velocity_rad_per_s),
                                       .direction = direction,
                                       .running_s = kMiddle_s}) +
           (offset != nullptr ? offset->parameters().torque_Nm : 0);
  }
  /// Relative error over the means of all runs, in percent, as the peers have it.
  double map_error_percent(int drive) const {
    double square = 0;
    double all = 0;
    for (const auto& point : test_support::screw_drive_map(drive).points) {
      square += std::pow(point.torque_Nm - sliding_Nm(point.velocity_rad_per_s), 2);
      all += point.torque_Nm * point.torque_Nm;
    }
    return 100 * std::sqrt(square / all);
  }

  support::TemporaryDirectory directory_;
  json gap_;
  model::effects::DriveModel model_;
};

TEST_F(RealData, APlainLeadScrewTurnsHarderOneWayAndHasAStribeckCurve) {
  explain(real_recordings::screw_drive(kData / "tro2021_screw_drives", 1));
  const json* const asymmetry = found("direction_asymmetry");
  ASSERT_NE(asymmetry, nullptr) << types();
  EXPECT_NE(found("torque_offset"), nullptr) << "constant speeds do not tell them apart";
  EXPECT_EQ(found("torque_offset"), asymmetry);
  ASSERT_NE(found("stribeck"), nullptr) << types();
  EXPECT_LT(gap("after"), 0.7 * gap("refitted"));
  // Peers: 12.2 % with Coulomb and viscous friction, 4.0 % with the asymmetry, 1.0 % with a Stribeck curve
  // and a quadratic term.
  EXPECT_LT(map_error_percent(1), 2.5);
  // Measured: 2.76 mN·m at 1 rad/s falls to 2.53 at 5, and is 3.21 at 21.
  EXPECT_GT(sliding_Nm(1.0), 1.04 * sliding_Nm(5.2));
  EXPECT_GT(sliding_Nm(20.8), 1.1 * sliding_Nm(5.2));
}

TEST_F(RealData, AnAntiBacklashScrewTurnsHarderOneWayAndHasNoStribeckCurve) {
  explain(real_recordings::screw_drive(kData / "tro2021_screw_drives", 2));
  EXPECT_EQ(found("stribeck"), nullptr) << types();
  const json* const asymmetry = found("direction_asymmetry");
  ASSERT_NE(asymmetry, nullptr) << types();
  EXPECT_EQ(found("torque_offset"), asymmetry);
  EXPECT_EQ(asymmetry->at("equivalent").size(), 1U) << asymmetry->dump();
  EXPECT_NE(asymmetry->at("deciding_experiment"), "");
  // Its speed loop answers a ripple of the screw, which goes with the acceleration: five hundred times the
  // inertia would explain it.
  EXPECT_EQ(found("inertia"), nullptr) << types();
  EXPECT_LT(gap("after"), 0.25 * gap("before"));
  EXPECT_LT(map_error_percent(2), 2.9);  // peers: 3.0 % without, 1.8 % with the asymmetry
}

TEST_F(RealData, OmniWheelsLostTheSignOfTheirCurrentAndAnswerLate) {
  constexpr double kPeerCoulomb_Nm[] = {8.9e-3, 7.5e-3, 8.4e-3};  // motor side
  constexpr double kGear = 16;
  for (const int motor : {1, 2, 3}) {
    explain(real_recordings::omni_wheel(kData / "robotino_wheel", motor));
    ASSERT_GE(gap_.at("effects").size(), 2U) << types();
    EXPECT_EQ(gap_.at("effects").at(0).at("type"), "unsigned_current");
    EXPECT_EQ(gap_.at("effects").at(1).at("type"), "transport_delay");
    EXPECT_LT(gap("after"), 0.3 * gap("before"));
    // Peers: 0.09 s where a first-order response explains the rest; 0.153 s from step to first motion.
    const json& delay = gap_.at("effects").at(1).at("parameters").at("delay_s");
    EXPECT_NEAR(delay.at("value"), 0.09, 0.03);
    EXPECT_LT(delay.at("ci95").at(0), 0.09);
    EXPECT_GT(delay.at("ci95").at(1), 0.09);
    const auto* const coulomb = model_.find<model::effects::Coulomb>();
    ASSERT_NE(coulomb, nullptr);
    EXPECT_NEAR(coulomb->parameters().torque_Nm / kGear, kPeerCoulomb_Nm[motor - 1],
                0.2 * kPeerCoulomb_Nm[motor - 1]);
  }
}

TEST_F(RealData, AnOutrunnerCogs) {
  explain(real_recordings::outrunner(kData / "odrive_cogging"));
  EXPECT_EQ(gap_.at("effects").at(0).at("type"), "cogging") << types();
  EXPECT_EQ(found("stribeck"), nullptr) << types();
  EXPECT_LT(gap("after"), 0.5 * gap("refitted"));
  // Held-position map a_4: the largest harmonics, and 7.5 mN·m/A.
  const auto amplitude_A = [&](double per_turn) {
    double most = 0;
    for (const model::effects::AnyEffect& effect : model_.effects)
      if (const auto* const cogging = std::get_if<model::effects::Cogging>(&effect))
        if (std::abs(cogging->parameters().periods_per_rev - per_turn) < 0.02 * per_turn)
          most = std::max(most, cogging->parameters().amplitude_Nm / 7.5e-3);
    return most;
  };
  EXPECT_NEAR(amplitude_A(7), 0.86, 0.1);
  // Where the motor jumps over the shorter waves, it does not show all of them.
  EXPECT_NEAR(amplitude_A(14), 0.35, 0.15);
  EXPECT_NEAR(amplitude_A(28), 0.56, 0.35);
  // Each harmonic with its own numbers.
  std::set<double> periods;
  std::size_t harmonics = 0;
  for (const json& effect : gap_.at("effects")) {
    if (effect.at("type") != "cogging") continue;
    ++harmonics;
    periods.insert(effect.at("parameters").at("periods_per_rev").at("value").get<double>());
  }
  EXPECT_EQ(periods.size(), harmonics) << gap_.at("effects").dump();
}

TEST_F(RealData, AServoThatLiftsAWeightRubsMoreUnderLoad) {
  explain(real_recordings::pendulum_servo(kData / "bam_xl330"));
  const json* const load = found("load_friction");
  ASSERT_NE(load, nullptr) << types();
  EXPECT_EQ(found("stribeck"), nullptr) << types();
  EXPECT_LT(gap("after"), 0.8 * gap("refitted"));
  // Published for this type of servo, from other recordings: 0.267.
  EXPECT_NEAR(load->at("parameters").at("share").at("value"), 0.267, 0.1);
}

// Recordings of a gain that was not searched, from the set-points alone: bam's best published model of these
// recordings is off by 0.061 rad at this gain (M3), its best with all terms by 0.074 rad over all gains (M6).
TEST_F(RealData, AServoFollowsItsSetPointsWithNamedEffectsCloserThanPublished) {
  explain(real_recordings::pendulum_loop(kData / "bam_xl330"));
  const json& loop = gap_.at("closed_loop");
  EXPECT_TRUE(loop.at("held_out").get<bool>());
  EXPECT_LT(loop.at("after"), 0.045) << types();
  EXPECT_LT(loop.at("after"), loop.at("before"));
  EXPECT_NE(found("load_friction"), nullptr) << types();
}

}  // namespace real_data_test
