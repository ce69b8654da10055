/// @file
/// Effects on the torque between command and motor, and between motor and report.
#pragma once
#include <algorithm>
#include <array>
#include <cmath>

#include "model/effects/effect.h"

namespace model::effects {

struct TorqueDeadbandParameters {
  double threshold_Nm = 0.03;
};

/// The motor delivers its threshold torque for every smaller command: the youBot's 0.03 N·m [thesis 2.5.2]. A
/// command of exactly zero delivers nothing.
class TorqueDeadband : public WithParameters<TorqueDeadband, TorqueDeadbandParameters> {
 public:
  static constexpr std::string_view kName = "torque_deadband";
  static constexpr std::string_view kShows =
      "measured torque stays at one magnitude and jumps where the command crosses zero";
  static constexpr auto kParameters = std::to_array<ParameterInfo<TorqueDeadbandParameters>>(
      {{"threshold_Nm", member<&TorqueDeadbandParameters::threshold_Nm>, 0, kMaxTorque_Nm}});
  using WithParameters::WithParameters;

  double deliver(ActuatorMemory& /*memory*/, double torque_Nm, double /*interval_s*/) const noexcept {
    if (torque_Nm == 0 || std::abs(torque_Nm) >= parameters_.threshold_Nm) return torque_Nm;
    return std::copysign(parameters_.threshold_Nm, torque_Nm);
  }
};

struct TransportDelayParameters {
  double delay_s = 0.005;
};

/// Commands arrive late.
class TransportDelay : public WithParameters<TransportDelay, TransportDelayParameters> {
 public:
  static constexpr std::string_view kName = "transport_delay";
  static constexpr std::string_view kShows =
      "delivered torque follows the command later, by the same time at every frequency";
  static constexpr auto kParameters = std::to_array<ParameterInfo<TransportDelayParameters>>(
      {{"delay_s", member<&TransportDelayParameters::delay_s>, 0, DelayLine::kLongest_s}});
  using WithParameters::WithParameters;

  double deliver(ActuatorMemory& memory, double torque_Nm, double interval_s) const noexcept {
    return memory.line.pass(torque_Nm, parameters_.delay_s, interval_s);
  }
};

struct TorqueSaturationParameters {
  double limit_Nm = 1;
};

/// The motor delivers no more than a limit: that of its current (k_t times the gear ratio times the current),
/// or of its supply.
class TorqueSaturation : public WithParameters<TorqueSaturation, TorqueSaturationParameters> {
 public:
  static constexpr std::string_view kName = "torque_saturation";
  static constexpr std::string_view kShows =
      "delivered torque stays at one magnitude wherever the command is larger";
  static constexpr auto kParameters = std::to_array<ParameterInfo<TorqueSaturationParameters>>(
      {{"limit_Nm", member<&TorqueSaturationParameters::limit_Nm>, 1e-9, kMaxTorque_Nm}});
  using WithParameters::WithParameters;

  double deliver(ActuatorMemory& /*memory*/, double torque_Nm, double /*interval_s*/) const noexcept {
    return std::clamp(torque_Nm, -parameters_.limit_Nm, parameters_.limit_Nm);
  }
};

struct TorqueLagParameters {
  double time_constant_s = 0.02;
};

/// The delivered torque follows the command with a first-order lag: a slow current loop, a filter of the
/// command, a fluid or a long hose.
class TorqueLag : public WithParameters<TorqueLag, TorqueLagParameters> {
 public:
  static constexpr std::string_view kName = "torque_lag";
  static constexpr std::string_view kShows =
      "delivered torque rounds the steps of the command: slow changes pass, fast ones shrink";
  static constexpr auto kParameters = std::to_array<ParameterInfo<TorqueLagParameters>>(
      {{"time_constant_s", member<&TorqueLagParameters::time_constant_s>, 1e-5, 5}});
  using WithParameters::WithParameters;

  double deliver(ActuatorMemory& memory, double torque_Nm, double interval_s) const noexcept {
    memory.lagged_Nm -=
        std::expm1(-interval_s / parameters_.time_constant_s) * (torque_Nm - memory.lagged_Nm);
    return memory.lagged_Nm;
  }
};

struct ActuatorGainParameters {
  double gain = 1.1;
};

/// The actuator delivers a multiple of the command: a wrong torque constant or gear ratio in the drive, or in
/// the program that recorded the command.
class ActuatorGain : public WithParameters<ActuatorGain, ActuatorGainParameters> {
 public:
  static constexpr std::string_view kName = "actuator_gain";
  static constexpr std::string_view kShows = "measured torque is the command times one factor";
  static constexpr auto kParameters = std::to_array<ParameterInfo<ActuatorGainParameters>>(
      {{"gain", member<&ActuatorGainParameters::gain>, 1e-3, 1e3}});
  using WithParameters::WithParameters;

  double deliver(ActuatorMemory& /*memory*/, double torque_Nm, double /*interval_s*/) const noexcept {
    return parameters_.gain * torque_Nm;
  }
};

struct ActuatorOffsetParameters {
  double torque_Nm = 0.02;
};

/// The actuator delivers the same torque beyond every command: the current sensor of its own loop has an
/// offset.
class ActuatorOffset : public WithParameters<ActuatorOffset, ActuatorOffsetParameters> {
 public:
  static constexpr std::string_view kName = "actuator_offset";
  static constexpr std::string_view kShows =
      "measured torque differs from the command by one value, and the joint moves by the measured torque";
  static constexpr auto kParameters = std::to_array<ParameterInfo<ActuatorOffsetParameters>>(
      {{"torque_Nm", member<&ActuatorOffsetParameters::torque_Nm>, -kMaxTorque_Nm, kMaxTorque_Nm}});
  using WithParameters::WithParameters;

  double deliver(ActuatorMemory& /*memory*/, double torque_Nm, double /*interval_s*/) const noexcept {
    return torque_Nm + parameters_.torque_Nm;
  }
};

struct UnsignedCurrentParameters {};

/// A current sensor that reports magnitude only.
class UnsignedCurrent : public WithParameters<UnsignedCurrent, UnsignedCurrentParameters> {
 public:
  static constexpr std::string_view kName = "unsigned_current";
  static constexpr std::string_view kShows =
      "measured torque is never negative, whichever way the joint is driven";
  static constexpr std::array<ParameterInfo<UnsignedCurrentParameters>, 0> kParameters{};
  using WithParameters::WithParameters;

  double report_Nm(double torque_Nm) const noexcept { return std::abs(torque_Nm); }
};

struct TorqueSensorOffsetParameters {
  double torque_Nm = 0.02;
};

/// A torque or current sensor that reports the same torque beyond the true one.
class TorqueSensorOffset : public WithParameters<TorqueSensorOffset, TorqueSensorOffsetParameters> {
 public:
  static constexpr std::string_view kName = "torque_sensor_offset";
  static constexpr std::string_view kShows =
      "measured torque differs from the command by one value, and the joint moves by the command";
  static constexpr auto kParameters = std::to_array<ParameterInfo<TorqueSensorOffsetParameters>>(
      {{"torque_Nm", member<&TorqueSensorOffsetParameters::torque_Nm>, -kMaxTorque_Nm, kMaxTorque_Nm}});
  using WithParameters::WithParameters;

  double report_Nm(double torque_Nm) const noexcept { return torque_Nm + parameters_.torque_Nm; }
};

}  // namespace model::effects
