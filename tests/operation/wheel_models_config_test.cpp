// youbotd's configuration: drive models for the compensator and for the simulated wheels.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "operation/config.h"
#include "operation/demo_config.h"
#include "runtime/configuration/drive_model_file.h"
#include "runtime/configuration/hidden_effect.h"
#include "runtime/configuration/toml_reader.h"
#include "tests/support/built_paths.h"
#include "tests/support/temporary_directory.h"

namespace operation {
namespace wheel_models_config_test {

namespace fs = std::filesystem;

class WheelModels : public testing::Test {
 protected:
  WheelModels() {
    directory_.write("models/good.toml", runtime::drive_model_text(runtime::known_wheel_model()));
  }

  /// The one problem of a configuration, without the directory.
  std::string problem(const std::string& text) const {
    try {
      (void)load_config(directory_.write("lab.toml", text));
    } catch (const runtime::ConfigError& error) {
      EXPECT_EQ(error.problems().size(), 1U) << error.what();
      std::string what = error.problems().front();
      const std::string front = directory_.path().string() + "/";
      for (std::size_t at; (at = what.find(front)) != std::string::npos;) what.erase(at, front.size());
      return what;
    }
    return "";
  }

  support::TemporaryDirectory directory_;
};

TEST_F(WheelModels, StandRelativeToTheConfigurationAndReplaceTheMeasuredCurves) {
  const Config config =
      load_config(directory_.write("lab.toml",
                                   "[compensation]\nmodels = [\"models/good.toml\", \"models/good.toml\", "
                                   "\"models/good.toml\", \"models/good.toml\"]\n"));
  ASSERT_TRUE(config.cycle.controller.wheels.has_value());
  for (const model::JointResistance& wheel : *config.cycle.controller.wheels)
    EXPECT_NEAR(wheel.sliding.level_Nm(-2), 0.055 + 0.015 * 2, 1e-9);
  EXPECT_FALSE(load_config(directory_.write("plain.toml", "robot = \"loopback\"\n"))
                   .cycle.controller.wheels.has_value());
}

TEST_F(WheelModels, AMissingFileIsNamedWithTheLineThatNamesIt) {
  const std::string text = problem(
      "[compensation]\nenabled = true\nmodels = [\"models/good.toml\", \"models/good.toml\", "
      "\"models/none.toml\", \"models/good.toml\"]\n");
  EXPECT_EQ(
      text.find(
          "lab.toml:3: 'compensation.models' names a drive model that cannot be used: models/none.toml"),
      0U)
      << text;
}

TEST_F(WheelModels, AWrongCountIsRefused) {
  EXPECT_EQ(problem("[compensation]\nmodels = [\"models/good.toml\"]\n"),
            "lab.toml:2: 'compensation.models' should have a drive model for each of the 4 wheels, found 1");
}

TEST_F(WheelModels, FrictionThatWouldDriveAWheelAtASpeedItMayHaveIsRefused) {
  directory_.write("models/bent.toml",
                   "format = \"youbot-drive-model/1\"\ninertia_kg_m2 = 0.01\n[[effect]]\ntype = \"coulomb\"\n"
                   "torque_Nm = 0.08\n[[effect]]\ntype = \"quadratic_drag\"\n"
                   "coefficient_Nm_s2_per_rad2 = -0.00125\n");  // zero at 8 rad/s
  const std::string models =
      "[compensation]\nmodels = [\"models/good.toml\", \"models/bent.toml\", \"models/good.toml\", "
      "\"models/good.toml\"]\n";
  EXPECT_EQ(
      problem(models),
      "lab.toml:2: 'compensation.models' names a drive model that cannot be compensated up to "
      "'limits.wheel_speed_rad_per_s': models/bent.toml: its friction drives the joint from 8 rad/s on, "
      "instead of braking it");
  EXPECT_EQ(
      problem(
          "[path]\nspeed_m_per_s = 0.1\nturn_speed_rad_per_s = 0.1\n[limits]\nwheel_speed_rad_per_s = 7.9\n" +
          models),
      "");
}

TEST_F(WheelModels, AnUnknownEffectIsNamedWithBothLines) {
  directory_.write("models/bad.toml",
                   "format = \"youbot-drive-model/1\"\ninertia_kg_m2 = 0.01\n[[effect]]\ntype = \"magic\"\n");
  const std::string text = problem(
      "[compensation]\nmodels = [\"models/bad.toml\", \"models/good.toml\", \"models/good.toml\", "
      "\"models/good.toml\"]\n");
  EXPECT_EQ(text.find("lab.toml:2: "), 0U) << text;
  EXPECT_NE(text.find("models/bad.toml:4: 'effect[0].type' is 'magic'; there are coulomb"), std::string::npos)
      << text;
}

TEST_F(WheelModels, OtherThanAListOfNamesIsRefused) {
  EXPECT_EQ(problem("[compensation]\nmodels = \"models/good.toml\"\n"),
            "lab.toml:2: 'compensation.models' should be an array of strings, found a string");
  EXPECT_EQ(problem("[compensation]\nmodels = [1]\n"),
            "lab.toml:2: 'compensation.models[0]' should be a string, found an integer");
}

TEST_F(WheelModels, SimulatedWheelsFollowAModelOrHideAnEffectNotBoth) {
  const Config follows =
      load_config(directory_.write("a.toml", "[simulation]\nmodel = \"models/good.toml\"\n"));
  ASSERT_EQ(follows.robot.simulation.models.size(), 1U);
  EXPECT_EQ(follows.robot.simulation.models[0].effects.size(), runtime::known_wheel_model().effects.size());
  const Config hides = load_config(directory_.write("b.toml", "[simulation]\nhidden_effect = 3\n"));
  ASSERT_EQ(hides.robot.simulation.models.size(), 1U);
  EXPECT_EQ(runtime::drive_model_text(hides.robot.simulation.models[0]),
            runtime::drive_model_text(runtime::HiddenEffect(3).wheel_model()));
  const std::string both = problem("[simulation]\nmodel = \"models/good.toml\"\nhidden_effect = 3\n");
  EXPECT_EQ(both.find("lab.toml:3: 'simulation.hidden_effect' and 'simulation.model' exclude each other"), 0U)
      << both;
}

TEST_F(WheelModels, EachSimulatedWheelMayFollowAModelOfItsOwn) {
  directory_.write("models/stiff.toml",
                   "format = \"youbot-drive-model/1\"\nname = \"stiff\"\ninertia_kg_m2 = 0.01\n"
                   "[[effect]]\ntype = \"lugre\"\n");
  const Config config = load_config(directory_.write(
      "c.toml",
      "[simulation]\nmodels = [\"models/good.toml\", \"models/good.toml\", \"models/stiff.toml\", "
      "\"models/good.toml\"]\n"));
  ASSERT_EQ(config.robot.simulation.models.size(), 4U);
  EXPECT_EQ(config.robot.simulation.models[2].name, "stiff");
  EXPECT_EQ(problem("[simulation]\nmodels = [\"models/good.toml\"]\n"),
            "lab.toml:2: 'simulation.models' should have a drive model for each of the 4 wheels, found 1");
  const std::string both = problem(
      "[simulation]\nmodel = \"models/good.toml\"\nmodels = [\"models/good.toml\", "
      "\"models/good.toml\", \"models/stiff.toml\", \"models/good.toml\"]\n");
  EXPECT_EQ(both.find("lab.toml:3: 'simulation.models' and 'simulation.model' exclude each other"), 0U)
      << both;
}

TEST_F(WheelModels, TheBuiltInDemoIsTheFileItSays) {
  std::ifstream file(support::source_dir() + "/apps/youbotd/demo.toml", std::ios::binary);
  EXPECT_EQ(std::string(std::istreambuf_iterator<char>(file), {}), kDemoConfig);
}

}  // namespace wheel_models_config_test
}  // namespace operation
