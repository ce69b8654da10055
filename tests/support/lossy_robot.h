/// @file
/// A robot whose bus loses answers and bridges them with the last sample, see hal::Robot on fresh values.
#pragma once
#include <functional>

#include "hal/robot_wrapper.h"

namespace support {

class LossyRobot final : public hal::RobotWrapper {
 public:
  using RobotWrapper::RobotWrapper;
  hal::CycleStatus exchange(const hal::RobotCommand& command, hal::RobotSample& sample) noexcept override {
    hal::RobotSample unheard;
    const bool lost = loses && loses(count_++);
    const hal::CycleStatus status = RobotWrapper::exchange(command, lost ? unheard : sample);
    if (lost) sample.enabled = unheard.enabled;
    return status;
  }
  /// Whether it loses the answer of its nth cycle. Empty: never.
  std::function<bool(int n)> loses;

  /// All except one of this many.
  static std::function<bool(int n)> all_but_one_of(int frames) {
    return [frames](int n) { return n % frames != frames - 1; };
  }

 private:
  int count_ = 0;
};

}  // namespace support
