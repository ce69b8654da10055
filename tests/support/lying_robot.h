/// @file
/// A robot with faulty sensors from some time on.
#pragma once
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <random>
#include <vector>

#include "hal/robot_wrapper.h"
#include "hal/seconds.h"
#include "sim/bus/axis_data.h"
#include "tests/support/hall_sensors.h"

namespace support {

/// An encoder is position and velocity, a board is all three. A motor whose torque is a factor of what is
/// commanded, its sign included, while its board reports the commanded one.
enum class Channel { kEncoder, kPosition, kVelocity, kTorque, kBoard, kMotor };

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
  kPauses,     ///< is constant in every second interval of this many seconds, and true in between
  kFades,      ///< its gain fades from 1 to this within 2 s
  kGlitch,     ///< shows the true value plus this in a single sample, 0.1 s after the onset
  kSlips,      ///< an encoder that loses an electrical revolution at once, and again after this many seconds
  kConstant,   ///< shows this
};

/// A position counts on from its value at the onset; a frozen value is constant, except for the velocity of
/// an encoder, which is then zero.
struct SensorLie {
  std::size_t joint = 0;
  Channel channel = Channel::kEncoder;
  double value = 0.0;
  LieKind kind = LieKind::kFactor;
};

/// One faulty sensor.
class LyingSensor {
 public:
  /// @param begin true sample at the onset; `turns_per_rad` electrical revolutions of the joint's motor.
  LyingSensor(const SensorLie& lie, const hal::RobotSample& begin, double turns_per_rad) noexcept
      : lie_(lie),
        turns_per_rad_(turns_per_rad),
        begin_(begin.joints[lie.joint]),
        shown_(begin_),
        last_rad_(begin.joints[source()].position_rad) {}

  const SensorLie& lie() const noexcept { return lie_; }
  double shown_rad() const noexcept { return shown_.position_rad; }

  /// `own`: what the joint's other sensors show.
  hal::JointSample seen(const hal::JointSample& own, const hal::RobotSample& truth,
                        double elapsed_s) noexcept {
    const double before_s = time_s_;
    time_s_ += elapsed_s;
    if (lie_.kind == LieKind::kLoose && time_s_ >= contact_until_s_) {
      contact_ = !contact_;
      contact_until_s_ = time_s_ + std::exponential_distribution(1 / lie_.value)(random_);
    }
    const bool begins = before_s <= 0 && elapsed_s > 0;
    slips_ = lie_.kind == LieKind::kSlips &&
             (begins || std::floor(time_s_ / lie_.value) > std::floor(before_s / lie_.value));
    glitches_ = lie_.kind == LieKind::kGlitch && before_s < kGlitchAt_s && time_s_ >= kGlitchAt_s;
    const hal::JointSample& other = truth.joints[source()];
    const double way_rad = other.position_rad - last_rad_;
    last_rad_ = other.position_rad;
    shown_.fault = own.fault;
    shown_.homed = own.homed;
    shown_.position_rad = lies(Channel::kPosition) ? position(way_rad, elapsed_s) : own.position_rad;
    shown_.velocity_rad_per_s =
        lies(Channel::kVelocity) ? velocity(other.velocity_rad_per_s) : own.velocity_rad_per_s;
    shown_.torque_Nm = lies(Channel::kTorque) ? value(other.torque_Nm, begin_.torque_Nm) : own.torque_Nm;
    if (lie_.kind == LieKind::kLate) return late(own);
    if (lie_.kind == LieKind::kPauses) return paused(own);
    if (lie_.kind == LieKind::kCoarse || lie_.kind == LieKind::kNoisy) return blurred(own);
    if (glitches_ && lies(Channel::kPosition)) {
      hal::JointSample glitch = shown_;
      glitch.position_rad += lie_.value;
      return glitch;
    }
    return shown_;
  }

 private:
  static constexpr std::size_t kMemory = 128;
  static constexpr double kFading_s = 2.0;
  static constexpr double kGlitchAt_s = 0.1;

  bool lies(Channel channel) const noexcept {
    if (lie_.channel == Channel::kMotor) return channel == Channel::kTorque;
    return lie_.channel == channel || lie_.channel == Channel::kBoard ||
           (lie_.channel == Channel::kEncoder && channel != Channel::kTorque);
  }
  std::size_t source() const noexcept {
    return lie_.kind == LieKind::kSwapped ? static_cast<std::size_t>(lie_.value) : lie_.joint;
  }
  double noise() noexcept { return lie_.value * normal_(random_); }
  double faded() const noexcept { return 1 + (lie_.value - 1) * std::min(time_s_ / kFading_s, 1.0); }

  /// Counts on by the sensor's value of `way_rad`.
  double position(double way_rad, double elapsed_s) noexcept {
    const double jump_rad = time_s_ <= elapsed_s ? lie_.value : 0.0;
    switch (lie_.kind) {
      case LieKind::kFactor: return shown_.position_rad + lie_.value * way_rad;
      case LieKind::kFades: return shown_.position_rad + faded() * way_rad;
      case LieKind::kDrift: return shown_.position_rad + way_rad + lie_.value * elapsed_s;
      case LieKind::kJump: return shown_.position_rad + way_rad + jump_rad;
      case LieKind::kSlips: return shown_.position_rad + way_rad - (slips_ ? 1 / turns_per_rad_ : 0.0);
      case LieKind::kLoose: return shown_.position_rad + (contact_ ? way_rad : 0.0);
      case LieKind::kSaturated:
        return shown_.position_rad + std::clamp(way_rad, -lie_.value * elapsed_s, lie_.value * elapsed_s);
      case LieKind::kConstant: return lie_.value;
      default: return shown_.position_rad + way_rad;
    }
  }
  double velocity(double truth) const noexcept {
    const bool encoder = lie_.channel == Channel::kEncoder;
    if (lie_.kind == LieKind::kDrift) return truth + (encoder ? lie_.value : lie_.value * time_s_);
    if (lie_.kind == LieKind::kJump || lie_.kind == LieKind::kGlitch)
      return encoder ? truth : value(truth, begin_.velocity_rad_per_s);
    return value(truth, encoder ? 0.0 : begin_.velocity_rad_per_s);
  }
  double value(double truth, double frozen) const noexcept {
    switch (lie_.kind) {
      case LieKind::kFactor: return lie_.value == 0 ? frozen : lie_.value * truth;
      case LieKind::kFades: return faded() * truth;
      case LieKind::kDrift: return truth + lie_.value * time_s_;
      case LieKind::kJump: return truth + lie_.value;
      case LieKind::kGlitch: return glitches_ ? truth + lie_.value : truth;
      case LieKind::kLoose: return contact_ ? truth : 0.0;
      case LieKind::kSaturated: return std::clamp(truth, -lie_.value, lie_.value);
      case LieKind::kConstant: return lie_.value;
      default: return truth;
    }
  }

  hal::JointSample late(const hal::JointSample& own) noexcept {
    late_[late_count_++ % kMemory] = own;
    const auto cycles = std::min<std::size_t>(static_cast<std::size_t>(lie_.value / 1e-3), kMemory - 1);
    if (late_count_ <= cycles) return shown(own, begin_);
    return shown(own, late_[(late_count_ - 1 - cycles) % kMemory]);
  }
  hal::JointSample paused(const hal::JointSample& own) noexcept {
    if (std::fmod(time_s_ / lie_.value, 2.0) >= 1) begin_ = own;
    return shown(own, begin_);
  }
  hal::JointSample blurred(const hal::JointSample& own) noexcept {
    const bool coarse = lie_.kind == LieKind::kCoarse;
    const auto blur = [&](double truth) {
      return coarse ? lie_.value * std::round(truth / lie_.value) : truth + noise();
    };
    hal::JointSample blurred = own;
    blurred.position_rad = blur(own.position_rad);
    blurred.velocity_rad_per_s = lie_.channel == Channel::kEncoder ? own.velocity_rad_per_s  // a filtered one
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

  SensorLie lie_;
  double turns_per_rad_;
  hal::JointSample begin_;
  hal::JointSample shown_;
  double last_rad_;
  double time_s_ = 0.0;  // since the onset
  double contact_until_s_ = 0.0;
  bool contact_ = false;
  bool slips_ = false;
  bool glitches_ = false;
  std::array<hal::JointSample, kMemory> late_{};
  std::size_t late_count_ = 0;
  std::mt19937_64 random_{1};
  std::normal_distribution<double> normal_;
};

class LyingRobot final : public hal::RobotWrapper {
 public:
  /// A base, or a base and its arm: their motors have fault-free Hall sensors.
  explicit LyingRobot(hal::Robot& robot) : RobotWrapper(robot) {
    for (std::size_t i = 0; i < robot.joints().size(); ++i) {
      const sim::bus::BoardAxis& axis =
          i < 4 ? sim::bus::kWheelBoardAxis : sim::bus::kArmJointData.at(i - 4).axis;
      turns_per_rad_.push_back(axis.gear_ratio * axis.motor_poles / 2 / (2 * std::numbers::pi));
      hall_.emplace_back(turns_per_rad_.back());
    }
  }
  hal::CycleStatus exchange(const hal::RobotCommand& command, hal::RobotSample& sample) noexcept override {
    hal::RobotSample truth = truth_;
    const hal::CycleStatus status = RobotWrapper::exchange(obeyed(command), truth);
    const double elapsed_s = hal::seconds(truth.stamp - truth_.stamp);
    truth_ = sample = truth;
    for (LyingSensor& sensor : liars_) {
      hal::JointSample& joint = sample.joints[sensor.lie().joint];
      joint = sensor.seen(joint, truth, elapsed_s);
    }
    for (std::size_t i = 0; i < hall_.size(); ++i) {
      if (elapsed_s > 0) hall_[i].update(truth.joints[i].position_rad, sample.joints[i].position_rad);
      sample.joints[i].rotor = hall_[i].reading();
      apparent_ = apparent_ || (!liars_.empty() && beyond_tolerance(i, truth.joints[i], sample.joints[i]));
    }
    return status;
  }
  /// From the next exchange on, besides earlier ones.
  void lie(const SensorLie& lie) { liars_.emplace_back(lie, truth_, turns_per_rad_[lie.joint]); }

  /// Whether a reading has been wrong since then by more than a working sensor may be: a position by half an
  /// electrical revolution of its motor, the others by a fifth and a share of what the joint can do.
  bool apparent() const noexcept { return apparent_; }

 private:
  /// What the drives do: a position controller drives its joint by what the encoder shows.
  hal::RobotCommand obeyed(hal::RobotCommand command) const noexcept {
    for (const LyingSensor& sensor : liars_) {
      const std::size_t i = sensor.lie().joint;
      hal::JointCommand& joint = command.joints[i];
      if (sensor.lie().channel == Channel::kMotor && joint.mode == hal::CommandMode::kTorque)
        joint.target *= sensor.lie().value;
      if (sensor.lie().channel == Channel::kEncoder && joint.mode == hal::CommandMode::kPosition)
        joint.target += truth_.joints[i].position_rad - sensor.shown_rad();
    }
    return command;
  }
  bool beyond_tolerance(std::size_t i, const hal::JointSample& truth,
                        const hal::JointSample& shown) const noexcept {
    constexpr double kShare = 0.2;
    constexpr double kOfLimit = 0.05;
    const hal::JointInfo& info = joints()[i];
    const auto off = [&](double true_value, double shown_value, double limit) {
      return std::abs(shown_value - true_value) > kShare * std::abs(true_value) + kOfLimit * limit;
    };
    return std::abs(shown.position_rad - truth.position_rad) > 0.5 / turns_per_rad_[i] ||
           off(truth.velocity_rad_per_s, shown.velocity_rad_per_s, info.speed_limit_rad_per_s) ||
           off(truth.torque_Nm, shown.torque_Nm, info.torque_limit_Nm);
  }

  std::vector<double> turns_per_rad_;
  std::vector<HallSensors> hall_;
  std::vector<LyingSensor> liars_;
  hal::RobotSample truth_;
  bool apparent_ = false;
};

}  // namespace support
