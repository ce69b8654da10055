// Model files: written files read back, and errors are named with their line.
#include "runtime/configuration/drive_model_file.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <variant>
#include <vector>

#include "model/effects/any_effect.h"
#include "model/effects/basis.h"
#include "model/effects/effect_chain.h"
#include "model/friction/wheel_curve.h"
#include "model/servo_law_keys.h"
#include "runtime/configuration/toml_reader.h"
#include "sim/model_drive.h"
#include "tests/support/built_paths.h"
#include "tests/support/temporary_directory.h"

namespace runtime {
namespace drive_model_file_test {

using model::effects::DriveModel;
using model::effects::make_effect;

class DriveModelFile : public testing::Test {
 protected:
  DriveModel read(const std::string& text) { return read_drive_model(directory_.write(kName, text)); }
  /// Without the path in front.
  std::vector<std::string> problems(const std::string& text) {
    try {
      (void)read(text);
    } catch (const ConfigError& error) {
      std::vector<std::string> found;
      for (const std::string& problem : error.problems())
        found.push_back(problem.substr((directory_ / kName).string().size()));
      return found;
    }
    return {};
  }

  static constexpr const char* kName = "model.toml";
  support::TemporaryDirectory directory_;
};

constexpr const char* kHead =
    "format = \"youbot-drive-model/1\"\nname = \"wheel-1\"\ninertia_kg_m2 = 0.0112\n";

TEST_F(DriveModelFile, EffectsThatLeaveNoInertiaAreRefusedWithTheirLine) {
  const std::string effect = "[[effect]]\ntype = \"inertia\"\ndifference_kg_m2 = ";
  EXPECT_EQ(problems(kHead + effect + "-0.01\n"), std::vector<std::string>{});
  EXPECT_EQ(
      problems(kHead + effect + "-0.01\n" + effect + "-0.0022\n"),
      std::vector<std::string>{":9: 'effect[1].difference_kg_m2' leaves -0.001 kg m² of 'inertia_kg_m2', "
                               "allowed is more than 0"});
}

TEST_F(DriveModelFile, TheContractsExampleIsRead) {
  const DriveModel model = read(std::string(kHead) +
                                "[sensor]\nencoder_ticks_per_rev = 104000\ntorque_noise_Nm = 0.0015\n"
                                "[[effect]]\ntype = \"coulomb\"\ntorque_Nm = 0.045\n"
                                "[[effect]]\ntype = \"viscous\"\ncoefficient_Nm_s_per_rad = 0.0125\n");
  EXPECT_EQ(model.name, "wheel-1");
  EXPECT_EQ(model.inertia_kg_m2, 0.0112);
  EXPECT_EQ(model.encoder_ticks_per_rev, 104000);
  EXPECT_EQ(model.torque_noise_Nm, 0.0015);
  ASSERT_EQ(model.effects.size(), 2U);
  EXPECT_EQ(parameter_of(model.effects[0], "torque_Nm"), 0.045);
  EXPECT_EQ(parameter_of(model.effects[1], "coefficient_Nm_s_per_rad"), 0.0125);
}

/// As `youbot-gap` wrote it when a gap had two parameters.
TEST_F(DriveModelFile, AGapWithoutItsLaterParametersIsRead) {
  const DriveModel model =
      read(std::string(kHead) + "[[effect]]\ntype = \"backlash\"\ngap_rad = 0.01\nload_share = 0.3\n");
  ASSERT_EQ(model.effects.size(), 1U);
  EXPECT_EQ(parameter_of(model.effects[0], "gap_rad"), 0.01);
  EXPECT_EQ(parameter_of(model.effects[0], "load_share"), 0.3);
  EXPECT_EQ(parameter_of(model.effects[0], "friction_ratio"), 1) << "inertia and friction had one share";
}

TEST_F(DriveModelFile, ATorqueWithoutANameReadsBackToTheLastDigit) {
  using model::effects::Empirical;
  DriveModel model{.name = "odd", .inertia_kg_m2 = 0.0112, .effects = {make_effect("coulomb")}};
  model.effects.emplace_back(Empirical({{Empirical::Along::kVelocity, Empirical::Times::kOne,
                                         model::EvenTable::over(-8.1, 7.9, {0.1 + 0.2, -1e-9, 3})},
                                        {Empirical::Along::kTurn, Empirical::Times::kDirection,
                                         model::EvenTable::of_a_turn({0.01, 1.0 / 3})}}));
  const std::string text = drive_model_text(model);
  const DriveModel again = read(text);
  ASSERT_EQ(again.effects.size(), 2U) << text;
  const auto* const empirical = std::get_if<Empirical>(&again.effects[1]);
  ASSERT_NE(empirical, nullptr);
  ASSERT_EQ(empirical->terms().size(), 2U);
  EXPECT_EQ(empirical->terms()[0].along, Empirical::Along::kVelocity);
  EXPECT_EQ(empirical->terms()[0].table.from(), -8.1);
  EXPECT_EQ(empirical->terms()[0].table.to(), 7.9);
  EXPECT_EQ(empirical->terms()[0].table.values(), (std::vector<double>{0.1 + 0.2, -1e-9, 3}));
  EXPECT_EQ(empirical->terms()[1].times, Empirical::Times::kDirection);
  EXPECT_TRUE(empirical->terms()[1].table.repeats());
  EXPECT_NE(text.find("the last value holds"), std::string::npos) << "the range of validity";
}

TEST_F(DriveModelFile, EffectsWithoutTheirLaterParametersAreRead) {
  const DriveModel model = read(std::string(kHead) +
                                "[[effect]]\ntype = \"load_friction\"\nshare = 0.2\n"
                                "[[effect]]\ntype = \"position_friction\"\namplitude_Nm = 0.01\n"
                                "[[effect]]\ntype = \"encoder_eccentricity\"\namplitude_rad = 0.001\n");
  ASSERT_EQ(model.effects.size(), 3U);
  EXPECT_EQ(model::effects::parameter_of(model.effects[0], "backdriving_ratio"), 1);
  EXPECT_EQ(model::effects::parameter_of(model.effects[0], "load_share"), 0);
  EXPECT_EQ(model::effects::parameter_of(model.effects[1], "periods_per_rev"), 1);
  EXPECT_EQ(model::effects::parameter_of(model.effects[2], "periods_per_rev"), 1);
  EXPECT_EQ(problems(std::string(kHead) + "[[effect]]\ntype = \"torque_ripple\"\nshare = 0.02\n").size(), 1U)
      << "which ripple";
}

TEST_F(DriveModelFile, ADriveHasOneGear) {
  const std::string gear = "[[effect]]\ntype = \"load_friction\"\nshare = 0.2\n";
  const auto found = problems(std::string(kHead) + gear + gear);
  ASSERT_EQ(found.size(), 1U);
  EXPECT_NE(found[0].find("a drive has one gear"), std::string::npos) << found[0];
}

TEST_F(DriveModelFile, ATermThatIsNoneIsRefusedWithItsLine) {
  const std::string effect = std::string(kHead) + "[[effect]]\ntype = \"empirical\"\n";
  EXPECT_EQ(problems(effect),
            std::vector<std::string>{
                ":4: 'effect[0].term' is missing: an empirical effect has one [[effect.term]] or more"});
  EXPECT_EQ(problems(effect + "[[effect.term]]\nalong = \"load_Nm\"\ntimes = \"velocity\"\nfrom = 0\nto = "
                              "1\nvalues = [0, 1]\n"),
            std::vector<std::string>{
                ":8: 'effect[0].term[0].times' is 'velocity', which no table over load_Nm takes"});
  EXPECT_EQ(problems(effect + "[[effect.term]]\nalong = \"load_Nm\"\ntimes = \"direction\"\nfrom = 1\nto = "
                              "1\nvalues = [0, 1]\n")
                .size(),
            1U);
  EXPECT_FALSE(problems(effect +
                        "[[effect.term]]\nalong = \"load_Nm\"\ntimes = \"direction\"\nfrom = 0\nto = "
                        "1\nvalues = 3\n")
                   .empty());
}

TEST_F(DriveModelFile, AServoReadsBack) {
  DriveModel model{.name = "servo", .inertia_kg_m2 = 0.01};
  model.servo = model::ServoLaw{.output = model::ServoLaw::Output::kVoltage,
                                .position_gain = 4.26,
                                .velocity_gain = 0.1,
                                .integral_gain = 0.3,
                                .limit = 7.4,
                                .torque_constant_Nm_per_A = 0.366,
                                .resistance_ohm = 2.81};
  const DriveModel again = read(drive_model_text(model));
  ASSERT_TRUE(again.servo);
  EXPECT_EQ(again.servo->output, model::ServoLaw::Output::kVoltage);
  for (const model::ServoKey& key : model::kServoKeys)
    EXPECT_EQ((*again.servo).*(key.member), (*model.servo).*(key.member)) << key.name;
  EXPECT_FALSE(read(kHead).servo);
  EXPECT_EQ(
      problems(std::string(kHead) + "[servo]\noutput = \"torque\"\nlimit = 1\nresistance_ohm = 2\n").size(),
      1U)
      << "a current loop has no resistance";
}

TEST_F(DriveModelFile, EveryEffectReadsBackToTheLastDigit) {
  DriveModel model{.name = "a \"drive\"",
                   .inertia_kg_m2 = 0.1 + 0.2,
                   .encoder_ticks_per_rev = 4096,
                   .torque_noise_Nm = 1.0 / 3,
                   .effects = {}};
  for (const auto& description : model::effects::effect_descriptions())
    model.effects.push_back(make_effect(description.name));
  const DriveModel again = read(
      drive_model_text(model, std::vector<std::string>{"made by a test\nin two lines"},
                       std::vector<EffectRemarks>{{.evidence = {"seen"}, .parameters = {"95 %: 1 to 2"}}}));
  EXPECT_EQ(again.name, model.name);
  EXPECT_EQ(again.inertia_kg_m2, model.inertia_kg_m2);
  EXPECT_EQ(again.torque_noise_Nm, model.torque_noise_Nm);
  ASSERT_EQ(again.effects.size(), model.effects.size());
  for (std::size_t i = 0; i < model.effects.size(); ++i) {
    ASSERT_EQ(again.effects[i].index(), model.effects[i].index());
    for (const auto& parameter : model::effects::effect_descriptions()[i].parameters)
      EXPECT_EQ(parameter_of(again.effects[i], parameter.name),
                parameter_of(model.effects[i], parameter.name));
  }
}

TEST_F(DriveModelFile, EveryFrictionLawReadsBackToTheLastDigit) {
  for (const auto& law : model::effects::friction_law_effects()) {
    std::vector<model::effects::NamedValue> values;
    for (const auto& parameter : law.parameters)
      if (parameter.name != "wheel" && parameter.initial > 0)
        values.push_back({parameter.name, parameter.initial * (1 + 1e-3 / 3)});
    const DriveModel model{.inertia_kg_m2 = 0.01, .effects = {make_effect(law.name, values)}};
    const DriveModel again = read(drive_model_text(model));
    ASSERT_EQ(again.effects.size(), 1U) << law.name;
    EXPECT_EQ(name_of(again.effects[0]), law.name);
    EXPECT_EQ(values_of(again.effects[0]), values_of(model.effects[0])) << law.name;
  }
}

TEST_F(DriveModelFile, ALawNeedsNoParameterAndRefusesWhatItCannotBe) {
  const std::string head = std::string(kHead) + "[[effect]]\ntype = ";
  EXPECT_EQ(values_of(read(head + "\"lugre\"\n").effects.at(0)), values_of(make_effect("lugre")));
  const auto bounds = problems(head + "\"lugre\"\nstatic_Nm = -1.0\n");
  ASSERT_EQ(bounds.size(), 1U);
  EXPECT_NE(bounds[0].find("'effect[0].static_Nm'"), std::string::npos) << bounds[0];
  const auto half = problems(head + "\"measured_wheel\"\nwheel = 1.5\n");
  ASSERT_EQ(half.size(), 1U);
  EXPECT_NE(half[0].find("expected a whole number"), std::string::npos) << half[0];
}

// Thesis: curves of appendix A, a motor that delivers 0.03 N·m for any smaller command, current without sign.
TEST_F(DriveModelFile, TheWheelsOfTheThesisAreInFiles) {
  for (int wheel = 1; wheel <= 4; ++wheel) {
    const DriveModel model = read_drive_model(support::source_dir() + "/apps/youbot_sim/thesis/wheel-" +
                                              std::to_string(wheel) + ".toml");
    const model::effects::EffectChain chain(model.effects);
    for (const double velocity : {0.03, 0.2, 1.0, 3.2, -0.05, -4.0, -9.0})
      EXPECT_NEAR(model::effects::sliding_torque_Nm(chain, velocity),
                  model::friction::wheel_curve_Nm(wheel, velocity), 5e-4)
          << wheel << " at " << velocity;
    sim::ModelDrive drive(model, 1e-3);
    drive.step(-0.004);
    EXPECT_EQ(drive.delivered_Nm(), -0.03);
    EXPECT_EQ(drive.reported_Nm(), 0.03);
    for (int i = 0; i < 3000; ++i) drive.step(0.03 + 0.02 * std::min(i / 2000.0, 1.0));
    EXPECT_NEAR(drive.position_rad(), 0.05 / 250, 2e-6) << "held by the contact";
  }
}

TEST_F(DriveModelFile, WhatIsWrongIsNamedWithItsLine) {
  EXPECT_EQ(problems("format = \"youbot-drive-model/2\"\nname = \"x\"\ninertia_kg_m2 = 0.01\n"),
            std::vector<std::string>{
                ":1: 'format' is 'youbot-drive-model/2'; this program reads 'youbot-drive-model/1'"});
  const auto unknown = problems(std::string(kHead) + "[[effect]]\ntype = \"stickiness\"\ntorque_Nm = 1.0\n");
  ASSERT_EQ(unknown.size(), 1U);
  EXPECT_TRUE(unknown[0].starts_with(":5: 'effect[0].type' is 'stickiness'; there are coulomb, viscous"))
      << unknown[0];
  const auto no_type =
      problems(std::string(kHead) + "[[effect]]\nname = \"coulomb\"\ntorque_Nm = 1.0\nfriction = 2\n");
  ASSERT_EQ(no_type.size(), 1U) << "no key can be judged without the type";
  EXPECT_TRUE(no_type[0].starts_with(":4: 'effect[0].type' is missing; there are coulomb, viscous"))
      << no_type[0];
  const auto empty_type = problems(std::string(kHead) + "[[effect]]\ntype = \"\"\n");
  ASSERT_EQ(empty_type.size(), 1U);
  EXPECT_TRUE(empty_type[0].starts_with(":5: 'effect[0].type' names no effect; there are")) << empty_type[0];
  const auto key =
      problems(std::string(kHead) + "[[effect]]\ntype = \"coulomb\"\ntorque_Nm = 0.1\ntorque = 1.0\n");
  ASSERT_EQ(key.size(), 1U);
  EXPECT_TRUE(key[0].starts_with(":7: unknown key 'effect[0].torque'")) << key[0];
  const auto missing =
      problems(std::string(kHead) + "[[effect]]\ntype = \"stribeck\"\nstatic_torque_Nm = 0.1\n");
  ASSERT_EQ(missing.size(), 1U);
  EXPECT_NE(missing[0].find("'effect[0].velocity_rad_per_s' is missing"), std::string::npos) << missing[0];
  EXPECT_NE(
      problems(std::string(kHead) + "[[effect]]\ntype = \"coulomb\"\ntorque_Nm = -0.1\n").at(0).find(":6: "),
      std::string::npos);
  EXPECT_EQ(problems("name = \"x\"\n").size(), 2U);  // format and inertia
}

TEST_F(DriveModelFile, AModelHasUpTo32Effects) {
  const auto effects = [](int count) {
    std::string text(kHead);
    for (int i = 0; i < count; ++i) text += "[[effect]]\ntype = \"coulomb\"\ntorque_Nm = 0.1\n";
    return text;
  };
  EXPECT_EQ(problems(effects(32)), std::vector<std::string>{});
  EXPECT_EQ(problems(effects(33)), std::vector<std::string>{":4: 'effect' has 33 elements, allowed are 32"});
}

}  // namespace drive_model_file_test
}  // namespace runtime
