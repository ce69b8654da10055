/// @file
/// A robot with one faulty sensor from some time on.
#pragma once
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <optional>
#include <random>
#include <vector>

#include "hal/robot_wrapper.h"
#include "hal/seconds.h"
#include "sim/bus/axis_data.h"
#include "tests/support/hall_sensors.h"

namespace support {

/// An encoder is position and velocity, a board is all three.
enum class Channel { kEncoder, kPosition, kVelocity, kTorque, kBoard };

/// Kind of fault, and the meaning of SensorLie::value.
enum class LieKind : std::uint8_t {
  kFactor,     ///< shows this times the true value; 0: constant
  kDrift,      ///< drifts from the true value at this rate per second
  kJump,       ///< has this offset at once
  kLate,       ///< shows the value of this many seconds ago
  kCoarse,     ///< shows whole multiples of this
  kNoisy,      ///< adds white noise of this standard deviation
  kLoose,      ///< loses contact repeatedly, for this many seconds on average: counts in that time are lost
  kSaturated,  ///< shows at most this value; an encoder counts no faster
  kSwapped,    ///< shows the joint of this index
};

/// A position counts on from its value at the onset; a frozen value is constant, except for the velocity of
/// an encoder, which is then zero.
struct SensorLie {
  std::size_t joint = 0;
  Channel channel = Channel::kEncoder;
  double value = 0.0;
  LieKind kind = LieKind::kFactor;
};

class LyingRobot final : public hal::RobotWrapper {
 public:
  /// A base, or a base and its arm: their motors have fault-free Hall sensors.
  explicit LyingRobot(hal::Robot& robot) : RobotWrapper(robot) {
    for (std::size_t i = 0; i < robot.joints().size(); ++i) {
      const sim::bus::BoardAxis& axis =
          i < 4 ? sim::bus::kWheelBoardAxis : sim::bus::kArmJointData.at(i - 4).axis;
      hall_.emplace_back(axis.gear_ratio * axis.motor_poles / 2 / (2 * std::numbers::pi));
    }
  }
  hal::CycleStatus exchange(const hal::RobotCommand& command, hal::RobotSample& sample) noexcept override {
    hal::RobotSample truth = truth_;
    const hal::CycleStatus status = RobotWrapper::exchange(command, truth);
    const double elapsed_s = hal::seconds(truth.stamp - truth_.stamp);
    truth_ = sample = truth;
    if (lie_) sample.joints[lie_->joint] = seen(truth, elapsed_s);
    for (std::size_t i = 0; i < hall_.size(); ++i) {
      if (elapsed_s > 0) hall_[i].update(truth.joints[i].position_rad, sample.joints[i].position_rad);
      sample.joints[i].rotor = hall_[i].reading();
    }
    return status;
  }
  /// From the next exchange on.
  void lie(const SensorLie& lie) noexcept {
    lie_ = lie;
    begin_ = shown_ = truth_.joints[lie.joint];
    last_rad_ = truth_.joints[source()].position_rad;
    time_s_ = contact_until_s_ = 0.0;
    contact_ = false;
    late_count_ = 0;
  }

 private:
  static constexpr std::size_t kMemory = 128;

  bool lies(Channel channel) const noexcept {
    return lie_->channel == channel || lie_->channel == Channel::kBoard ||
           (lie_->channel == Channel::kEncoder && channel != Channel::kTorque);
  }
  std::size_t source() const noexcept {
    return lie_->kind == LieKind::kSwapped ? static_cast<std::size_t>(lie_->value) : lie_->joint;
  }
  double noise() noexcept { return lie_->value * normal_(random_); }

  hal::JointSample seen(const hal::RobotSample& truth, double elapsed_s) noexcept {
    time_s_ += elapsed_s;
    if (lie_->kind == LieKind::kLoose && time_s_ >= contact_until_s_) {
      contact_ = !contact_;
      contact_until_s_ = time_s_ + std::exponential_distribution(1 / lie_->value)(random_);
    }
    const hal::JointSample& own = truth.joints[lie_->joint];
    const hal::JointSample& other = truth.joints[source()];
    const double way_rad = other.position_rad - last_rad_;
    last_rad_ = other.position_rad;
    shown_.fault = own.fault;
    shown_.homed = own.homed;
    shown_.position_rad = lies(Channel::kPosition) ? position(way_rad, elapsed_s) : own.position_rad;
    shown_.velocity_rad_per_s =
        lies(Channel::kVelocity) ? velocity(other.velocity_rad_per_s) : own.velocity_rad_per_s;
    shown_.torque_Nm = lies(Channel::kTorque) ? value(other.torque_Nm, begin_.torque_Nm) : own.torque_Nm;
    if (lie_->kind == LieKind::kLate) return late(own);
    if (lie_->kind == LieKind::kCoarse || lie_->kind == LieKind::kNoisy) return blurred(own);
    return shown_;
  }

  /// Counts on by the sensor's value of `way_rad`.
  double position(double way_rad, double elapsed_s) noexcept {
    const double jump_rad = time_s_ <= elapsed_s ? lie_->value : 0.0;
    switch (lie_->kind) {
      case LieKind::kFactor: return shown_.position_rad + lie_->value * way_rad;
      case LieKind::kDrift: return shown_.position_rad + way_rad + lie_->value * elapsed_s;
      case LieKind::kJump: return shown_.position_rad + way_rad + jump_rad;
      case LieKind::kLoose: return shown_.position_rad + (contact_ ? way_rad : 0.0);
      case LieKind::kSaturated:
        return shown_.position_rad + std::clamp(way_rad, -lie_->value * elapsed_s, lie_->value * elapsed_s);
      default: return shown_.position_rad + way_rad;
    }
  }
  double velocity(double truth) const noexcept {
    const bool encoder = lie_->channel == Channel::kEncoder;
    if (lie_->kind == LieKind::kDrift) return truth + (encoder ? lie_->value : lie_->value * time_s_);
    if (lie_->kind == LieKind::kJump) return encoder ? truth : truth + lie_->value;
    return value(truth, encoder ? 0.0 : begin_.velocity_rad_per_s);
  }
  double value(double truth, double frozen) const noexcept {
    switch (lie_->kind) {
      case LieKind::kFactor: return lie_->value == 0 ? frozen : lie_->value * truth;
      case LieKind::kDrift: return truth + lie_->value * time_s_;
      case LieKind::kJump: return truth + lie_->value;
      case LieKind::kLoose: return contact_ ? truth : 0.0;
      case LieKind::kSaturated: return std::clamp(truth, -lie_->value, lie_->value);
      default: return truth;
    }
  }

  hal::JointSample late(const hal::JointSample& own) noexcept {
    late_[late_count_++ % kMemory] = own;
    const auto cycles = std::min<std::size_t>(static_cast<std::size_t>(lie_->value / 1e-3), kMemory - 1);
    if (late_count_ <= cycles) return shown(own, begin_);
    return shown(own, late_[(late_count_ - 1 - cycles) % kMemory]);
  }
  hal::JointSample blurred(const hal::JointSample& own) noexcept {
    const bool coarse = lie_->kind == LieKind::kCoarse;
    const auto blur = [&](double truth) {
      return coarse ? lie_->value * std::round(truth / lie_->value) : truth + noise();
    };
    hal::JointSample blurred = own;
    blurred.position_rad = blur(own.position_rad);
    blurred.velocity_rad_per_s = lie_->channel == Channel::kEncoder
                                     ? own.velocity_rad_per_s  // a filtered one
                                     : blur(own.velocity_rad_per_s);
    blurred.torque_Nm = blur(own.torque_Nm);
    return shown(own, blurred);
  }
  /// The faulty channels from `wrong`, the others from `own`.
  hal::JointSample shown(hal::JointSample own, const hal::JointSample& wrong) const noexcept {
    if (lies(Channel::kPosition)) own.position_rad = wrong.position_rad;
    if (lies(Channel::kVelocity)) own.velocity_rad_per_s = wrong.velocity_rad_per_s;
    if (lies(Channel::kTorque)) own.torque_Nm = wrong.torque_Nm;
    return own;
  }

  std::vector<HallSensors> hall_;
  std::optional<SensorLie> lie_;
  hal::RobotSample truth_;
  hal::JointSample begin_;
  hal::JointSample shown_;
  double last_rad_ = 0.0;
  double time_s_ = 0.0;  // since the onset
  double contact_until_s_ = 0.0;
  bool contact_ = false;
  std::array<hal::JointSample, kMemory> late_{};
  std::size_t late_count_ = 0;
  std::mt19937_64 random_{1};
  std::normal_distribution<double> normal_;
};

}  // namespace support
