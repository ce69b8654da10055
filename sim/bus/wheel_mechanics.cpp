#include "sim/bus/wheel_mechanics.h"

namespace sim::bus {

void WheelMechanics::advance(std::chrono::nanoseconds period) noexcept {
  std::array<hal::JointCommand, 4> commands;
  for (std::size_t i = 0; i < commands.size(); ++i) commands[i] = wheels_[i].command_;
  base_.advance(commands, true, period);
  std::array<hal::JointSample, 4> samples;
  base_.measure(samples);
  for (std::size_t i = 0; i < samples.size(); ++i) wheels_[i].sample_ = samples[i];
}

}  // namespace sim::bus
