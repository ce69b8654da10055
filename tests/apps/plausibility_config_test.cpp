// [plausibility] off = [...]: the file switches off a check that is wrong on a robot, with a warning.
#include <gtest/gtest.h>

#include <fstream>
#include <sstream>
#include <string>

#include "operation/config.h"
#include "runtime/configuration/plausibility_config.h"
#include "runtime/configuration/toml_reader.h"
#include "tests/support/built_paths.h"
#include "tests/support/run_command.h"
#include "tests/support/temporary_directory.h"

namespace plausibility_config_test {

using control::PlausibilityCheck;

control::ChecksOff loaded(const std::string& text) {
  const support::TemporaryDirectory folder;
  return operation::load_config(folder.write("lab.toml", text.empty() ? "robot = \"loopback\"\n" : text))
      .cycle.checks_off;
}

TEST(PlausibilityConfig, SwitchesOffWhatItNamesAndNothingElse) {
  EXPECT_TRUE(loaded("").none());
  EXPECT_TRUE(loaded("[plausibility]\noff = []\n").none());
  const control::ChecksOff off = loaded("[plausibility]\noff = [\"wheel_agreement\", \"opposed_motion\"]\n");
  EXPECT_TRUE(off.has(PlausibilityCheck::kWheelAgreement));
  EXPECT_TRUE(off.has(PlausibilityCheck::kOpposedMotion));
  for (const auto check : {PlausibilityCheck::kStillEncoder, PlausibilityCheck::kVelocityAgreement,
                           PlausibilityCheck::kVelocityStep, PlausibilityCheck::kTorqueAgreement})
    EXPECT_FALSE(off.has(check)) << control::kPlausibilityCheckNames[static_cast<std::size_t>(check)];
}

TEST(PlausibilityConfig, AnUnknownCheckIsRefusedWithTheNamesOfAll) {
  try {
    loaded("[plausibility]\noff = [\"wheels\"]\n");
    FAIL() << "accepted";
  } catch (const runtime::ConfigError& error) {
    ASSERT_EQ(error.problems().size(), 1U);
    EXPECT_NE(error.problems().front().find(
                  "lab.toml:2: 'plausibility.off' has no check 'wheels' to switch off, but still_encoder, "
                  "velocity_agreement, velocity_step, torque_agreement, wheel_agreement, opposed_motion, "
                  "hall_agreement, away_from_target"),
              std::string::npos)
        << error.what();
  }
}

TEST(PlausibilityConfig, NoSettingSwitchesACheckOffThatTheFileHasOn) {
  const support::TemporaryDirectory folder;
  const auto file = folder.write("lab.toml", "[plausibility]\noff = [\"velocity_step\"]\n");
  EXPECT_THROW(operation::load_config(file, {{"plausibility.off", "[\"velocity_step\", \"still_encoder\"]"}}),
               runtime::ConfigError);
  EXPECT_TRUE(operation::load_config(file, {{"plausibility.off", "[]"}}).cycle.checks_off.none());
}

TEST(PlausibilityConfig, ACheckThatDoesNotRunIsNotedWithItsNameAndTheReason) {
  control::ChecksOff silent;
  EXPECT_TRUE(runtime::notes_on_silent(silent).empty());
  silent.add(PlausibilityCheck::kOpposedMotion);
  const std::vector<std::string> notes = runtime::notes_on_silent(silent);
  ASSERT_EQ(notes.size(), 1U);
  EXPECT_TRUE(notes.front().find("in time for the check 'opposed_motion'") != std::string::npos)
      << notes.front();
}

TEST(PlausibilityConfig, EachRunWarnsOfACheckThatIsOff) {
  const support::TemporaryDirectory folder;
  std::ifstream demo(support::source_dir() + "/apps/youbotd/demo.toml");
  std::stringstream text;
  text << demo.rdbuf();
  std::string off = text.str();
  const std::string none = "off = []";
  ASSERT_NE(off.find(none), std::string::npos);
  off.replace(off.find(none), none.size(), "off = [\"wheel_agreement\"]");
  const auto run = [&](const std::string& file) {
    return support::run_command(support::program("youbotd") + " --virtual-time --duration 0.1 --config " +
                                file);
  };
  const auto warned = run(folder.write("off.toml", off).string());
  EXPECT_EQ(warned.exit_code, 0) << warned.output;
  EXPECT_TRUE(warned.said("the check 'wheel_agreement' is off")) << warned.output;
  EXPECT_FALSE(run(folder.write("on.toml", text.str()).string()).said("is off"));
}

}  // namespace plausibility_config_test
