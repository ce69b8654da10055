#include "drivers/haptic/force_dimension.h"

#include <algorithm>
#include <cmath>

namespace drivers::haptic {
namespace {

using namespace std::chrono_literals;
using std::chrono::nanoseconds;

constexpr int kRampOutSteps = 10;
constexpr nanoseconds kRampOutStep = 2ms;  // the watchdog of 20 ms stays fed

bool has_finite_pose(const DeviceSample& sample) noexcept {
  return is_finite(sample.p_HD_m) &&
         std::ranges::all_of(sample.R_HD, [](const Vector3& row) { return is_finite(row); });
}

constexpr bool means_gone(int code) noexcept {
  return code == kSdkErrorCommunication || code == kSdkErrorNoDevice || code == kSdkErrorNotAvailable;
}

}  // namespace

std::string describe_force_dimension(HapticFault fault, std::int32_t detail) {
  const auto with_error = [detail](const char* text) {
    return std::string(text) + ": " + describe_sdk_error(detail) + " (SDK error " + std::to_string(detail) +
           ")";
  };
  switch (fault) {
    case HapticFault::kForceOff: return std::string(describe(fault)) + ": " + describe_force_off(detail);
    case HapticFault::kUnplugged:
      return with_error("disconnected or not responding; check USB cable and power, then open it again");
    case HapticFault::kDeviceFault: return with_error("the SDK refused a call");
    default: return describe(fault);
  }
}

// From the delegated constructor on the destructor closes the device, also when this one throws.
ForceDimension::ForceDimension(const ForceDimensionLibrary& library, const ForceDimensionConfig& config)
    : ForceDimension(library, config, open_force_dimension(library, config)) {
  info_ = prepare_force_dimension(library, static_cast<char>(id_), config_);
}

ForceDimension::ForceDimension(const ForceDimensionLibrary& library, const ForceDimensionConfig& config,
                               char id)
    : f_(library.functions()), config_(config), id_(id) {}

ForceDimension::~ForceDimension() { stop(); }

DeviceStatus ForceDimension::exchange(const ForceDimensionCommand& command, nanoseconds now,
                                      DeviceSample& sample) noexcept {
  if (id_ < 0) return {.fault = HapticFault::kNotActive};
  // A clock that was set back would prolong the settling, which excuses a status without force.
  if (force_on_since_ && now < *force_on_since_) force_on_since_ = now - config_.settle;
  if (given_up_.fault == HapticFault::kUnplugged) return give_up_force(given_up_);
  if (!command.enable) given_up_ = {};

  DeviceSample measured;
  DeviceStatus status = read(now, measured);
  if (status.ok() && !is_finite(command.f_D_H_N)) status.fault = HapticFault::kBadCommand;
  if (status.ok() && !given_up_.ok()) status = given_up_;
  if (status.ok() && command.enable && !force_on_since_ && !switch_force_on(now)) status = sdk_fault();
  if (needs_reopening(status.fault)) return give_up_force(status);

  status.withheld = command.enable && settling(now);
  if (force_on_since_) {
    Vector3 force_N{};
    if (status.ok() && command.enable && !status.withheld) force_N = command.f_D_H_N;
    // hal::HapticServo keeps the same limit; this one holds for any caller.
    const bool limited = shorten(force_N, config_.max_force_N);
    const int result = send(force_N);
    if (sdk_failed(result)) return give_up_force(sdk_fault());
    status.saturated = limited || result == kSdkMotorSaturated;
  }
  if (status.fresh) sample = measured;
  status.f_D_H_N = sent_N_;
  return status;
}

DeviceStatus ForceDimension::read(nanoseconds now, DeviceSample& measured) noexcept {
  const DeviceStatus state = check_state(now);
  if (!state.ok()) return state;
  const int result = read_pose(measured);
  if (sdk_failed(result)) return sdk_fault();
  if (!has_finite_pose(measured)) return {.fault = HapticFault::kBadSample};
  measured.buttons = read_buttons();
  return {.fresh = result != kSdkTimeGuard};
}

/// The result of the call that failed, else that of the position.
int ForceDimension::read_pose(DeviceSample& measured) noexcept {
  const char id = static_cast<char>(id_);
  Vector3& p = measured.p_HD_m;
  double rotation[3][3] = {};
  int result = 0;
  if (f_.get_position_and_orientation_frame != nullptr) {
    result = f_.get_position_and_orientation_frame(&p[0], &p[1], &p[2], rotation, id);
  } else {
    result = f_.get_position(&p[0], &p[1], &p[2], id);
    if (sdk_failed(result)) return result;
    // Right after the position the time guard may answer: with the same sample.
    const int second = f_.get_orientation_frame(rotation, id);
    if (sdk_failed(second)) return second;
  }
  for (std::size_t row = 0; row < 3; ++row) std::copy_n(rotation[row], 3, measured.R_HD[row].begin());
  return result;
}

std::uint32_t ForceDimension::read_buttons() noexcept {
  const char id = static_cast<char>(id_);
  if (f_.get_button_mask != nullptr) return f_.get_button_mask(id);
  return f_.get_button != nullptr && f_.get_button(0, id) == 1 ? 1U : 0U;
}

DeviceStatus ForceDimension::check_state(nanoseconds now) const noexcept {
  std::array<int, kStatusCapacity> slots{};
  if (sdk_failed(f_.get_status(slots.data(), static_cast<char>(id_)))) return sdk_fault();
  if (slots[status_slot::kConnected] == 0 || slots[status_slot::kPower] == 0)
    return {.fault = HapticFault::kUnplugged, .detail = kSdkErrorCommunication};
  // It was without power, if only between two exchanges: watchdog and calibration are gone.
  if (slots[status_slot::kReset] != 0) return {.fault = HapticFault::kUnplugged, .detail = kSdkErrorNotReady};
  if (slots[status_slot::kError] != 0) return {.fault = HapticFault::kUnplugged, .detail = kSdkErrorGeneric};
  // Right after enabling, a status that is a transfer old still shows the brakes. The cause is the latest
  // one, so it has a meaning only while the force should be on.
  if (force_on_since_ && slots[status_slot::kForce] == 0 && !settling(now)) {
    const int cause = slots[status_slot::kForceOffCause];
    if (cause == kForceOffUnplugged)
      return {.fault = HapticFault::kUnplugged, .detail = kSdkErrorCommunication};
    return {.fault = HapticFault::kForceOff, .detail = cause};
  }
  return {};
}

bool ForceDimension::settling(nanoseconds now) const noexcept {
  return force_on_since_ && now - *force_on_since_ < config_.settle;
}

/// A status that says the force is off may be wrong, a zero may be refused, and firmware before 3.0, without
/// a watchdog, would go on with the last force. So both calls are made, in each cycle until the SDK confirms
/// the stop.
DeviceStatus ForceDimension::give_up_force(DeviceStatus status) noexcept {
  given_up_ = status;
  if (force_on_since_) {
    const char id = static_cast<char>(id_);
    const bool zero = !sdk_failed(f_.set_force(0.0, 0.0, 0.0, id));
    const bool stopped = !sdk_failed(f_.stop(id));
    if (zero || stopped) sent_N_ = {};
    if (stopped) force_on_since_.reset();
  }
  return {.fault = status.fault, .detail = status.detail, .f_D_H_N = sent_N_};
}

bool ForceDimension::switch_force_on(nanoseconds now) noexcept {
  const char id = static_cast<char>(id_);
  f_.set_force(0.0, 0.0, 0.0,
               id);       // no old force may come on; whether it is taken with the brakes on is open
  force_on_since_ = now;  // also when the call fails: the answer alone may have been lost
  return !sdk_failed(f_.enable_force(1, id));
}

int ForceDimension::send(const Vector3& f_N) noexcept {
  const int result = f_.set_force(f_N[0], f_N[1], f_N[2], static_cast<char>(id_));
  if (!sdk_failed(result)) sent_N_ = f_N;
  return result;
}

DeviceStatus ForceDimension::sdk_fault() const noexcept {
  const int code = f_.error_get_last != nullptr ? f_.error_get_last() : kSdkErrorGeneric;
  return {.fault = means_gone(code) ? HapticFault::kUnplugged : HapticFault::kDeviceFault, .detail = code};
}

bool ForceDimension::stop() noexcept {
  if (id_ < 0) return true;
  const char id = static_cast<char>(id_);
  const Vector3 start_N = sent_N_;
  bool ramps = given_up_.ok() && start_N != Vector3{};
  for (int left = kRampOutSteps - 1; ramps && left > 0; --left) {
    ramps = !sdk_failed(send(times(start_N, static_cast<double>(left) / kRampOutSteps)));
    if (ramps) wait_without_throwing(config_.wait, kRampOutStep);
  }

  bool stopped = false;
  for (int attempt = 0; attempt < kStopAttempts && !stopped; ++attempt) {
    if (attempt > 0) wait_without_throwing(config_.wait, kStopRetry);
    f_.set_force(0.0, 0.0, 0.0, id);
    stopped = !sdk_failed(f_.stop(id));
  }
  close_force_dimension(f_, id);
  id_ = -1;
  force_on_since_.reset();
  sent_N_ = {};
  return stopped;
}

}  // namespace drivers::haptic
