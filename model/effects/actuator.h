/// @file
/// Effects on the torque between command and motor, and between motor and report.
#pragma once
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

  double deliver(DelayLine& /*line*/, double torque_Nm, double /*interval_s*/) const noexcept {
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

  double deliver(DelayLine& line, double torque_Nm, double interval_s) const noexcept {
    return line.pass(torque_Nm, parameters_.delay_s, interval_s);
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

}  // namespace model::effects
