// The command youbot-bench identify: reads files, writes table and model, reports errors.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>

#include "apps/youbot_bench/model_writer.h"
#include "model/friction/wheel_curve.h"
#include "runtime/configuration/drive_model_file.h"
#include "tests/support/built_paths.h"
#include "tests/support/measured_data.h"
#include "tests/support/run_command.h"
#include "tests/support/temporary_directory.h"

namespace identify_command_test {

namespace fs = std::filesystem;

class IdentifyCommand : public testing::Test {
 protected:
  std::string write(const std::string& name, const std::string& text) const {
    return directory_.write(name, text).string();
  }
  static std::string map_text(const identification::fit::StaticMap& map) {
    std::ostringstream text;
    text.precision(9);
    text << "# youbot recording v1\n# rig: " << map.rig << "\n# experiment: steady-state-map\n"
         << "time_s,velocity_rad_per_s,torque_measured_Nm,torque_ci95_Nm,velocity_command_rad_per_s\n";
    for (std::size_t i = 0; i < map.points.size(); ++i)
      text << i << ',' << map.points[i].velocity_rad_per_s << ',' << map.points[i].torque_Nm << ','
           << map.points[i].torque_ci95_Nm << ',' << map.points[i].velocity_rad_per_s << '\n';
    return text.str();
  }
  /// Into a new directory; both streams into output_; the exit code.
  int run(const std::string& arguments) {
    fs::remove_all(out());
    return run_again(arguments);
  }
  int run_again(const std::string& arguments) {
    const support::CommandResult result =
        support::run_command(support::program("youbot-bench") + " identify " + arguments + " --out " + out());
    output_ = result.output;
    return result.exit_code;
  }
  std::string out() const { return (directory_ / "out").string(); }
  static std::string text_of(const fs::path& path) {
    std::ifstream file(path);
    std::ostringstream text;
    text << file.rdbuf();
    return text.str();
  }
  std::string model() const { return text_of(directory_ / "out" / "model.toml"); }
  /// The model file: it loads in every place for a model, and its values are plausible.
  model::effects::DriveModel drive_model() const {
    model::effects::DriveModel model = runtime::read_drive_model(directory_ / "out" / "model.toml");
    const auto* const coulomb = model.find<model::effects::Coulomb>();
    if (const auto* const stribeck = model.find<model::effects::Stribeck>()) {
      const double coulomb_Nm = coulomb != nullptr ? coulomb->parameters().torque_Nm : 0;
      EXPECT_GE(stribeck->parameters().static_torque_Nm, coulomb_Nm) << this->model();
    }
    return model;
  }
  bool said(const std::string& part) const { return output_.find(part) != std::string::npos; }

  support::TemporaryDirectory directory_;
  std::string output_;
};

TEST_F(IdentifyCommand, WritesAStribeckEffectForThePlainScrewOnly) {
  EXPECT_EQ(run("--map " + write("1.csv", map_text(test_support::screw_drive_map(1)))), 0) << output_;
  EXPECT_TRUE(said("95 % interval")) << output_;
  EXPECT_NE(model().find("format = \"youbot-drive-model/1\"\nname = \"tro2021-drive-1\""), std::string::npos);
  EXPECT_NE(model().find("type = \"stribeck\""), std::string::npos) << model();
  EXPECT_NE(model().find("type = \"torque_offset\""), std::string::npos);
  // Nothing determines the inertia, without which the file is not a model.
  EXPECT_EQ(drive_model().inertia_kg_m2, model::effects::DriveModel{}.inertia_kg_m2);
  EXPECT_NE(model().find("# inertia_kg_m2 is assumed"), std::string::npos) << model();
  EXPECT_TRUE(said("the model assumes 0.0112 kg·m²")) << output_;

  EXPECT_EQ(run("--inertia 2.186e-6 --map " + write("2.csv", map_text(test_support::screw_drive_map(2)))), 0);
  EXPECT_EQ(model().find("type = \"stribeck\""), std::string::npos) << model();
  EXPECT_NE(model().find("inertia_kg_m2 = 2.186e-06"), std::string::npos) << model();
  EXPECT_NE(model().find("coefficient_Nm_s_per_rad = "), std::string::npos);
}

TEST_F(IdentifyCommand, FitsTheLawThatIsAskedFor) {
  const std::string map = write("1.csv", map_text(test_support::screw_drive_map(1)));
  EXPECT_EQ(run("--law kfm+offset+asymmetry --map " + map), 0) << output_;
  EXPECT_TRUE(said("coulomb + viscous + stribeck + torque offset + direction asymmetry")) << output_;
  EXPECT_EQ(run("--law nonsense --map " + map), 2);
  EXPECT_TRUE(said("there is no friction law nonsense")) << output_;
  EXPECT_EQ(run("--law kfm+sugar --map " + map), 2);
}

TEST_F(IdentifyCommand, FrictionThatRisesFromRestGivesAModelWithoutAStaticTorqueBelowCoulomb) {
  // What fitted the measured wheels best when a Stribeck term was allowed to be a hollow.
  identification::fit::StaticMap map{"wheel-1", {}};
  for (int i = 1; i <= 40; ++i) {
    const double speed = 0.2 * i;
    map.points.push_back({speed, 0.19 - 0.14 * std::exp(-speed * speed / 41) + 1e-4 * (i * 7 % 5 - 2), 2e-4});
  }
  const std::string file = write("rising.csv", map_text(map));
  for (const char* law : {"auto", "kfm", "kfm+quadratic", "stiction"}) {
    EXPECT_EQ(run(std::string("--law ") + law + " --map " + file), 0) << output_;
    EXPECT_FALSE(drive_model().effects.empty()) << law << "\n" << model();
  }
}

TEST_F(IdentifyCommand, ReadmesChainOnTheMeasuredWheelsEndsInADip) {
  const auto bench = [this](const std::string& experiment) {
    const support::CommandResult result =
        support::run_command(support::program("youbot-bench") + " " + experiment +
                             " --quiet --joint wheel-1 --out " + directory_.path().string());
    EXPECT_EQ(result.exit_code, 0) << result.output;
  };
  bench("steady-state --sets 1,4,6 --settle 2 --measure 3");
  bench("multisine --periods 2");
  bench("staircase --hold 0.4");
  EXPECT_EQ(run("--map " + (directory_ / "steady-state-map").string() + " --moving " +
                (directory_ / "multisine/wheel-1.csv").string()),
            0)
      << output_;
  const model::effects::DriveModel model = drive_model();
  for (const char* effect : {"coulomb", "viscous", "stribeck"})
    EXPECT_TRUE(std::ranges::any_of(model.effects,
                                    [&](const auto& any) { return model::effects::name_of(any) == effect; }))
        << effect << "\n"
        << this->model();
  EXPECT_NEAR(model.inertia_kg_m2, 0.0107, 0.0005);
  bench("torque-ramp --repeats 1 --rest 1 --model " + out() + "/model.toml");

  const support::CommandResult gap = support::run_command(
      support::program("youbot-gap") + " --model " + out() + "/model.toml --out " +
      (directory_ / "gap").string() + " --data " + (directory_ / "staircase/wheel-1.csv").string());
  EXPECT_EQ(gap.exit_code, 0) << gap.output;
  EXPECT_TRUE(gap.said("+ midspeed dip")) << gap.output;
}

TEST_F(IdentifyCommand, ASlowMapGivesALawThatBrakesAndSaysHowFarItWasMeasured) {
  // Up to 0.5 rad/s the measured wheel looks like a parabola as well, which would drive from 1 rad/s on.
  identification::fit::StaticMap map{"wheel-1", {}};
  for (int i = 1; i <= 10; ++i)
    map.points.push_back({0.05 * i, model::friction::wheel_curve_Nm(1, 0.05 * i), 5e-5});
  const std::string file = write("slow.csv", map_text(map));
  EXPECT_EQ(run("--map " + file), 0) << output_;
  EXPECT_TRUE(std::ranges::none_of(drive_model().effects, [](const auto& any) {
    return model::effects::name_of(any) == "quadratic_drag";
  })) << model();
  EXPECT_NE(model().find("# friction measured from 0.05 to 0.5 rad/s: beyond, this model is a guess"),
            std::string::npos)
      << model();
  EXPECT_EQ(run("--law stiction+quadratic --map " + file), 2) << output_;
  EXPECT_TRUE(said("no model of wheel-1 is written: its friction drives the joint from 0.9")) << output_;
  EXPECT_FALSE(fs::exists(directory_ / "out/model.toml"));
}

TEST_F(IdentifyCommand, AMapThatDeterminesNoFrictionGivesNoModel) {
  for (const auto& points : std::vector<std::vector<identification::fit::MapPoint>>{
           {{2, 0.3, 1e-4}}, {{2, 0.3, 1e-4}, {-2, -0.3, 1e-4}}, {{2, 0.3, 1e-4}, {4, 0.4, 1e-4}}}) {
    EXPECT_EQ(run("--map " + write("few.csv", map_text({"axis", points}))), 2) << output_;
    EXPECT_TRUE(said("no model of axis is written: its map determines no friction: too few speeds: "))
        << output_;
    EXPECT_FALSE(fs::exists(directory_ / "out/model.toml"));
  }
}

TEST_F(IdentifyCommand, AMapOfOneDirectionSaysWhatItCannotShow) {
  identification::fit::StaticMap map{"axis", {}};
  for (int i = 1; i <= 10; ++i) map.points.push_back({0.5 * i, 0.3 + 0.01 * i, 1e-4});
  EXPECT_EQ(run("--map " + write("one_way.csv", map_text(map))), 0) << output_;
  const std::string limit = "only positive speeds were measured: a torque offset, or friction that differs";
  EXPECT_TRUE(said("! " + limit)) << output_;
  EXPECT_NE(model().find("# " + limit), std::string::npos) << model();
}

TEST_F(IdentifyCommand, ReplacesNothingAndIsQuietOnRequest) {
  const std::string map = write("1.csv", map_text(test_support::screw_drive_map(1)));
  EXPECT_EQ(run("--quiet --law coulomb --map " + map), 0);
  EXPECT_EQ(output_, "");
  const std::string first = model();
  EXPECT_EQ(run_again("--law kfm --map " + map), 2);
  EXPECT_TRUE(said("is there already and is not replaced")) << output_;
  EXPECT_EQ(model(), first);
  fs::remove_all(out());
  write("out", "a file");
  EXPECT_EQ(run_again("--law kfm --map " + map), 3);
  EXPECT_TRUE(said("cannot be the directory for the results")) << output_;
  EXPECT_FALSE(said("sliding:")) << "before the work: " << output_;
}

TEST_F(IdentifyCommand, MapsOfSeveralDrivesGiveAModelEachAndOneReport) {
  for (const int drive : {1, 2})
    write("run/steady-state-map/" + std::to_string(drive) + ".csv",
          map_text(test_support::screw_drive_map(drive)));
  EXPECT_EQ(run("--law coulomb --map " + (directory_ / "run").string()), 0) << output_;
  for (const char* drive : {"tro2021-drive-1", "tro2021-drive-2"}) {
    EXPECT_NE(text_of(directory_ / "out" / drive / "model.toml").find(std::string("name = \"") + drive),
              std::string::npos);
    EXPECT_NE(
        text_of(directory_ / "out" / "report.html").find(std::string("\"name\":\"") + drive + ", fitted"),
        std::string::npos);
  }
  EXPECT_FALSE(fs::exists(directory_ / "out" / "model.toml"));

  EXPECT_EQ(run("--map " + directory_.path().string()), 2);
  EXPECT_TRUE(said("there is no .csv or .mcap in")) << output_;
}

TEST_F(IdentifyCommand, LeavesOutTheGivenSpeedsAndReportsWhich) {
  // Coulomb and viscous friction but for a dip between 1 and 4 rad/s.
  identification::fit::StaticMap map{"wheel-1", {}};
  for (int i = 1; i <= 16; ++i)
    for (const double sign : {1.0, -1.0}) {
      const double speed = 0.4 * i;
      const double dip_Nm = speed > 1 && speed < 4 ? 0.02 : 0.0;
      map.points.push_back(
          {sign * speed, sign * (0.045 + 0.0125 * speed - dip_Nm) + 1e-5 * (i * 7 % 5 - 2), 2e-5});
    }
  const std::string file = write("dip.csv", map_text(map));
  EXPECT_EQ(run("--law kfm --speeds-below 1 --speeds-above 4 --map " + file), 0) << output_;
  EXPECT_TRUE(said("fitted without speeds from 1 to 4 rad/s: 14 of 32 points left out, at 1.2 -1.2 1.6"))
      << output_;
  EXPECT_NE(model().find("# fitted without speeds from 1 to 4 rad/s: 14 of 32"), std::string::npos)
      << model();
  const auto coulomb = [this] {
    const std::string text = model();
    const std::size_t at = text.find("torque_Nm = ");
    return at == text.npos ? 0.0 : std::stod(text.substr(at + 12));
  };
  EXPECT_NEAR(coulomb(), 0.045, 2e-4) << model();
  EXPECT_NE(text_of(directory_ / "out" / "report.html").find("\"left out\""), std::string::npos);

  EXPECT_EQ(run("--law kfm --speeds-above 1.1 --speeds-below 3.9 --map " + file), 0) << output_;
  EXPECT_TRUE(said("fitted to speeds from 1.1 to 3.9 rad/s: 18 of 32 points left out\n")) << output_;
  EXPECT_NEAR(coulomb(), 0.025, 2e-4) << model();

  EXPECT_EQ(run("--speeds-above 4 --speeds-below 4 --map " + file), 2);
  EXPECT_EQ(run("--speeds-above 100 --map " + file), 2);
  EXPECT_TRUE(said("no speed in the map of wheel-1 is left to fit")) << output_;
  EXPECT_EQ(run("--speeds-above -1 --map " + file), 2);
  EXPECT_EQ(run("--inertia 1 --speeds-above 1 --moving " + file), 2);
  EXPECT_TRUE(said("give it with --map")) << output_;
}

TEST_F(IdentifyCommand, GoesOnWithoutThePointsThatCouldNotBeMeasured) {
  std::string text = map_text(test_support::screw_drive_map(2));
  const std::size_t names = text.find("time_s,");
  text.insert(names,
              "# not_measured: velocity_rad_per_s,torque_measured_Nm,torque_ci95_Nm: wheel-3 did not turn\n");
  EXPECT_EQ(run("--law coulomb --map " + write("map.csv", text + "999,nan,nan,nan,0.5\n")), 0) << output_;
  EXPECT_TRUE(said("velocity_rad_per_s and 2 more were not measured: wheel-3 did not turn")) << output_;
  EXPECT_EQ(run("--moving " + write("moving.csv", text + "999,nan,nan,nan,0.5\n")), 2);
  EXPECT_TRUE(said("wheel-3 did not turn")) << output_;
}

TEST_F(IdentifyCommand, RefusesWhatDoesNotFitTogether) {
  const std::string one = write("1.csv", map_text(test_support::screw_drive_map(1)));
  const std::string two = write("2.csv", map_text(test_support::screw_drive_map(2)));
  EXPECT_EQ(run("--inertia 1e-6 --map " + one + " " + two + " --presliding " + one), 2);
  EXPECT_TRUE(said("identify one rig at a time")) << output_;
  EXPECT_EQ(run(""), 2);
  EXPECT_EQ(run("--map " + one + ".missing"), 2);
  EXPECT_TRUE(said("cannot be opened")) << output_;
  EXPECT_EQ(run("--presliding " + one), 2);
  EXPECT_EQ(run("--presliding " + one + " --map " + one), 2);
  EXPECT_TRUE(said("--inertia")) << output_;
  EXPECT_EQ(run("--moving " + one), 2);
  EXPECT_EQ(run("--law kfm --moving " + one), 2);
  EXPECT_TRUE(said("--law: is fitted to a map")) << output_;
  EXPECT_EQ(run("--map " + write("3.csv", "# youbot recording v1\ntime_s,velocity_rpm\n0,nan\n")), 2);
  EXPECT_TRUE(said("3.csv:2: column 'velocity_rpm' must be velocity_rad_per_s")) << output_;
  EXPECT_TRUE(said("3.csv:3: velocity_rpm 'nan'")) << output_;
  EXPECT_FALSE(fs::exists(directory_ / "out" / "model.toml"));
}

TEST_F(IdentifyCommand, GoesFromMapMotionAndPreslidingToOneModel) {
  identification::fit::StaticMap map{"wheel-1", {}};
  for (int i = 1; i <= 10; ++i)
    for (const double sign : {1.0, -1.0})
      map.points.push_back(
          {0.6 * i * sign, sign * (0.045 + 0.0125 * 0.6 * i) + 1e-4 * ((i * 7) % 5 - 2), 2e-4});
  std::ostringstream moving;
  moving.precision(12);
  moving << "# youbot recording v1\n# rig: wheel-1\n# experiment: "
            "moving\ntime_s,torque_measured_Nm,position_rad\n";
  for (int i = 0; i < 8000; ++i) {
    const double t = i * 1e-3;
    const double v = 5 * std::sin(3 * t);
    const double torque = 0.0112 * 15 * std::cos(3 * t) + (v > 0 ? 0.045 : -0.045) + 0.0125 * v;
    moving << t << ',' << torque + 1e-4 * ((i * 13) % 7 - 3) << ',' << -5.0 / 3 * std::cos(3 * t) << '\n';
  }
  std::ostringstream coarse;
  coarse << "# youbot recording v1\n# rig: wheel-1\n# experiment: "
            "presliding\ntime_s,torque_measured_Nm,position_rad\n";
  for (int i = 0; i < 2000; ++i)
    coarse << i * 1e-3 << ',' << 0.03 * std::sin(0.01 * i) << ',' << (i % 600 < 300 ? 0 : 6.04e-5) << '\n';
  EXPECT_EQ(run("--map " + write("map.csv", map_text(map)) + " --moving " +
                write("moving.csv", moving.str()) + " --presliding " + write("presliding.csv", coarse.str())),
            0)
      << output_;
  EXPECT_TRUE(said("encoder is too coarse")) << output_;
  EXPECT_NE(model().find("inertia_kg_m2 = 0.0112"), std::string::npos) << model();
  EXPECT_EQ(model().find("type = \"presliding\""), std::string::npos) << model();
  EXPECT_NE(model().find("# not identifiable: presliding stiffness_Nm_per_rad"), std::string::npos)
      << model();
}

/// σ0 and σ1 are LuGre's: with another shape of the bristle they would be another law's.
TEST(ModelWriter, WritesThePreslidingThatWasFitted) {
  youbot_bench::IdentifiedModel model{.name = "wheel-1"};
  model.presliding = {
      {.name = "stiffness_Nm_per_rad", .value = 250, .lower = 240, .upper = 260, .effect = "presliding"},
      {.name = "damping_Nm_s_per_rad", .value = 0.127, .lower = 0.12, .upper = 0.13, .effect = "presliding"},
      {.name = "exponent", .value = 1, .not_identifiable = "given, LuGre's", .effect = "presliding"}};
  const auto written = youbot_bench::drive_model_of(model);
  const auto* presliding = written.find<model::effects::Presliding>();
  ASSERT_NE(presliding, nullptr);
  EXPECT_EQ(presliding->parameters().stiffness_Nm_per_rad, 250);
  EXPECT_EQ(presliding->parameters().damping_Nm_s_per_rad, 0.127);
  EXPECT_EQ(presliding->parameters().exponent, 1);
}

}  // namespace identify_command_test
