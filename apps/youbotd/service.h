/// @file
/// The daemon as a service: robot and haptic device stay open with the drives off, and a client decides when
/// they work.
#pragma once
#include <chrono>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <sstream>
#include <string>
#include <string_view>
#include <vector>

#include "apps/youbotd/control_server.h"
#include "apps/youbotd/fault_log.h"
#include "apps/youbotd/served_loop.h"
#include "hal/clock.h"
#include "operation/config.h"
#include "operation/live_feed.h"
#include "operation/run.h"
#include "operation/velocity_source.h"
#include "runtime/open_haptic.h"
#include "runtime/open_robot.h"
#include "runtime/program/service_manager.h"

namespace youbotd {

/// Period in which orders are repeated and reports read: well below any loop.commander_timeout_s.
inline constexpr std::chrono::milliseconds kBeat{50};

struct ServiceOptions {
  std::filesystem::path config_file;
  /// Each run records into a new directory run-1, run-2, … in it.
  std::optional<std::filesystem::path> record_directory{};
  runtime::RecordingFormat record_format{};
  /// The configuration with these settings applied, as made by `youbotctl set`.
  std::function<operation::Config(const std::map<std::string, std::string>& settings)> configuration;
  operation::LiveFeed* live = nullptr;  ///< of page and topics; null: none
  bool ros2_commands = false;           ///< offer the mode ros2
};

/// What `mode` chooses from; the first one is the default.
std::vector<std::string> modes_of(bool teleoperated, bool ros2_commands);

/// Answers requests and gives a ServedLoop its orders. It uses no socket, thread or machine clock: serve()
/// provides those, and tests run it in virtual time.
///
/// - One client commands at a time: the one that enables commands until the drives are off, and the robot
///   comes to rest when its connection ends or is silent for loop.commander_timeout_s. Every client may stop.
/// - W and its workspace limits stay where the base was at the start, however often it is enabled; with a
///   haptic device they are reset at each enable, like the hand's frame.
/// - Orders that waited while this thread was delayed start nothing: the client may no longer expect motion.
/// - In the mode ros2, velocities come as `steer` from the network, and the client that enables only permits
///   them. The base comes to rest, and stays enabled, when none comes for loop.commander_timeout_s.
/// - A fault ends the run, not the service. It is latched: `enable` is refused until `acknowledge`.
/// Requests, all answered with the status: status, alive, acknowledge, enable, stop, disable, mode NAME, set
/// KEY VALUE, unset KEY, set velocity X Y YAW.
/// One thread, other than the loop's.
class Service final : public ControlServer::Listener {
 public:
  /// `robot` and `master` (empty without teleoperation) are active whenever the loop is stepped. All must
  /// outlive the service, and so must the clock, on which it waits.
  Service(const ServiceOptions& options, const operation::Config& config, runtime::OpenedRobot& robot,
          runtime::OpenedHaptic& master, hal::Clock& clock);

  /// Rejects invalid configurations before `enable` does, once the haptic device is active.
  /// @throws std::invalid_argument for an invalid configuration.
  void require_usable_configuration();
  /// For the other thread.
  ServedLoop& loop() noexcept { return loop_; }
  /// What the system refused the loop: part of each status.
  void set_not_real_time(std::vector<std::string> problems) { not_real_time_ = std::move(problems); }
  const runtime::ServiceManager& manager() const noexcept { return manager_; }

  /// Every kBeat: repeats the orders, reads their results and reports to log and service manager.
  void beat();

  /// Before the program ends: the robot comes to rest, and nothing is enabled.
  void end();

  /// A run is under way.
  bool enabled() const noexcept { return run_ != nullptr; }

  /// For the page: the status of every answer.
  nlohmann::json status() const;
  std::string answer(const Peer& peer, const std::string& request) override;
  void gone(const Peer& peer) override;
  bool commands(const Peer& peer) const override {
    return commander_ && commander_->connection == peer.connection;
  }

 private:
  /// Detects that this thread was delayed.
  void attend();
  /// @throws Refusal soon after a delay, because the order may have waited through it.
  void require_fresh(std::string_view order) const;

  // Requests.
  void obey(const Peer& peer, const std::string& request);
  void acknowledge(const Peer& peer);
  void enable(const Peer& peer);
  void disable(const Peer& peer);
  void choose_mode(const std::string& mode);
  /// @throws Refusal if it does not act during the run under way.
  void require_settable(const std::string& key) const;
  template <typename Change>
  void or_log_refusal(const Peer& peer, const Change& change);
  void set(const Peer& peer, const std::string& key, const std::string& value);
  void unset(const Peer& peer, const std::string& key);
  void set_velocity(std::istringstream& words);
  void steer(std::istringstream& words);
  /// In the mode ros2.
  void watch_steering();

  // Status, service_status.cpp.
  bool faulted() const noexcept { return !fault_.empty() && !fault_acknowledged_; }
  std::string robot_state() const;

  void require_same_devices(const operation::Config& config) const;
  /// `velocity`, unless null, receives the velocity source, in the mode that uses one.
  std::unique_ptr<operation::Run> make_run(const operation::Config& config,
                                           const operation::RunOptions& options,
                                           operation::VelocitySource** velocity);
  operation::RunOptions next_run() const;
  void open_master_again();
  void give_orders();
  /// Gives the orders, then waits until a cycle has followed them and its report has been read.
  void give_orders_and_hear();
  /// Logs faults and recoveries of the robot.
  void watch_robot();
  /// Logs once which checks of the sensors do not run.
  void watch_checks();
  /// Logs once what the recording lost.
  void watch_recording();
  void end_run();
  void log_fault();
  /// Notifies the service manager as long as the cycles continue.
  void report_alive();
  void bring_to_rest(const std::string& why);

  ServiceOptions options_;
  operation::Config config_;
  runtime::OpenedRobot& robot_;
  runtime::OpenedHaptic& master_;
  hal::Clock& clock_;
  runtime::ServiceManager manager_;
  ServedLoop loop_;

  std::string mode_;
  std::map<std::string, std::string> settings_;
  std::vector<std::string> not_real_time_;
  std::optional<std::chrono::nanoseconds> attended_;  // its last beat or answer
  std::chrono::nanoseconds held_up_{};                // duration of the last delay
  std::chrono::nanoseconds fresh_from_{};             // requests received earlier may have waited that long
  Orders orders_;
  LoopReport loop_report_;
  drivers::station::LinkReport link_report_;         // of the operator's station, if it is apart
  std::unique_ptr<operation::Run> run_;              // the one under way
  operation::VelocitySource* velocity_ = nullptr;    // of that run, in the modes velocity and ros2
  std::optional<std::chrono::nanoseconds> steered_;  // the last time, in mode ros2; empty: at rest
  std::optional<Peer> commander_;                    // while it is
  std::chrono::nanoseconds commander_heard_{};
  bool ending_ = false;  // after end()
  std::string stopped_;  // who or what brought the last run to rest before its end; empty: nothing
  std::string fault_;    // that ended the last run
  bool fault_acknowledged_ = false;  // by an order of its own
  std::filesystem::path fault_report_;
  std::optional<operation::Config> file_at_enable_{};  // ceilings of the run under way
  control::PlanarPose X_WB_{};         // pose of the base after the runs, without a haptic device
  std::filesystem::path recorded_to_;  // by the current or last run; empty: nothing
  std::optional<operation::RecordingState> recording_;  // of it
  std::vector<std::string> fault_robot_report_;  // the robot's report at the fault, since its activation
  std::vector<std::string> device_faults_;       // hal::Robot::device_faults()
  FaultLog fault_log_;
  std::vector<std::string> notes_;         // of the run under way
  std::vector<std::string> notes_logged_;  // likewise; each is logged once, even if its cause comes and goes
  std::uint64_t cycles_reported_ = 0;
  std::chrono::nanoseconds reported_{};
};

}  // namespace youbotd
