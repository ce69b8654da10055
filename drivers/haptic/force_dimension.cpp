#include "drivers/haptic/force_dimension.h"

#include <algorithm>
#include <cmath>

namespace drivers::haptic {
namespace {

using namespace std::chrono_literals;
using std::chrono::nanoseconds;
using Fault = ForceDimensionFault;
using Vector = std::array<double, 3>;

constexpr int kRampOutSteps = 10;
constexpr nanoseconds kRampOutStep = 2ms;  // the watchdog of 20 ms stays fed

bool finite(const Vector& vector) noexcept {
  return std::all_of(vector.begin(), vector.end(), [](double value) { return std::isfinite(value); });
}

bool finite(const ForceDimensionSample& sample) noexcept {
  return finite(sample.p_HD_m) &&
         std::all_of(sample.R_HD.begin(), sample.R_HD.end(), [](const Vector& row) { return finite(row); });
}

/// True when it was larger. A magnitude beyond what a double holds leaves nothing of the force.
bool limit(Vector& force_N, double limit_N) noexcept {
  const double magnitude_N = std::hypot(force_N[0], force_N[1], force_N[2]);
  if (magnitude_N <= limit_N) return false;
  for (double& component_N : force_N) component_N *= limit_N / magnitude_N;
  return true;
}

std::int32_t microseconds(nanoseconds time) noexcept {
  const auto us = std::chrono::duration_cast<std::chrono::microseconds>(time).count();
  return static_cast<std::int32_t>(std::clamp<std::int64_t>(us, INT32_MIN, INT32_MAX));
}

constexpr bool means_gone(int code) noexcept {
  return code == kSdkErrorCommunication || code == kSdkErrorNoDevice || code == kSdkErrorNotAvailable;
}

}  // namespace

std::string describe(const ForceDimensionStatus& status) {
  const auto with_error = [&status](const char* text) {
    return std::string(text) + ": " + describe_sdk_error(status.detail) + " (SDK error " +
           std::to_string(status.detail) + ")";
  };
  switch (status.fault) {
    case Fault::kNone: break;
    case Fault::kNotOpen: return "the device is not open";
    case Fault::kBadCommand: return "a commanded force was not finite";
    case Fault::kBadSample: return "a measured value was not finite";
    case Fault::kLate:
      return "the exchange came late: " + std::to_string(status.detail) + " us after the one before";
    case Fault::kStale:
      return "the SDK gives no new pose: the latest is " + std::to_string(status.detail) + " us old";
    case Fault::kForceOff:
      return std::string("the device switched its force off: ") + describe_force_off(status.detail);
    case Fault::kUnplugged:
      return with_error("the device is gone or unwell; check USB cable and power, then open it again");
    case Fault::kSdkError: return with_error("the SDK refused a call");
  }
  if (status.repeated) return "ok, with the old pose (time guard)";
  return status.saturated ? "ok, force limited" : "ok";
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

ForceDimensionStatus ForceDimension::exchange(const ForceDimensionCommand& command, nanoseconds now,
                                              ForceDimensionSample& sample) noexcept {
  if (id_ < 0) return {Fault::kNotOpen};
  const nanoseconds gap = previous_ ? now - *previous_ : 0ns;
  previous_ = now;
  // Or a clock that was set back would excuse a status without force for as long as that.
  if (gap < 0ns && force_on_since_) force_on_since_ = now - config_.settle;
  if (latched_.fault == Fault::kUnplugged) {
    give_up_force();
    latched_.f_D_H_N = sent_N_;
    return latched_;
  }
  if (!command.enable) {
    latched_ = {};
    enabled_since_.reset();
  }

  ForceDimensionSample measured;
  measured.stamp = now;
  ForceDimensionStatus status = read(now, measured);
  if (status.ok() && !status.repeated) sample = measured;
  const bool repeated = status.repeated;

  if (status.ok() && !finite(command.f_D_H_N)) status = {Fault::kBadCommand};
  // Only while a force may be on: nobody is harmed by a pause with the force off. Time that runs backwards
  // would stretch the ramp, and says as little as a gap.
  const bool late = gap < 0ns || gap > config_.watchdog / 2;
  if (status.ok() && late && enabled_since_) status = {.fault = Fault::kLate, .detail = microseconds(gap)};
  if (status.ok() && !repeated) fresh_ = now;
  if (status.ok() && enabled_since_ && now - fresh_ > config_.watchdog)
    status = {.fault = Fault::kStale, .detail = microseconds(now - fresh_)};
  if (status.ok() && latched_.ok() && command.enable && !enabled_since_) {
    if (!force_on_since_) status = switch_force_on(now);
    if (status.ok()) enabled_since_ = fresh_ = now;
  }
  latch(status);

  Vector force_N{};
  bool scaled = false;
  if (latched_.ok() && enabled_since_) {
    force_N = command.f_D_H_N;
    scaled = limit(force_N, config_.max_force_N);
    for (double& component_N : force_N) component_N *= gain(now);
  }
  if (status.fault == Fault::kUnplugged || status.fault == Fault::kForceOff) {
    give_up_force();
  } else if (force_on_since_) {
    status = send(force_N);
    latch(status);
    scaled = scaled || status.saturated;
    if (!status.ok()) give_up_force();
  }
  status = latched_;
  status.saturated = scaled;
  status.repeated = repeated;
  status.f_D_H_N = sent_N_;
  return status;
}

ForceDimensionStatus ForceDimension::read(nanoseconds now, ForceDimensionSample& measured) noexcept {
  const ForceDimensionStatus state = check_state(now);
  if (!state.ok()) return state;
  const int result = read_pose(measured);
  if (sdk_failed(result)) return sdk_fault();
  if (!finite(measured)) return {Fault::kBadSample};
  measured.buttons = read_buttons();
  return {.repeated = result == kSdkTimeGuard};
}

/// The first failure, else what the position said.
int ForceDimension::read_pose(ForceDimensionSample& measured) noexcept {
  const char id = static_cast<char>(id_);
  Vector& p = measured.p_HD_m;
  double rotation[3][3] = {};
  int result = 0;
  if (f_.get_position_and_orientation_frame != nullptr) {
    result = f_.get_position_and_orientation_frame(&p[0], &p[1], &p[2], rotation, id);
  } else {
    result = f_.get_position(&p[0], &p[1], &p[2], id);
    if (sdk_failed(result)) return result;
    // Asked at once after the position, so the time guard may well answer: with the same sample.
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

ForceDimensionStatus ForceDimension::check_state(nanoseconds now) const noexcept {
  std::array<int, kStatusCapacity> slots{};
  if (sdk_failed(f_.get_status(slots.data(), static_cast<char>(id_)))) return sdk_fault();
  if (slots[status_slot::kConnected] == 0 || slots[status_slot::kPower] == 0)
    return {.fault = Fault::kUnplugged, .detail = kSdkErrorCommunication};
  // It was without power, if only between two exchanges: watchdog and calibration are gone.
  if (slots[status_slot::kReset] != 0) return {.fault = Fault::kUnplugged, .detail = kSdkErrorNotReady};
  if (slots[status_slot::kError] != 0) return {.fault = Fault::kUnplugged, .detail = kSdkErrorGeneric};
  // A status that is a transfer old still shows the brakes right after enabling; zero force is all that is
  // sent then. The cause is the latest one, so it means something only now.
  if (force_on_since_ && slots[status_slot::kForce] == 0 && now - *force_on_since_ >= config_.settle) {
    const int cause = slots[status_slot::kForceOffCause];
    if (cause == kForceOffUnplugged) return {.fault = Fault::kUnplugged, .detail = kSdkErrorCommunication};
    return {.fault = Fault::kForceOff, .detail = cause};
  }
  return {};
}

/// A status that says the force is off may be wrong, a zero may be refused, and firmware before 3.0, without
/// a watchdog, would go on with the last force. So both are tried, in each cycle until the stop is confirmed.
void ForceDimension::give_up_force() noexcept {
  if (!force_on_since_) return;
  const char id = static_cast<char>(id_);
  const bool zero = !sdk_failed(f_.set_force(0.0, 0.0, 0.0, id));
  const bool stopped = !sdk_failed(f_.stop(id));
  if (zero || stopped) sent_N_ = {};
  if (stopped) force_on_since_.reset();
}

ForceDimensionStatus ForceDimension::switch_force_on(nanoseconds now) noexcept {
  const char id = static_cast<char>(id_);
  f_.set_force(0.0, 0.0, 0.0, id);  // nothing old may come on; whether it is taken with the brakes on is open
  force_on_since_ = now;
  if (!sdk_failed(f_.enable_force(1, id))) return {};
  const ForceDimensionStatus status = sdk_fault();
  give_up_force();  // the answer alone may have been lost
  return status;
}

ForceDimensionStatus ForceDimension::send(const Vector& f_N) noexcept {
  const int result = f_.set_force(f_N[0], f_N[1], f_N[2], static_cast<char>(id_));
  if (sdk_failed(result)) return sdk_fault();
  sent_N_ = f_N;
  return {.saturated = result == kSdkMotorSaturated};
}

ForceDimensionStatus ForceDimension::sdk_fault() const noexcept {
  const int code = f_.error_get_last != nullptr ? f_.error_get_last() : kSdkErrorGeneric;
  return {.fault = means_gone(code) ? Fault::kUnplugged : Fault::kSdkError, .detail = code};
}

/// The first one is kept, but for the one that a disable does not clear.
void ForceDimension::latch(const ForceDimensionStatus& status) noexcept {
  if (!status.ok() && (latched_.ok() || status.fault == Fault::kUnplugged)) latched_ = status;
}

double ForceDimension::gain(nanoseconds now) const noexcept {
  using Seconds = std::chrono::duration<double>;
  const double part = Seconds(now - *enabled_since_ - config_.settle) / Seconds(config_.ramp_in);
  return std::clamp(part, 0.0, 1.0);
}

bool ForceDimension::stop() noexcept {
  if (id_ < 0) return true;
  const char id = static_cast<char>(id_);
  const Vector start_N = sent_N_;
  bool ramps = latched_.ok() &&
               std::any_of(start_N.begin(), start_N.end(), [](double force_N) { return force_N != 0.0; });
  for (int left = kRampOutSteps - 1; ramps && left > 0; --left) {
    Vector force_N = start_N;
    for (double& component_N : force_N) component_N *= static_cast<double>(left) / kRampOutSteps;
    ramps = send(force_N).ok();
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
