#include "sim/bus/manipulator_mechanics.h"

namespace sim::bus {

void ManipulatorMechanics::advance(std::chrono::nanoseconds period) noexcept {
  std::array<hal::JointCommand, kJoints> commands;
  for (std::size_t i = 0; i < kJoints; ++i) commands[i] = joints_[i].command_;
  robot_.advance(commands, true, period);
  read_joints();
}

void ManipulatorMechanics::read_joints() noexcept {
  std::array<hal::JointSample, kJoints> samples;
  robot_.measure(samples);
  for (std::size_t i = 0; i < kJoints; ++i) joints_[i].sample_ = samples[i];
  pose_ = robot_.pose();
}

}  // namespace sim::bus
