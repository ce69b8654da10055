// README.md and those of the programs: their commands work literally, one block after the other, because
// later ones read what earlier ones wrote. Differences from the documents:
// - `./dev ...` is left out: it started this test; so are installations with sudo;
// - /tmp is a directory of the test;
// - youbotd also gets --allow-non-rt, because not every test machine may run in real time;
// - DDS finds the loopback interface only;
// - the robot's cable is between two network namespaces, with youbot-sim at its other end, and IFACE is its
//   near end; the command that makes such a cable runs in a separate namespace;
// - there is no haptic device, so commands with one must fail with a message, and usb-probe may find none;
// - a path without an end is stopped by Ctrl-C after 4 s;
// - youbotd on the bus or in real time may stop with a fault message: a busy machine may not run it, or
//   youbot-sim, for longer than the robot may be silent.
#include <gtest/gtest.h>

#include <filesystem>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "tests/documents/commands.h"
#include "tests/support/built_paths.h"
#include "tests/support/skip.h"
#include "tests/support/veth.h"

namespace readme_test {

namespace fs = std::filesystem;
using documents::Block;
using documents::Step;
using support::CommandResult;

constexpr int kDone = 0;
constexpr int kNoDevice = 3;
constexpr int kStoppedByAFault = 4;

bool contains(std::string_view text, std::string_view part) { return text.find(part) != std::string::npos; }

void replace_all(std::string& text, std::string_view from, std::string_view to) {
  for (std::size_t at = text.find(from); at != std::string::npos; at = text.find(from, at + to.size()))
    text.replace(at, from.size(), to);
}

/// The word that follows `option`; empty without it.
std::string after(const std::string& command, const std::string& option) {
  const std::size_t at = command.find(option);
  if (at == command.npos) return {};
  const std::size_t begin = at + option.size();
  return command.substr(begin, command.find(' ', begin) - begin);
}

bool holds_commands(const Block& block) {
  return block.language.empty() && !block.lines.empty() &&
         (block.lines[0].starts_with("build/bin/") || block.lines[0].starts_with("ip "));
}

std::set<int> allowed(std::string_view command) {
  if (contains(command, "--haptic falcon") || contains(command, "--haptic force-dimension"))
    return {kNoDevice};
  if (contains(command, "usb-probe")) return {kDone, kNoDevice};
  return {kDone};
}

class Readme : public testing::TestWithParam<std::string> {
 protected:
  /// `build/bin/youbot-sim ... &`, or youbotd as a service, in the robot's namespace until the next block.
  void serve(std::string command) {
    command.resize(command.rfind('&'));
    replace_all(command, "build/bin/", (checkout_ / "build/bin/").string());
    replace_all(command, " apps/", " " + (checkout_ / "apps/").string());
    if (contains(command, "--ros2")) {
      const std::string up = "ip -n " + namespaces_.sim_namespace() + " link set lo up";
      ASSERT_EQ(support::run_command(up).exit_code, kDone) << up;
    }
    const bool robot = contains(command, "youbot-sim");
    const std::string here = "env TMPDIR=" + (checkout_ / "tmp").string() + " ";
    simulator_.emplace(namespaces_, here + command + " 2>&1", robot ? "serving" : "waiting for commands");
    ASSERT_TRUE(simulator_->ready()) << command;
  }

  void type(std::string command) {
    replace_all(command, "/tmp/", (checkout_ / "tmp/").string());
    replace_all(command, "ethercat:IFACE", "ethercat:veth-c");
    if (!contains(command, "--allow-non-rt"))
      replace_all(command, "build/bin/youbotd ", "build/bin/youbotd --allow-non-rt ");
    if (command.starts_with("ip ")) command = "unshare --net sh -c '" + command + "'";
    if (command.ends_with("&")) return serve(command);
    if (command.ends_with(" enable") && !contains(command, "|"))
      command = "timeout --preserve-status --signal=INT 4 " + command;
    CommandResult result = checkout_.run(command);
    // A busy machine may stall a loop in real time, which is a fault: once in twenty times it has to run
    // through.
    for (int again = 0; result.exit_code == kStoppedByAFault && again < 19; ++again) {
      std::printf("again, held up: %s\n%s\n", command.c_str(), result.output.c_str());
      if (const std::string folder = after(command, "--record "); !folder.empty()) fs::remove_all(folder);
      if (contains(command, "youbotctl"))
        (void)checkout_.run("build/bin/youbotctl --socket " + after(command, "--socket ") + " acknowledge");
      result = checkout_.run(command);
    }
    EXPECT_TRUE(allowed(command).contains(result.exit_code))
        << command << "\nexit code " << result.exit_code << '\n'
        << result.output;
    EXPECT_EQ(result.said(": error: "), result.exit_code != kDone) << command << '\n' << result.output;
  }

  support::Namespaces namespaces_;
  documents::Checkout checkout_;
  std::optional<support::Server> simulator_;
};

TEST_P(Readme, ItsCommandsWorkAsTheyStand) {
  SKIP_UNLESS(namespaces_.usable(), "needs root and network namespaces");
  fs::create_directory(checkout_ / "tmp");
  int typed = 0;
  const std::vector<Block> blocks = documents::fenced_blocks(fs::path(support::source_dir()) / GetParam());
  for (const Block& block : blocks)  // "with a file as below"
    if (block.language == "toml") checkout_.write("haptic.toml", block.lines);
  for (const Block& block : blocks) {
    if (!holds_commands(block)) continue;
    for (const Step& step : documents::command_steps(block)) {
      type(step.command);
      ++typed;
    }
    simulator_.reset();
  }
  EXPECT_GE(typed, 3) << "the blocks are written in another way than this test reads";
}

INSTANTIATE_TEST_SUITE_P(Of, Readme,
                         testing::Values("apps/youbotd/README.md", "apps/youbot_bench/README.md",
                                         "apps/youbot_gap/README.md", "apps/youbot_sim/README.md",
                                         "drivers/haptic/README.md"),
                         [](const testing::TestParamInfo<std::string>& document) {
                           const fs::path folder = fs::path(document.param).parent_path();
                           return folder.filename().string();
                         });

}  // namespace readme_test
