// Fault scripts of youbot-sim against the real master on raw sockets, from another namespace. Faults begin
// with a frame, not at a time; the robot's time follows the frames, and the tests wait for conditions. A busy
// machine therefore only takes longer.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include "hal/clock.h"
#include "hal/ethercat_robot.h"
#include "tests/support/recorded_robot.h"
#include "tests/support/run_command.h"
#include "tests/support/skip.h"
#include "tests/support/temporary_directory.h"
#include "tests/support/veth.h"

namespace faults_over_veth_test {

using namespace std::chrono_literals;
namespace fs = std::filesystem;

// Three seconds of cycles after the start-up and the commutation, which take some 800 frames.
constexpr long kFaultFrame = 4000;
const std::string kAtFrame = "at_frame = " + std::to_string(kFaultFrame) + "\n";

/// The robot through the interface, cycled at 1 kHz as far as this machine allows.
struct Operator {
  Operator() : robot(hal::make_ethercat_robot("veth-c", options(), clock, 1ms)) {
    for (std::size_t i = 0; i < 4; ++i) command.joints[i] = hal::JointCommand::velocity_rad_per_s(1.0);
  }
  static hal::EthercatOptions options() {
    hal::EthercatOptions options;
    options.kind = hal::YoubotKind::kBase;
    // A busy machine may suspend either process for a while.
    options.tolerated_cycles = 90;
    options.frame_timeout = 3ms;
    return options;
  }
  /// Cycles until `condition`. Faults but `expected`, which is left latched, are answered by disabling and
  /// enabling again: a starved machine may bring any.
  template <typename Condition>
  bool cycle_until(Condition&& condition, hal::Fault expected = hal::Fault::kNone) {
    const auto end = clock.now() + 120s;
    const bool wanted = command.enable;
    bool met = false;
    for (auto next = clock.now(); !met && clock.now() < end; clock.sleep_until(next += 1ms)) {
      enables += command.enable && !enabled ? 1 : 0;
      enabled = command.enable;
      status = robot->exchange(command, sample);
      ++cycles;
      command.enable = wanted && (status.ok() || status.fault == expected);
      met = condition();
    }
    command.enable = wanted;
    return met;
  }
  /// Cycles that are answered: in those that are not, no time passes for the robot.
  void cycle(int count) {
    (void)cycle_until([&] { return status.ok() && --count == 0; });
  }
  bool enable_and_turn(double by_rad) {
    command.enable = true;
    if (!cycle_until([&] { return sample.enabled; })) return false;
    const hal::RobotSample before = sample;
    return cycle_until([&] {
      for (std::size_t i = 0; i < 4; ++i)
        if (sample.joints[i].position_rad < before.joints[i].position_rad + by_rad) return false;
      return true;
    });
  }
  hal::SteadyClock clock;
  std::unique_ptr<hal::Robot> robot;
  hal::RobotCommand command;
  hal::RobotSample sample;
  hal::CycleStatus status;
  long cycles = 0;
  int enables = 0;  // that were ordered

 private:
  bool enabled = false;
};

/// Start, drive, meet the fault, stand still, recover, drive again, stop.
void survive(Operator& person, hal::Fault expected, int joint) {
  person.robot->activate();
  ASSERT_TRUE(person.enable_and_turn(0.3)) << describe(person.status.fault);
  // One frame per cycle, in addition to frames of the start-up and of repairs on a busy machine.
  ASSERT_TRUE(person.cycle_until([&] { return person.cycles > kFaultFrame - 1500; }));
  const auto reported = [&] {
    return person.status.fault == expected && (joint < 0 || person.status.joint == joint);
  };
  ASSERT_TRUE(person.cycle_until(reported, expected)) << "the fault was not noticed";
  EXPECT_FALSE(person.sample.enabled);

  person.command.enable = false;
  ASSERT_TRUE(person.cycle_until([&] { return person.status.ok(); })) << "no recovery";
  person.cycle(300);  // rolling to a halt
  const hal::RobotSample resting = person.sample;
  person.cycle(300);
  for (std::size_t i = 0; i < 4; ++i)
    EXPECT_NEAR(person.sample.joints[i].position_rad, resting.joints[i].position_rad, 0.05)
        << "it moved without being enabled";
  EXPECT_TRUE(person.enable_and_turn(0.3)) << describe(person.status.fault);
  person.robot->deactivate();
}

struct Script {
  const char* name;
  std::string faults;
  hal::Fault expected;
  int joint;  // -1: whichever
};
void PrintTo(const Script& value, std::ostream* out) { *out << value.name; }

class FaultsOverVeth : public ::testing::TestWithParam<Script> {};

TEST_P(FaultsOverVeth, AreSurvived) {
  const support::Namespaces namespaces;
  SKIP_UNLESS(namespaces.usable(), "needs root and network namespaces");
  const support::TemporaryDirectory directory;
  const fs::path faults = directory.write("faults.toml", GetParam().faults);
  const fs::path seen = directory / "seen.csv";
  int enables = 0;
  {
    const support::Simulator simulator(
        namespaces, "--robot base --lock-step --faults " + faults.string() + " --record " + seen.string());
    ASSERT_TRUE(simulator.ready());
    Operator person;
    survive(person, GetParam().expected, GetParam().joint);
    enables = person.enables;
  }  // which ends the record
  EXPECT_EQ(support::violations_of_record(support::Recording(seen), enables), std::vector<std::string>{});
}
INSTANTIATE_TEST_SUITE_P(
    Scripts, FaultsOverVeth,
    ::testing::Values(
        // The watchdog of the two wheels behind it takes them to SAFE-OP meanwhile.
        Script{"cable_out_and_back",
               "[[fault]]\nkind = \"cable_out\"\nslave = 4\nduration_s = 1.0\n" + kAtFrame,
               hal::Fault::kPartialBus, 2},
        Script{"brown_out", "[[fault]]\nkind = \"brown_out\"\nduration_s = 0.5\n" + kAtFrame,
               hal::Fault::kFrameLost, -1},
        Script{"burst_of_lost_frames", "[[fault]]\nkind = \"drop_reply\"\ncount = 200\n" + kAtFrame,
               hal::Fault::kFrameLost, -1},
        // Its watchdog's flag cannot be cleared before the mailbox is back.
        Script{"mailbox_hung_when_the_cable_is_back",
               "[[fault]]\nkind = \"cable_out\"\nslave = 3\nduration_s = 0.5\n" + kAtFrame +
                   "[[fault]]\nkind = \"mailbox_hung\"\nslave = 3\nduration_s = 3.0\n" + kAtFrame,
               hal::Fault::kPartialBus, 1}),
    [](const auto& parameter) { return std::string(parameter.param.name); });

/// What dumpcap, which comes with tshark, sees on the simulator's interface: what the master sends bypasses
/// the captures on its own. Once dumpcap names its file it listens.
class Capture {
 public:
  Capture(const support::Namespaces& namespaces, const fs::path& file) {
    std::array<int, 2> ends{};
    if (pipe2(ends.data(), O_CLOEXEC) != 0) return;
    pid_ = fork();
    if (pid_ == 0) {
      dup2(ends[1], STDERR_FILENO);
      execlp("ip", "ip", "netns", "exec", namespaces.sim_namespace().c_str(), "dumpcap", "-i", "veth-s", "-B",
             "64", "-w", file.c_str(), nullptr);
      _exit(127);
    }
    close(ends[1]);
    output_ = fdopen(ends[0], "r");
    std::array<char, 256> line{};
    while (!running_ && fgets(line.data(), line.size(), output_) != nullptr)
      running_ = std::string(line.data()).find("File:") != std::string::npos;
  }
  Capture(const Capture&) = delete;
  Capture& operator=(const Capture&) = delete;
  ~Capture() { stop(); }
  bool running() const { return running_; }
  void stop() {
    if (pid_ > 0) {
      kill(pid_, SIGINT);
      waitpid(pid_, nullptr, 0);
    }
    if (output_ != nullptr) fclose(output_);
    pid_ = -1;
    output_ = nullptr;
  }

 private:
  pid_t pid_ = -1;
  FILE* output_ = nullptr;
  bool running_ = false;
};

/// One line for each frame that `filter` lets through.
std::vector<std::string> frames_of(const fs::path& file, const std::string& filter,
                                   const std::string& fields) {
  // TMCL in the mailbox has no header; that dissector would read one.
  const std::string command = "tshark -r " + file.string() + " --disable-protocol ecat_mailbox -Y '" +
                              filter + "' -T fields " + fields + " 2>/dev/null";
  const support::CommandResult result = support::run_command(command);
  EXPECT_EQ(result.exit_code, 0);
  std::vector<std::string> lines;
  std::istringstream text(result.output);
  for (std::string line; std::getline(text, line);) lines.push_back(line);
  return lines;
}

TEST(CaptureOverVeth, TsharkDecodesEveryFrameFromTheStartThroughAFaultToTheStop) {
  SKIP_UNLESS(std::system("command -v tshark > /dev/null 2>&1") == 0, "tshark is not installed");
  const support::Namespaces namespaces;
  SKIP_UNLESS(namespaces.usable(), "needs root and network namespaces");
  const support::TemporaryDirectory directory;
  const fs::path faults = directory.write(
      "faults.toml", "[[fault]]\nkind = \"slave_off\"\nslave = 4\nduration_s = 0.5\n" + kAtFrame);
  const support::Simulator simulator(namespaces, "--robot base --lock-step --faults " + faults.string());
  ASSERT_TRUE(simulator.ready());
  const fs::path file = directory / "run.pcapng";
  Capture capture(namespaces, file);
  SKIP_UNLESS(capture.running(), "dumpcap may not capture here");
  Operator person;
  survive(person, hal::Fault::kPartialBus, 2);
  capture.stop();

  const std::string ours = "eth.type == 0x88a4 && ";
  EXPECT_EQ(frames_of(file, ours + "(_ws.malformed || !ecat)", "-e frame.number -e _ws.malformed"),
            std::vector<std::string>{});
  const std::vector<std::string> decoded = frames_of(file, ours + "ecat", "-e ecat.cmd");
  EXPECT_GT(decoded.size(), 2U * kFaultFrame) << "sent and answered";
  std::set<unsigned long> commands;
  for (const std::string& line : decoded) {
    std::istringstream numbers(line);
    for (std::string number; std::getline(numbers, number, ',');)
      commands.insert(std::stoul(number, nullptr, 0));
  }
  // Scan and repair by place, set-up and mailboxes by address, the state of all, process data.
  for (const unsigned long number : {1UL, 2UL, 4UL, 5UL, 7UL, 8UL, 12UL})
    EXPECT_TRUE(commands.contains(number)) << "command " << number;
}

}  // namespace faults_over_veth_test
