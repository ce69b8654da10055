#include "runtime/station/remote_haptic_link.h"

#include <algorithm>
#include <utility>

#include "hal/seconds.h"
#include "runtime/station/station_values.h"

namespace runtime {
namespace {

using drivers::station::HandleMessage;
using drivers::station::HandleState;
using hal::HapticFault;
using hal::HapticStatus;
using std::chrono::nanoseconds;

/// At most, and below the speed at which hal::HapticServo faults by this share: late positions that arrive
/// together are no fast handle.
constexpr double kFollowing_m_per_s = 0.5;
constexpr double kFollowingShare = 0.8;
/// With this much jitter, later messages overtake earlier ones and arrive in bursts.
constexpr std::chrono::milliseconds kJitter{50};
/// After a pause the way of a longer time is not made up for at once.
constexpr std::chrono::milliseconds kCatchUp{20};
/// In the detail of a fault: the operator's device has it, not the link to it. Beyond any age in
/// microseconds.
constexpr std::uint32_t kOfTheirDevice = std::uint32_t{1} << 31;

}  // namespace

RemoteHapticLink::RemoteHapticLink(OpenPort open_port, const drivers::station::Key& key,
                                   const LinkOptions& options, const Limits& limits,
                                   std::shared_ptr<LinkMonitor> monitor)
    : open_port_(std::move(open_port)),
      key_(key),
      options_(options),
      info_{.name = "operator's station at " + options.listen,
            .force_limit_N = limits.force_N,
            .senses_rotation = true,
            .fresh_within = kJitter},
      following_m_per_s_(std::min(kFollowing_m_per_s, kFollowingShare * limits.speed_m_per_s)),
      monitor_(std::move(monitor)),
      passivity_(options.port) {}

void RemoteHapticLink::open() {
  close();
  port_ = open_port_();
  endpoint_.emplace(*port_, key_, options_.endpoint);
  sessions_ = 0;
  taken_.reset();
  commanded_N_.setZero();
}

/// The operator's station ends the force when nothing arrives; what it does by then is not known here.
bool RemoteHapticLink::close() noexcept {
  endpoint_.reset();
  port_.reset();
  return true;
}

HapticStatus RemoteHapticLink::exchange(const hal::HapticCommand& command, nanoseconds now,
                                        hal::HapticSample& sample) noexcept {
  if (!endpoint_) return {HapticFault::kNotActive};
  HapticStatus status = read(now, sample);
  // While no force is wanted, a lost station is waited for, as one that has never come.
  if (!command.enable && !endpoint_->connected(now)) {
    taken_.reset();
    status = {HapticFault::kNotReady};
  }
  commanded_N_ = command.enable ? command.f_D_H_N : Eigen::Vector3d::Zero();
  status.f_D_H_N = commanded_N_;
  endpoint_->send({.energy_in_nJ = energy_to_link(passivity_.ledger().in_J()), .enable = command.enable},
                  to_link(commanded_N_), now);
  if (monitor_) monitor_->publish(endpoint_->report(now));
  return status;
}

HapticStatus RemoteHapticLink::read(nanoseconds now, hal::HapticSample& sample) noexcept {
  const bool newer = endpoint_->poll(now);
  const std::uint64_t session = endpoint_->report(now).sessions;
  if (session != sessions_) {  // another hand at another place
    sessions_ = session;
    passivity_.reset();
    taken_.reset();
    return {HapticFault::kNotReady};
  }
  // A silence after the first sample ends the force as for any other device: HapticServo sees the age.
  if (!newer) return {taken_ ? HapticFault::kMissed : HapticFault::kNotReady};
  const drivers::station::LinkState& operating = endpoint_->message().link;
  if (operating.fault != HapticFault::kNone)
    return {.fault = operating.fault, .detail = operating.detail | kOfTheirDevice};
  if (!operating.enable) return {taken_ ? HapticFault::kNoCommand : HapticFault::kNotReady};
  take_states(sample, now);
  return {};
}

void RemoteHapticLink::take_states(hal::HapticSample& sample, nanoseconds now) noexcept {
  const HandleMessage& message = endpoint_->message();
  const HandleState& newest = message.states[0];
  from_link(newest, sample);
  // A short press counts, in a lost message or in one of several that arrived together.
  sample.buttons |= endpoint_->take_pressed();
  const nanoseconds since = taken_ ? std::min<nanoseconds>(now - *taken_, kCatchUp) : nanoseconds(0);
  sample.p_HD_m = passivity_.step(sample.p_HD_m, commanded_N_, energy_from_link(message.link.energy_in_nJ),
                                  following_m_per_s_ * hal::seconds(since));
  sample.stamp = now;
  taken_ = now;
  sample.released = message.link.released;
  sample.felt_f_D_H_N = force_from_link(newest.force_uN);
}

std::string RemoteHapticLink::describe(const HapticStatus& status) const {
  if ((status.detail & kOfTheirDevice) == 0) {
    switch (status.fault) {
      case HapticFault::kNotReady: return "no operator's station with a ready haptic device is connected";
      case HapticFault::kStale: return "the operator's station was silent for too long";
      case HapticFault::kNoCommand: return "the operator's station does not receive this one";
      default: break;
    }
  }
  return std::string("operator's haptic device: ") + hal::describe(status.fault);
}

}  // namespace runtime
