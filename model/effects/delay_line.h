/// @file
/// The memory of an effect on the actuator.
#pragma once
#include <array>
#include <cmath>
#include <cstddef>

namespace model::effects {

/// The commands of the last kLongest_s at the rate of their arrival. Neither allocates nor locks.
class DelayLine {
 public:
  static constexpr double kLongest_s = 0.5;

  /// The input `delay_s` ago, linearly interpolated; zero before the first command.
  double pass(double torque_Nm, double delay_s, double interval_s) noexcept {
    newest_ = (newest_ + 1) % kSize;
    history_[newest_] = torque_Nm;
    const double back = interval_s > 0 ? delay_s / interval_s : 0;
    const double whole = std::floor(back);
    if (whole + 1 >= static_cast<double>(kSize)) return 0;
    const auto steps = static_cast<std::size_t>(whole);
    const double near = history_[(newest_ + kSize - steps) % kSize];
    const double far = history_[(newest_ + kSize - steps - 1) % kSize];
    return near + (back - whole) * (far - near);
  }

 private:
  static constexpr std::size_t kSize = 4096;
  std::array<double, kSize> history_{};
  std::size_t newest_ = 0;
};

/// What an effect on the actuator remembers of the commands.
struct ActuatorMemory {
  DelayLine line{};
  double lagged_Nm = 0;  ///< output of a lag
};

}  // namespace model::effects
