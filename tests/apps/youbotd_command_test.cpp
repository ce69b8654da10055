// youbotd as a user meets it: arguments, exit codes, signals.
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <csignal>
#include <cstdio>
#include <filesystem>
#include <string>
#include <vector>

#include "tests/support/run_command.h"
#include "tests/support/temporary_directory.h"

namespace {

namespace fs = std::filesystem;
const std::string kDemo = YOUBOT_SOURCE_DIR "/apps/youbotd/demo.toml";

using Result = support::CommandResult;

/// A running youbotd with its output on a pipe.
class Process {
 public:
  explicit Process(std::vector<std::string> arguments) {
    std::array<int, 2> ends{};
    EXPECT_EQ(pipe(ends.data()), 0);
    arguments.insert(arguments.begin(), YOUBOTD_BINARY);
    std::vector<char*> argv;
    for (std::string& argument : arguments) argv.push_back(argument.data());
    argv.push_back(nullptr);
    pid_ = fork();
    if (pid_ == 0) {
      dup2(ends[1], STDOUT_FILENO);
      dup2(ends[1], STDERR_FILENO);
      close(ends[0]);
      execv(argv[0], argv.data());
      _exit(127);
    }
    close(ends[1]);
    output_ = fdopen(ends[0], "r");
  }
  Process(const Process&) = delete;
  Process& operator=(const Process&) = delete;
  ~Process() { fclose(output_); }

  /// Reads until a line holds `text`; false when the output ends before.
  bool wait_for(const std::string& text) {
    std::array<char, 512> line{};
    while (fgets(line.data(), line.size(), output_) != nullptr) {
      result_.output += line.data();
      if (result_.output.find(text) != std::string::npos) return true;
    }
    return false;
  }
  void signal(int number) const { kill(pid_, number); }
  Result finish() {
    std::array<char, 512> line{};
    while (fgets(line.data(), line.size(), output_) != nullptr) result_.output += line.data();
    int status = 0;
    waitpid(pid_, &status, 0);
    if (WIFEXITED(status)) result_.exit_code = WEXITSTATUS(status);
    return result_;
  }

 private:
  pid_t pid_ = 0;
  FILE* output_ = nullptr;
  Result result_;
};

Result run(std::vector<std::string> arguments) { return Process(std::move(arguments)).finish(); }

TEST(YoubotdCommand, HelpNamesTheExitCodesAndSucceeds) {
  const Result result = run({"--help"});
  EXPECT_EQ(result.exit_code, 0);
  for (const char* word :
       {"--config", "--robot", "--record", "--virtual-time", "--allow-non-rt", "Exit codes"})
    EXPECT_NE(result.output.find(word), std::string::npos) << word;
}

TEST(YoubotdCommand, DemoComparesBothRunsAndSaysWhatItShows) {
  const Result result = run({"--config", kDemo, "--demo", "--virtual-time"});
  EXPECT_EQ(result.exit_code, 0) << result.output;
  EXPECT_NE(result.output.find("the base never starts without compensation and follows its path with it"),
            std::string::npos)
      << result.output;
}

TEST(YoubotdCommand, WrongUseAndWrongConfigurationExitWithTwo) {
  EXPECT_EQ(run({}).exit_code, 2);
  EXPECT_EQ(run({"--config", kDemo, "--nonsense"}).exit_code, 2);
  EXPECT_EQ(run({"--config", kDemo, "--duration", "-1"}).exit_code, 2);
  EXPECT_EQ(run({"--config", kDemo, "--robot", "toaster"}).exit_code, 2);
  const Result missing = run({"--config", "/nonexistent/file.toml"});
  EXPECT_EQ(missing.exit_code, 2);
  EXPECT_NE(missing.output.find("/nonexistent/file.toml"), std::string::npos);
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
    Process process({"--config", kDemo, "--allow-non-rt", "--duration", "120"});
    ASSERT_TRUE(process.wait_for("running")) << "never started";
    process.signal(number);
    const Result result = process.finish();
    EXPECT_EQ(result.exit_code, 0) << result.output;
    EXPECT_NE(result.output.find("wake-up"), std::string::npos) << "no summary: " << result.output;
  }
}

}  // namespace
