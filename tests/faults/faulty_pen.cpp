#include "tests/faults/faulty_pen.h"

#include "hal/setup_error.h"

namespace faults {

void FaultyPen::open() {
  if (faults_.unplugged || faults_.broken)
    throw hal::SetupError("pen", "open", "it is not there: plug it in");
  lost_ = false;
  pen_->open();
}

hal::HapticStatus FaultyPen::exchange(const hal::HapticCommand& command, std::chrono::nanoseconds now,
                                      hal::HapticSample& sample) noexcept {
  // Unplugged, or without power for its motors, it pushes no hand.
  const bool forceless = faults_.unplugged || lost_ || faults_.refuses_force;
  hal::HapticSample measured = last_;
  hal::HapticStatus status = pen_->exchange(forceless ? hal::HapticCommand{} : command, now, measured);
  lost_ = lost_ || faults_.unplugged || faults_.broken;
  if (lost_) {
    status.fault = faults_.unplugged ? hal::HapticFault::kUnplugged : hal::HapticFault::kDeviceFault;
    status.f_D_H_N.setZero();
    return status;
  }
  if (faults_.not_ready) {
    status.fault = hal::HapticFault::kNotReady;
    return status;
  }
  if (faults_.stale) return status;
  if (faults_.frozen) measured.p_HD_m = last_.p_HD_m;
  last_ = measured;
  measured.p_HD_m = faults_.scale * measured.p_HD_m + faults_.jump_m;
  if (faults_.not_finite) measured.p_HD_m.y() = std::numeric_limits<double>::quiet_NaN();
  measured.buttons |= faults_.buttons_stuck;
  if (faults_.buttons_bounce) measured.buttons ^= exchanges_++ / 3 % 4;
  sample = measured;
  return status;
}

}  // namespace faults
