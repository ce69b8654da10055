// youbot-bench on a real network interface, with the emulated robot at the other end.
#include <arpa/inet.h>
#include <fcntl.h>
#include <gtest/gtest.h>
#include <linux/if_ether.h>
#include <linux/if_packet.h>
#include <net/if.h>
#include <sched.h>
#include <signal.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <optional>
#include <span>
#include <string>
#include <thread>
#include <vector>

#include "drivers/ethercat/frame.h"
#include "drivers/tmcl/process_data.h"
#include "runtime/recording/recording_reader.h"
#include "tests/support/built_paths.h"
#include "tests/support/run_command.h"
#include "tests/support/skip.h"
#include "tests/support/temporary_directory.h"
#include "tests/support/veth.h"

namespace youbot_bench_over_veth_test {

using namespace std::chrono_literals;
namespace fs = std::filesystem;
using support::CommandResult;

/// In the namespace that the test lives in.
CommandResult bench(const std::string& arguments) {
  return support::run_command(support::program("youbot-bench") + " " + arguments +
                              " --robot ethercat:veth-c");
}

TEST(YoubotBenchOverVeth, DiagnoseFindsADamagedCableAndASlaveThatLeft) {
  const support::Namespaces namespaces;
  SKIP_UNLESS(namespaces.usable(), "needs root and network namespaces");
  const support::TemporaryDirectory directory;
  const fs::path capture = directory / "capture.pcapng";
  // Bring-up takes some hundred frames; a cycle each afterwards, of which a busy machine leaves some out. The
  // robot's time goes with the frames.
  const fs::path faults =
      directory.write("faults.toml",
                      "[[fault]]\nkind = \"damage_on_cable\"\nat_frame = 1000\ncount = 3\nslave = 2\n"
                      "[[fault]]\nkind = \"slave_off\"\nat_frame = 2000\nduration_s = 1.0\nslave = 4\n");
  const support::Simulator simulator(namespaces, "--robot base --lock-step --faults " + faults.string());
  ASSERT_TRUE(simulator.ready());
  const CommandResult diagnosis = bench("diagnose --duration 8 --quiet --capture " + capture.string());
  EXPECT_EQ(diagnosis.exit_code, 4) << diagnosis.output;
  EXPECT_TRUE(diagnosis.said("slave 2 (TMCM-1632) port 0: 3 new CRC errors: check the cable from slave 1"))
      << diagnosis.output;
  EXPECT_TRUE(diagnosis.said("slave 4 (TMCM-1632): left operation")) << diagnosis.output;
  EXPECT_TRUE(diagnosis.said("wake-up median"));
  EXPECT_GT(fs::file_size(capture), 10'000U);
}

TEST(YoubotBenchOverVeth, WithoutARobotItSaysWhatToCheck) {
  const support::Namespaces namespaces;
  SKIP_UNLESS(namespaces.usable(), "needs root and network namespaces");
  for (const char* command : {"scan", "parameters", "diagnose --quiet"}) {
    const CommandResult result = bench(command);
    EXPECT_EQ(result.exit_code, 3) << result.output;
    EXPECT_TRUE(result.said("veth-c")) << result.output;
  }
}

TEST(YoubotBenchOverVeth, ASettingIsStillThereForTheNextProgram) {
  const support::Namespaces namespaces;
  SKIP_UNLESS(namespaces.usable(), "needs root and network namespaces");
  const support::Simulator simulator(namespaces, "--robot base");
  ASSERT_TRUE(simulator.ready());
  for (const int before : {2000, 1500}) {
    const CommandResult set = bench("parameters --joint wheel-2 --set motor_acceleration=1500");
    EXPECT_EQ(set.exit_code, 0) << set.output;
    EXPECT_TRUE(set.said("slave 3 (TMCM-1632), wheel-2: motor_acceleration was " + std::to_string(before) +
                         ", is 1500 rpm/s until it loses its power"))
        << set.output;
  }
}

/// Listens on the robot's end of the cable: the last commands to the drives, whether or not they were
/// received. Not on the other end, where the kernel does not show frames that a master sends past its queues.
class Listener {
 public:
  explicit Listener(const support::Namespaces& namespaces) {
    const int home = open("/proc/thread-self/ns/net", O_RDONLY | O_CLOEXEC);
    const int there = open(("/run/netns/" + namespaces.sim_namespace()).c_str(), O_RDONLY | O_CLOEXEC);
    (void)setns(there, CLONE_NEWNET);
    socket_ = socket(AF_PACKET, SOCK_RAW | SOCK_CLOEXEC, htons(ETH_P_ALL));
    sockaddr_ll address{};
    address.sll_family = AF_PACKET;
    address.sll_protocol = htons(ETH_P_ALL);
    address.sll_ifindex = static_cast<int>(if_nametoindex("veth-s"));
    (void)setns(home, CLONE_NEWNET);
    close(home);
    close(there);
    const timeval patience{0, 100'000};
    const int room = 64 << 20;  // for frames that arrive while a busy machine does not run the thread
    const int on = 1;
    ready_ = setsockopt(socket_, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof patience) == 0 &&
             setsockopt(socket_, SOL_SOCKET, SO_RCVBUFFORCE, &room, sizeof room) == 0 &&
             setsockopt(socket_, SOL_PACKET, PACKET_IGNORE_OUTGOING, &on, sizeof on) == 0 &&
             bind(socket_, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0;
    thread_ = std::thread([this] { listen(); });
  }
  Listener(const Listener&) = delete;
  Listener& operator=(const Listener&) = delete;
  ~Listener() {
    (void)stop();
    close(socket_);
  }
  /// Returns when everything that was sent has been received.
  Listener& stop() {
    stop_ = true;
    if (thread_.joinable()) thread_.join();
    return *this;
  }

  bool ready() const { return ready_; }
  bool torque_was_commanded() const { return torque_seen_; }
  bool last_word_was_motor_stop() const {
    return !last_.empty() && std::ranges::all_of(last_, [](const drivers::tmcl::DriveOutput& output) {
      return output.mode == drivers::tmcl::ControllerMode::kMotorStop;
    });
  }

 private:
  /// The image holds outputs and inputs of each wheel in turn; youbot-sim's boards map 40 bytes each way.
  static constexpr std::size_t kWheels = 4;
  static constexpr std::size_t kImageBytes = 80;

  void listen() {
    std::array<std::uint8_t, drivers::ethercat::kMaxFrameBytes> buffer{};
    for (;;) {
      const bool last = stop_;
      const ssize_t size = recv(socket_, buffer.data(), buffer.size(), 0);
      if (size > 0) take(std::span(buffer).first(static_cast<std::size_t>(size)));
      if (size <= 0 && last) return;
    }
  }
  void take(std::span<std::uint8_t> frame) {
    drivers::ethercat::FrameReader reader;
    drivers::ethercat::Datagram datagram;
    if (reader.parse(frame) != drivers::ethercat::FrameError::kNone) return;
    while (reader.next(datagram)) {
      if (datagram.command != drivers::ethercat::Command::kLrw) continue;
      last_.resize(kWheels);
      for (std::size_t at = 0; at < datagram.data.size(); at += kImageBytes) {
        const std::size_t wheel = (datagram.address + at) / kImageBytes;
        if (wheel >= kWheels || !unpack(datagram.data.subspan(at), last_[wheel])) continue;
        torque_seen_ = torque_seen_ || (last_[wheel].mode == drivers::tmcl::ControllerMode::kCurrent &&
                                        last_[wheel].value != 0);
      }
    }
  }

  int socket_ = -1;
  bool ready_ = false;
  std::atomic<bool> stop_{false};
  std::vector<drivers::tmcl::DriveOutput> last_;
  bool torque_seen_ = false;
  std::thread thread_;  // last: uses the others
};

/// A slow torque ramp on wheel 3 under way in another process, in the namespace that the test lives in.
class RunningRamp {
 public:
  explicit RunningRamp(const support::TemporaryDirectory& directory, const std::string& arguments = "")
      : out_(directory / "run"), log_(directory / "log") {
    fs::remove_all(out_);
    // As long as the drives' own watchdog: a shared machine may not run us for a while.
    const fs::path config = directory.write("lab.toml", "[ethercat]\ntolerated_cycles = 90\n");
    const std::string command = "exec " + support::program("youbot-bench") +
                                " torque-ramp --robot ethercat:veth-c --yes --allow-non-rt --joint wheel-3 "
                                "--rest 0.2 --config " +
                                config.string() + " --out " + out_.string() + " " + arguments + " >" +
                                log_.string() + " 2>&1";
    pid_ = fork();
    if (pid_ == 0) {
      execl("/bin/sh", "sh", "-c", command.c_str(), nullptr);
      _exit(127);
    }
  }
  RunningRamp(const RunningRamp&) = delete;
  RunningRamp& operator=(const RunningRamp&) = delete;
  ~RunningRamp() {
    if (!ended_) kill(pid_, SIGKILL);
    (void)wait();
  }

  /// False when it has ended before.
  bool has_recorded(std::size_t rows) {
    for (std::ifstream file; waitpid(pid_, &status_, WNOHANG) == 0; std::this_thread::sleep_for(20ms)) {
      file.open(out_ / "torque-ramp/wheel-3.csv");
      const auto lines = std::count(std::istreambuf_iterator<char>(file), {}, '\n');
      if (lines > static_cast<std::ptrdiff_t>(rows)) return true;
      file.close();
    }
    ended_ = true;
    return false;
  }
  void interrupt() const { kill(pid_, SIGINT); }
  CommandResult wait() {
    if (!ended_) waitpid(pid_, &status_, 0);
    ended_ = true;
    std::ifstream log(log_);
    CommandResult result;
    if (WIFEXITED(status_)) result.exit_code = WEXITSTATUS(status_);
    result.output.assign(std::istreambuf_iterator<char>(log), {});
    return result;
  }
  const fs::path& out() const { return out_; }

 private:
  fs::path out_;
  fs::path log_;
  pid_t pid_ = -1;
  int status_ = 0;
  bool ended_ = false;
};

class BenchExperimentOverVeth : public testing::Test {
 protected:
  void SetUp() override { SKIP_UNLESS(namespaces.usable(), "needs root and network namespaces"); }
  /// A shared machine may starve either process for longer than any watchdog allows. Then the experiment ends
  /// with a fault, rightly, and is tried again.
  static constexpr int kAttempts = 20;
  static bool held_up_in_set_up(const CommandResult& result) {
    return result.exit_code == 3 && (result.said("no frame comes back") || result.said("no reply in time") ||
                                     result.said("OP not reached"));
  }

  support::Namespaces namespaces;
  support::TemporaryDirectory directory;
};

TEST_F(BenchExperimentOverVeth, ATorqueRampLeavesReadableRecordingsAndStoppedMotors) {
  const support::Simulator simulator(namespaces, "--robot base");
  ASSERT_TRUE(simulator.ready());
  CommandResult result;
  for (int attempt = 0; attempt < kAttempts && result.exit_code != 0; ++attempt) {
    Listener listener(namespaces);
    ASSERT_TRUE(listener.ready());
    RunningRamp ramp(directory, "--repeats 1 --rate 0.2 --highest-torque 0.2");
    result = ramp.wait();
    if (held_up_in_set_up(result)) continue;
    ASSERT_TRUE(result.exit_code == 0 || result.exit_code == 4) << result.output;
    EXPECT_TRUE(listener.stop().last_word_was_motor_stop());
    EXPECT_TRUE(listener.torque_was_commanded() || result.exit_code != 0) << "it listens to something else";
  }
  ASSERT_EQ(result.exit_code, 0) << result.output;

  const identification::Recording rows =
      runtime::read_recording(directory / "run/torque-ramp/wheel-3.csv").recording;
  EXPECT_EQ(rows.rig, "wheel-3");
  EXPECT_GT(rows.rows(), 400U);
  EXPECT_GT(std::ranges::max(rows.column("torque_command_Nm")), 0.05);
  EXPECT_LT(std::ranges::min(rows.column("torque_command_Nm")), -0.05);
  const runtime::ReadRecording results =
      runtime::read_recording(directory / "run/torque-ramp-result/wheel-3.csv", runtime::NotMeasured::kTaken);
  ASSERT_EQ(results.recording.rows(), 2U);
  EXPECT_EQ(results.recording.column("direction")[1], -1.0);
}

TEST_F(BenchExperimentOverVeth, InterruptedItStopsTheMotorsAndGoesOnLater) {
  const support::Simulator simulator(namespaces, "--robot base");
  ASSERT_TRUE(simulator.ready());
  bool interrupted = false;
  for (int attempt = 0; attempt < kAttempts && !interrupted; ++attempt) {
    Listener listener(namespaces);
    RunningRamp ramp(directory, "--repeats 1 --rate 0.02");
    if (ramp.has_recorded(500)) ramp.interrupt();
    const CommandResult result = ramp.wait();
    if (held_up_in_set_up(result)) continue;
    ASSERT_TRUE(result.exit_code == 130 || result.exit_code == 4) << result.output;
    EXPECT_TRUE(listener.stop().last_word_was_motor_stop());
    interrupted = result.exit_code == 130;
    EXPECT_TRUE(!interrupted || result.said("not finished; go on with")) << result.output;
  }
  ASSERT_TRUE(interrupted);
  EXPECT_GE(runtime::read_recording(directory / "run/torque-ramp/wheel-3.csv").recording.rows(), 500U);
}

TEST_F(BenchExperimentOverVeth, WhenTheCableIsPulledItEndsWithFourAndKeepsWhatItHas) {
  bool pulled = false;
  for (int attempt = 0; attempt < kAttempts && !pulled; ++attempt) {
    std::optional<support::Simulator> simulator(std::in_place, namespaces, "--robot base");
    ASSERT_TRUE(simulator->ready());
    Listener listener(namespaces);
    RunningRamp ramp(directory, "--repeats 1 --rate 0.02");
    if (ramp.has_recorded(500)) simulator.reset();
    const CommandResult result = ramp.wait();
    if (held_up_in_set_up(result)) continue;
    ASSERT_EQ(result.exit_code, 4) << result.output;
    EXPECT_TRUE(listener.stop().last_word_was_motor_stop());
    EXPECT_TRUE(result.said("--resume")) << result.output;
    // Or this machine held it up just before.
    pulled = result.said("no answer from the simulated bus");
  }
  ASSERT_TRUE(pulled);
  EXPECT_GE(runtime::read_recording(directory / "run/torque-ramp/wheel-3.csv").recording.rows(), 500U);
}

TEST_F(BenchExperimentOverVeth, ARobotThatIsNotThereOrAnotherLeavesNothingBehind) {
  CommandResult result = RunningRamp(directory).wait();
  EXPECT_EQ(result.exit_code, 3) << result.output;
  EXPECT_TRUE(result.said("veth-c")) << result.output;
  EXPECT_FALSE(fs::exists(directory / "run"));
  const support::Simulator simulator(namespaces, "--robot base");
  ASSERT_TRUE(simulator.ready());
  result = RunningRamp(directory, "--kind base+arm").wait();
  EXPECT_EQ(result.exit_code, 3) << result.output;
  EXPECT_FALSE(fs::exists(directory / "run"));
}

}  // namespace youbot_bench_over_veth_test
