/// @file
/// The operator's station: connects a haptic device with the link.
#pragma once
#include <chrono>
#include <cstdint>

#include "control/delayed_port.h"
#include "control/hand_presence.h"
#include "drivers/station/endpoint.h"
#include "hal/haptic_device.h"
#include "runtime/loop.h"
#include "runtime/station/link_options.h"

namespace runtime {

/// A cycle for run_loop(). Each step sends what the device measured and gives it the force that arrived last,
/// within the energy that arrived. A handle that no hand holds any more is reported until a button is pressed
/// or the force was off. The force is off while the robot's station is silent, or asks for none. After a
/// silence, or a fault of the device, it stays off, and the robot's station learns of it, until that station
/// asks for none or another session begins: the force never comes back by itself. One thread.
class OperatorCycle {
 public:
  /// `device`, active, and `port` outlive the cycle. `monitor` may be null.
  /// @throws std::invalid_argument for options out of range; hal::SetupError for a device that has no handle
  /// with a position of its own.
  OperatorCycle(hal::HapticDevice& device, drivers::station::DatagramPort& port,
                const drivers::station::Key& key, const LinkOptions& options, LinkMonitor* monitor);

  void step(std::chrono::nanoseconds now) noexcept;
  void request_stop() noexcept { stop_ = true; }
  /// Also when the device must be reopened: the robot's station hears that last.
  bool finished() const noexcept { return stop_ || hal::needs_reopening(status_.fault); }
  CycleTimes& record() noexcept { return times_; }

  const hal::HapticStatus& device_status() const noexcept { return status_; }
  const Eigen::Vector3d& force_N() const noexcept { return command_.f_D_H_N; }  ///< for the next exchange
  const control::PortLedger& ledger() const noexcept { return passivity_.ledger(); }
  drivers::station::LinkReport report(std::chrono::nanoseconds now) const noexcept {
    return endpoint_.report(now);
  }

 private:
  void judge_link(const drivers::station::LinkReport& report) noexcept;
  void judge_hand(const Eigen::Vector3d& held_N) noexcept;

  hal::HapticDevice& device_;
  drivers::station::OperatorEndpoint endpoint_;
  control::HandPort passivity_;
  control::HandPresence presence_;
  bool held_ = true;
  LinkMonitor* monitor_;
  std::uint64_t sessions_ = 0;
  bool connected_ = false;       // in this session, in the last cycle
  bool lost_ = false;            // was connected, and fell silent
  bool worked_ = false;          // the device, since a force is wanted
  hal::HapticStatus failure_{};  // of the device, after it had worked
  hal::HapticCommand command_;
  hal::HapticSample sample_;
  hal::HapticStatus status_{};
  Eigen::Vector3d held_N_ = Eigen::Vector3d::Zero();  // since the last exchange
  CycleTimes times_;
  bool stop_ = false;
};

}  // namespace runtime
