/// @file
/// A recording prepared for the comparison with a model: motion from position, all of it in one band.
#pragma once
#include <cstddef>
#include <numbers>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "identification/gap/gap.h"

namespace identification::gap {

/// A column added by the diagnosis: 1 where the measured torque is too low.
inline constexpr const char* kSaturated = "torque_saturated";

/// One recording, evenly sampled at several times the band, at the same rate as all others. All signals have
/// passed the same zero-phase filter, wider than the band, so that none lags and all lose the same. At
/// standstill friction is undetermined, and with a saturated sensor the torque is too low: these samples are
/// ignored (`moving` is 0).
struct Signals {
  std::string name;
  /// For several stretches of one recording: its index, and the stretch's start and end.
  std::size_t source = 0;
  double recorded_from_s = 0;
  double recorded_to_s = 0;
  double period_s = 0;
  double band_Hz = 0;    ///< for the comparison of data and model
  double filter_Hz = 0;  ///< of the signals here; wider, so that friction keeps its sharp reversal
  std::vector<double> time_s;
  std::vector<double> running_s;         ///< since the first sample
  std::vector<double> since_reversal_s;  ///< since the velocity last changed sign
  std::vector<double> position_rad;
  std::vector<double> velocity_rad_per_s;
  std::vector<double> acceleration_rad_per_s2;
  std::vector<double> moving;  ///< 1 or 0
  /// The sign of the velocity through the same filter, for quantities that follow it, such as friction: about
  /// -1 to 1.
  std::vector<double> direction;
  /// Delivered, as measured; without a measurement as commanded, at each sample the mean of the values held
  /// before and after it.
  std::vector<double> torque_Nm;
  std::vector<double> torque_rate_Nm_per_s;   ///< of torque_Nm
  std::vector<double> torque_bend_Nm_per_s2;  ///< of torque_rate_Nm_per_s
  bool torque_is_command = false;
  bool signed_by_motion = false;  ///< the torque; see Source
  /// At the rate of the slowest recording, unfiltered: for effects within milliseconds.
  double raw_period_s = 0;
  std::vector<double> raw_position_rad;
  std::vector<double> raw_torque_Nm;  ///< source of torque_Nm
  std::vector<double> raw_command_Nm;
  std::vector<double> raw_measured_Nm;
  std::vector<double> raw_velocity_command_rad_per_s;  ///< empty if there is none
  std::vector<double> raw_velocity_rad_per_s;          ///< only together with a velocity command

  std::size_t size() const noexcept { return time_s.size(); }
};

/// Common properties of all recordings of an analysis.
struct Band {
  double cutoff_Hz = 0;
  double resolution_rad = 0;
  double torque_sigma_Nm = 0;    ///< of one raw sample: noise and resolution of the sensor
  double slowest_rad_per_s = 0;  ///< below this the joint is at rest
  double raw_period_s = 0;       ///< of the recording with the lowest rate
};

/// The widest band, up to 25 Hz and a tenth of the lowest sample rate, in which the encoder's steps make less
/// torque noise (through inertia and acceleration) than the torque sensor, or little relative to the torque.
/// Rates may differ and times be uneven; a sample is used at its time.
/// @throws std::invalid_argument naming the recording that lacks a column or samples, or never moves.
Band choose_band(const std::vector<Source>& sources, const model::effects::DriveModel& base);

/// Effective value at the samples of a value that is held from each to the next: the mean of both sides,
/// which also moves a mass from sample to sample.
std::vector<double> at_samples(std::span<const double> held);

/// Seconds since the velocity last changed sign, at each sample.
std::vector<double> since_reversal(std::span<const double> velocity_rad_per_s, double period_s);

Signals make_signals(const Source& source, const Band& band);

/// Smaller strokes do not show how a torque depends on the position.
inline constexpr double kMinStroke_rad = 0.1;
/// A joint that covered more than a turn is continuous: no spring holds it.
inline constexpr double kEndlessTravel_rad = 2 * std::numbers::pi;

/// Maximum range covered by one recording, with all its stretches.
double widest_span_rad(std::span<const Signals> signals);
/// From the position 0.
double farthest_rad(std::span<const Signals> signals);

/// The 90th percentile of the commands' magnitude. With a dead-band threshold above it, the threshold and not
/// the measurement would determine the torque that the motion is compared with.
double usual_command_Nm(std::span<const Signals> signals);

}  // namespace identification::gap
