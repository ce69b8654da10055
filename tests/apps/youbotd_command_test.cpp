// The command youbotd: arguments, exit codes, signals.
#include <gtest/gtest.h>
#include <unistd.h>

#include <csignal>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "tests/support/built_paths.h"
#include "tests/support/process.h"
#include "tests/support/temporary_directory.h"

namespace youbotd_command_test {

namespace fs = std::filesystem;
const std::string kDemo = support::source_dir() + "/apps/youbotd/demo.toml";

using Result = support::CommandResult;
using support::Process;

std::vector<std::string> youbotd(std::vector<std::string> arguments) {
  arguments.insert(arguments.begin(), support::program("youbotd"));
  return arguments;
}
Result run(std::vector<std::string> arguments) { return Process(youbotd(std::move(arguments))).finish(); }

TEST(YoubotdCommand, HelpNamesTheExitCodesAndSucceeds) {
  const Result result = run({"--help"});
  EXPECT_EQ(result.exit_code, 0);
  for (const char* word :
       {"--config", "--robot", "--record", "--record-csv", "--virtual-time", "--allow-non-rt", "Exit codes"})
    EXPECT_NE(result.output.find(word), std::string::npos) << word;
}

TEST(YoubotdCommand, NeedsAConfiguration) {
  const Result result = run({});
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_NE(result.output.find("--config"), std::string::npos) << result.output;
}

TEST(YoubotdCommand, MakesAKeyOnceAndReplacesNone) {
  const support::TemporaryDirectory directory;
  const std::string key = directory / "link.key";
  EXPECT_EQ(run({"--make-key", key}).exit_code, 0);
  EXPECT_EQ(fs::file_size(key), 32U);
  const Result again = run({"--make-key", key});
  EXPECT_EQ(again.exit_code, 3);
  EXPECT_NE(again.output.find(key), std::string::npos) << again.output;
}

TEST(YoubotdCommand, AnOperatorsStationHasNoRobotToShowOrRecord) {
  const support::TemporaryDirectory directory;
  const fs::path config = directory.write(
      "operator.toml", "role = \"operator\"\n[link]\npeer = \"127.0.0.1:7777\"\nkey_file = \"none\"\n");
  EXPECT_EQ(run({"--config", config, "--demo"}).exit_code, 2);
  const Result keyless = run({"--config", config});
  EXPECT_EQ(keyless.exit_code, 3);
  EXPECT_NE(keyless.output.find("--make-key"), std::string::npos) << keyless.output;
}

TEST(YoubotdCommand, TheRobotsStationTakesNoHapticDeviceOfItsOwn) {
  const support::TemporaryDirectory directory;
  const fs::path config = directory.write(
      "robot.toml", "role = \"robot\"\n[link]\nlisten = \"127.0.0.1:0\"\nkey_file = \"none\"\n");
  const Result result = run({"--config", config, "--haptic", "loopback"});
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_NE(result.output.find("--haptic"), std::string::npos) << result.output;
}

TEST(YoubotdCommand, ReportsItsProgressUnlessQuiet) {
  const support::TemporaryDirectory directory;
  // This machine may be busy.
  const fs::path config = directory.write(
      "patient.toml",
      "[loop]\ncommand_timeout_s = 2\ncommander_timeout_s = 2\n[[path.leg]]\nforward_m = 1\n");
  const std::vector<std::string> arguments{"--config", config, "--duration", "3", "--allow-non-rt"};
  const Result loud = run(arguments);
  EXPECT_EQ(loud.exit_code, 0) << loud.output;
  EXPECT_NE(loud.output.find(" %, running, "), std::string::npos) << loud.output;
  std::vector<std::string> quietly = arguments;
  quietly.emplace_back("--quiet");
  EXPECT_EQ(run(quietly).output.find(" %, running, "), std::string::npos);
}

TEST(YoubotdCommand, ASimulatedRobotNeedsNoRightsToRealTime) {
  const support::TemporaryDirectory directory;
  const fs::path config = directory.write(
      "patient.toml",
      "[loop]\ncommand_timeout_s = 2\ncommander_timeout_s = 2\n[[path.leg]]\nforward_m = 1\n");
  std::vector<std::string> words = youbotd({"--config", config, "--duration", "0.5"});
  // Without the rights that root and machines for real time have.
  words.insert(words.begin(), {"/usr/bin/prlimit", "--rtprio=0"});
  if (geteuid() == 0) words.insert(words.begin(), {"/usr/bin/setpriv", "--bounding-set=-sys_nice"});
  const Result result = Process(words).finish();
  EXPECT_EQ(result.exit_code, 0) << result.output;
  EXPECT_TRUE(result.said("not real-time: real-time scheduling (SCHED_FIFO) refused")) << result.output;
}

TEST(YoubotdCommand, AConfigurationWithoutAPathIsNoSilentSuccess) {
  const support::TemporaryDirectory directory;
  const Result result =
      run({"--config", directory.write("plain.toml", "robot = \"loopback\"\n"), "--virtual-time", "--quiet"});
  EXPECT_EQ(result.exit_code, 0) << result.output;
  EXPECT_NE(result.output.find("plain.toml: no [[path.leg]]"), std::string::npos) << result.output;
}

TEST(YoubotdCommand, ARunLogsTheArmThatIsSimulated) {
  const support::TemporaryDirectory directory;
  const fs::path config = directory.write(
      "lab.toml",
      "[ethercat]\nkind = \"base+arm\"\n[[path.leg]]\nforward_m = 0.01\n[simulation]\nrobot_file = \"" +
          support::source_dir() + "/control/youbot_arm.toml\"\n");
  const Result result = run({"--config", config, "--virtual-time"});
  EXPECT_EQ(result.exit_code, 0) << result.output;
  EXPECT_NE(
      result.output.find("simulated arm: Coulomb friction of joints 1 to 5: 0.900, 0.900, 0.500, 0.350, "
                         "0.250 N·m"),
      std::string::npos)
      << result.output;
}

TEST(YoubotdCommand, DemoComparesBothRunsAndSaysWhatItShows) {
  const Result result = run({"--config", kDemo, "--demo", "--virtual-time"});
  EXPECT_EQ(result.exit_code, 0) << result.output;
  EXPECT_NE(result.output.find("the base never starts without compensation and follows its path with it"),
            std::string::npos)
      << result.output;
}

TEST(YoubotdCommand, AnEmptyConfigurationIsAMistake) {
  const support::TemporaryDirectory directory;
  for (const char* text : {"", "\n", "# robot = \"loopback\"\n"}) {
    const Result result = run({"--config", directory.write("empty.toml", text), "--virtual-time"});
    EXPECT_EQ(result.exit_code, 2) << result.output;
    EXPECT_NE(result.output.find("empty.toml:1: holds no key"), std::string::npos) << result.output;
  }
}

TEST(YoubotdCommand, AMisspelledOptionIsNamedBeforeTheOneThatIsMissing) {
  for (const auto& [arguments, message] : std::vector<std::pair<std::vector<std::string>, std::string>>{
           {{"--confg", "demo.toml"}, "There is no option '--confg'; did you mean '--config'?\n"},
           {{"--confg=demo.toml"}, "There is no option '--confg'; did you mean '--config'?\n"},
           {{"-v"}, "There is no option '-v'\n"},
           {{"help"}, "The argument 'help' is not expected\n"},
           {{"--config", "demo.toml", "--recrod", "x"},
            "There is no option '--recrod'; did you mean '--record'?\n"},
           {{"--config", ""}, "--config is empty\n"}}) {
    const Result result = run(arguments);
    EXPECT_EQ(result.exit_code, 2) << result.output;
    EXPECT_TRUE(result.said(message)) << result.output;
  }
  const Result command = Process({support::program("youbot-bench"), "scan", "--robt", "wire"}).finish();
  EXPECT_TRUE(command.said("There is no option '--robt'; did you mean '--robot'?")) << command.output;
  const Result after =
      Process({support::program("youbotctl"), "status", "--quiet", "--socket", "/none"}).finish();
  EXPECT_EQ(after.exit_code, 3) << "options of the program may follow its command: " << after.output;
  EXPECT_EQ(Process({support::program("youbotctl"), "status", "stop"}).finish().exit_code, 2)
      << "one command";
  const Result misspelled = Process({support::program("youbotctl"), "staus"}).finish();
  EXPECT_EQ(misspelled.exit_code, 2);
  EXPECT_TRUE(misspelled.said("There is no command 'staus'; did you mean 'status'?\nCommands: status, "))
      << misspelled.output;
  for (const char* program : {"youbot-gap", "youbotd"}) {  // with commands and without
    const Result stray = Process({support::program(program), kDemo}).finish();
    EXPECT_EQ(stray.exit_code, 2);
    EXPECT_TRUE(stray.said("; to give it to an option, write the option before it\n")) << stray.output;
  }
}

TEST(YoubotdCommand, WrongUseAndWrongConfigurationExitWithTwo) {
  EXPECT_EQ(run({}).exit_code, 2);
  EXPECT_EQ(run({"--config", kDemo, "--nonsense"}).exit_code, 2);
  EXPECT_EQ(run({"--config", kDemo, "--duration", "-1"}).exit_code, 2);
  const Result unknown = run({"--config", kDemo, "--robot", "toaster"});
  EXPECT_EQ(unknown.exit_code, 2);
  EXPECT_TRUE(unknown.said("there is no 'toaster'")) << unknown.output;
  EXPECT_FALSE(unknown.said("running")) << unknown.output;
  const Result missing = run({"--config", "/nonexistent/file.toml"});
  EXPECT_EQ(missing.exit_code, 2);
  EXPECT_NE(missing.output.find("/nonexistent/file.toml"), std::string::npos);
}

TEST(YoubotdCommand, AnArmWithoutABaseIsNotDrivenAsOne) {
  const support::TemporaryDirectory directory;
  const fs::path config = directory.write(
      "arm.toml", "robot = \"wire\"\n[ethercat]\nkind = \"arm\"\n[[path.leg]]\nforward_m = 0.1\n");
  for (const char* option : {"--check", "--virtual-time"}) {
    const Result refused = run({"--config", config, option});
    EXPECT_EQ(refused.exit_code, 2) << refused.output;
    EXPECT_TRUE(refused.said("arm.toml:3: 'ethercat.kind' is 'arm'")) << refused.output;
  }
}

TEST(YoubotdCommand, TheCheckRefusesOptionsThatContradictEachOther) {
  EXPECT_EQ(run({"--config", kDemo, "--check", "--control", "/tmp/no-socket", "--demo"}).exit_code, 2);
  EXPECT_EQ(run({"--config", kDemo, "--check", "--page", "--virtual-time"}).exit_code, 2);
}

/// Ports 7400 + 250 · domain (DDSI-RTPS 9.6.1.1) end at 65535.
TEST(YoubotdCommand, ADomainOfRos2HasAPort) {
  for (const char* wrong : {"233", "-1", "1.5", "x"}) {
    const Result refused = run({"--config", kDemo, "--ros2", wrong});
    EXPECT_EQ(refused.exit_code, 2) << wrong;
    EXPECT_TRUE(refused.said("--ros2")) << refused.output;
  }
}

TEST(YoubotdCommand, CommandsOfRos2NeedAServiceThatIsOpenToThem) {
  for (const std::vector<std::string>& options : {std::vector<std::string>{"--ros2-commands"},
                                                  {"--ros2", "0", "--ros2-commands"},
                                                  {"--ros2-commands", "--control", "/tmp/no-socket"}}) {
    std::vector<std::string> words{"--config", kDemo};
    words.insert(words.end(), options.begin(), options.end());
    EXPECT_EQ(run(words).exit_code, 2);
  }
  EXPECT_EQ(run({"--config", kDemo, "--ros2", "0", "--virtual-time"}).exit_code, 2);
}

TEST(YoubotdCommand, AFaultExitsWithFourAndSaysWhyEvenWhenQuiet) {
  const support::TemporaryDirectory directory;
  const fs::path config = directory.write(
      "slow.toml",  // far too fast
      "[controller]\nstiffness_N_per_m = 0\ndamping_N_s_per_m = 0\nfeedforward_mass_kg = 200\n"
      "[limits]\nforce_N = 50\nwheel_speed_rad_per_s = 2.3\n[path]\nturn_speed_rad_per_s = "
      "0.01\n[[path.leg]]\nforward_m = 1\n");
  const Result result = run({"--config", config, "--virtual-time", "--quiet", "--record", directory / "run"});
  EXPECT_EQ(result.exit_code, 4) << result.output;
  EXPECT_NE(result.output.find("more than allowed"), std::string::npos) << result.output;
  EXPECT_NE(result.output.find("youbotd-fault-"), std::string::npos) << result.output;
}

TEST(YoubotdCommand, TerminateAndInterruptComeToACleanStop) {
  for (const int number : {SIGTERM, SIGINT}) {
    Process process(youbotd({"--config", kDemo, "--allow-non-rt", "--duration", "120"}));
    ASSERT_TRUE(process.wait_for("running")) << "never started";
    process.signal(number);
    const Result result = process.finish();
    EXPECT_EQ(result.exit_code, 130) << "the path is unfinished: " << result.output;
    EXPECT_NE(result.output.find("wake-up"), std::string::npos) << "no summary: " << result.output;
  }
}

}  // namespace youbotd_command_test
