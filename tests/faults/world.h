/// @file
/// The complete system in one thread and in emulated time: daemon, bus, boards, robot, handle, hand and
/// clients.
///
/// The daemon's parts are those of the program (apps/youbotd/service.h), without the sockets, threads and
/// clocks of apps/youbotd/serve.cpp.
#pragma once
#include <sys/resource.h>

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include "apps/youbotd/service.h"
#include "runtime/robot_session.h"
#include "sim/bus/youbot_bus.h"
#include "sim/hand.h"
#include "tests/faults/faulty_link.h"
#include "tests/faults/faulty_pen.h"
#include "tests/support/lying_board.h"
#include "tests/support/temporary_directory.h"

namespace faults {

using nlohmann::json;
using std::chrono::nanoseconds;

enum class Machine : std::uint8_t {
  kBase,         ///< driven by velocities from its client
  kManipulator,  ///< base and arm, moved by a hand on a handle
};

/// Result of a client's request.
struct Reply {
  bool ok = false;
  std::string error;
  json status;
};

/// Called in each millisecond period, after boards and mechanics.
class Witness {
 public:
  Witness() = default;
  Witness(const Witness&) = delete;
  Witness& operator=(const Witness&) = delete;
  virtual ~Witness() = default;
  virtual void period_passed() = 0;
  virtual void cycle_begins() = 0;
  virtual void enable_granted() = 0;
  /// The daemon did something forbidden.
  virtual void object(const std::string& what) = 0;
  /// The daemon reports that no run is under way, or there is none any more.
  virtual void nothing_runs() = 0;
};

class World;

/// For tests of the checker: modifications around a daemon that give it a defect.
struct Sabotage {
  std::function<std::unique_ptr<hal::Robot>(std::unique_ptr<hal::Robot>)> robot{};  ///< before the bus
  std::function<std::unique_ptr<hal::HapticLink>(std::unique_ptr<hal::HapticLink>)> pen{};
  std::function<void(World&)> period{};  ///< before boards and mechanics are checked
  /// Replaces a client's request for the daemon. The last one is answered.
  std::function<std::vector<std::string>(const std::string&)> request{};
  bool ignores_its_end = false;                                    ///< ignores an order to end
  std::function<void(const std::filesystem::path&)> recordings{};  ///< their directory, before it is checked
};

class World final : public hal::Clock {
 public:
  static constexpr std::chrono::milliseconds kPeriod{1};

  /// The same seed makes the same robot, noise and load.
  World(Machine machine, std::uint64_t seed, Sabotage sabotage = {});
  ~World() override;

  /// The daemon's clock: sleeping on it advances the simulation.
  nanoseconds now() const noexcept override { return emulation_->wire().now(); }
  void sleep_until(nanoseconds deadline) noexcept override {
    while (next_cycle_ <= deadline) step();
  }

  /// Must outlive the world, or be reset to null.
  void be_watched_by(Witness* witness) noexcept { witness_ = witness; }

  /// A period: boards, mechanics, the daemon's cycle and, every kBeat, its beat.
  void step();
  /// Starts it if it is not running. start_error() has the reason of a failure.
  void start_daemon();
  /// Like SIGKILL for bus and clients: nothing is sent any more. Recordings are closed as they are.
  void kill_daemon();
  /// Like SIGTERM: comes to rest, then ends, which takes some periods.
  void end_daemon() noexcept;
  /// Where it recorded to.
  std::filesystem::path recordings() const;
  bool daemon_runs() const noexcept { return service_ != nullptr; }
  /// The daemon reports that a run is under way.
  bool enabled() const noexcept { return service_ != nullptr && service_->enabled(); }
  const std::string& start_error() const noexcept { return start_error_; }

  /// A request of client `connection`; empty if nothing listens. Connection 1 is the commanding client's.
  std::optional<Reply> ask(std::uint64_t connection, const std::string& request, bool may_command = true);
  void hang_up(std::uint64_t connection);
  /// A request that waits in the socket while the service's thread is delayed. It is read as soon as the
  /// thread continues.
  void leave(std::uint64_t connection, const std::string& request);

  void object(const std::string& what) {
    if (witness_ != nullptr) witness_->object(what);
  }

  // For scripts.
  Machine machine() const noexcept { return machine_; }
  sim::bus::YoubotBus& emulation() noexcept { return *emulation_; }
  support::LyingBoard& board(std::size_t joint) noexcept { return *boards_[joint]; }
  std::size_t joints() const noexcept { return boards_.size(); }
  sim::Hand* hand() noexcept { return master_.hand.get(); }
  std::mt19937_64& random() noexcept { return random_; }
  const std::filesystem::path& folder() const noexcept { return folder_.path(); }
  const operation::Config& config() const noexcept { return config_; }

  /// Like a full disk: no file of this process grows beyond. The harness' own writes come before it.
  void limit_files(std::uint64_t bytes);
  void restore_files();

  WireFaults wire;
  PenFaults pen;
  nanoseconds loop_paused_until{};   ///< no cycle before
  nanoseconds beats_paused_until{};  ///< no beat and no answer before: the service's thread is delayed
  bool commander_silent = false;
  bool daemon_held_down = false;        ///< it is not restarted
  std::function<void()> each_period{};  ///< for continuous effects on the mechanics

 private:
  /// Of the world whose devices were opened last; a capture's clock has no other context.
  static nanoseconds captured_now() noexcept { return captured_->now(); }
  static const World* captured_;

  struct Left {
    nanoseconds at{};
    std::uint64_t connection = 0;
    std::string request{};
  };
  void hear_what_was_left();
  void open_devices();
  void forget_daemon() noexcept;
  youbotd::Peer peer(std::uint64_t connection, bool may_command) const;

  const Machine machine_;
  const rlimit file_limit_;  // as it was
  support::TemporaryDirectory folder_;
  std::mt19937_64 random_;
  Sabotage sabotage_;
  Witness* witness_ = nullptr;
  std::filesystem::path config_file_;
  operation::Config config_;
  std::shared_ptr<sim::bus::YoubotBus> emulation_;
  std::vector<std::unique_ptr<support::LyingBoard>> boards_;

  runtime::OpenedHaptic master_;  // its hand stays when the daemon ends
  runtime::OpenedRobot robot_;
  std::unique_ptr<youbotd::Service> service_;
  std::optional<runtime::HapticActivation> master_activation_;
  std::optional<runtime::RobotActivation> robot_activation_;
  std::string start_error_;
  std::vector<Left> left_;
  nanoseconds next_cycle_{};
  int until_beat_ = 0;
  bool answering_ = false;
};

}  // namespace faults
