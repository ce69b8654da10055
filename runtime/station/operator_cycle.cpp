#include "runtime/station/operator_cycle.h"

#include "hal/setup_error.h"
#include "runtime/station/station_values.h"

namespace runtime {

using std::chrono::nanoseconds;

OperatorCycle::OperatorCycle(hal::HapticDevice& device, drivers::station::DatagramPort& port,
                             const drivers::station::Key& key, const LinkOptions& options,
                             LinkMonitor* monitor)
    : device_(device),
      endpoint_(port, key, options.endpoint),
      passivity_(options.port),
      presence_(options.presence),
      monitor_(monitor) {
  if (device.info().rate_only)
    throw hal::SetupError(
        device.info().name, "use it at an operator's station",
        "the link carries the position of a handle, and this device has none: connect it to "
        "the robot's computer");
}

void OperatorCycle::step(nanoseconds now) noexcept {
  status_ = device_.exchange(command_, sample_);
  const Eigen::Vector3d held_N = held_N_;
  held_N_ = status_.f_D_H_N;
  if (!command_.enable)
    worked_ = false;
  else if (status_.ok())
    worked_ = true;
  else if (worked_ && failure_.ok())
    failure_ = status_;  // kept: a short fault may go unnoticed at the robot's station, as a short silence

  endpoint_.poll(now);
  const drivers::station::LinkReport report = endpoint_.report(now);
  judge_link(report);
  judge_hand(held_N);
  command_ = {};
  if (connected_ && !lost_ && failure_.ok()) {
    const drivers::station::ForceMessage& message = endpoint_.message();
    command_.enable = message.link.enable;
    const Eigen::Vector3d force_N = force_from_link(message.states[0].force_uN);
    if (status_.ok())
      command_.f_D_H_N = passivity_.step(sample_.p_HD_m, sample_.v_HD_H_m_per_s, held_N, force_N,
                                         energy_from_link(message.link.energy_in_nJ));
  }
  endpoint_.send({.energy_in_nJ = energy_to_link(passivity_.ledger().in_J()),
                  .enable = connected_ && !lost_,
                  .released = !held_,
                  .fault = failure_.ok() ? status_.fault : failure_.fault,
                  .detail = failure_.ok() ? status_.detail : failure_.detail},
                 to_link(sample_, held_N, status_.ok() ? status_.age : nanoseconds(0)), now);
  if (monitor_ != nullptr) monitor_->publish(report);
}

/// A short silence of one direction may go unnoticed at the robot's station: it must hear of it for as long
/// as it asks for a force.
void OperatorCycle::judge_link(const drivers::station::LinkReport& report) noexcept {
  if (report.sessions != sessions_) {
    sessions_ = report.sessions;
    passivity_.reset();
    connected_ = lost_ = false;
    failure_ = {};
  }
  if (connected_ && !report.connected) lost_ = true;
  connected_ = report.connected;
  if (!connected_ || endpoint_.message().link.enable) return;
  lost_ = false;
  failure_ = {};
}

/// Here, where force and motion belong together: at the robot's station both are late.
void OperatorCycle::judge_hand(const Eigen::Vector3d& held_N) noexcept {
  if (!command_.enable || sample_.buttons != 0) {
    presence_.reset();
    held_ = true;
  } else if (status_.ok()) {
    held_ = presence_.step(sample_.v_HD_H_m_per_s, held_N, passivity_.withheld_N()) && held_;
  }
}

}  // namespace runtime
