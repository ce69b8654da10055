/// @file
/// A recording made ready to be compared with a model: motion from position, all of it in one band.
#pragma once
#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "identification/gap/gap.h"

namespace identification::gap {

/// A column that the diagnosis adds: 1 where the measured torque says too little.
inline constexpr const char* kSaturated = "torque_saturated";

/// One recording, evenly sampled at several times the band, at the same rate as all others. All signals have
/// passed the same zero-phase filter, wider than the band, so that none lags and all lack the same. Where the
/// joint stands still, friction is whatever holds, and where the torque sensor is saturated it says too
/// little: these samples count for nothing (`moving` is 0).
struct Signals {
  std::string name;
  /// Of several stretches of one recording: which it is, and when it begins and ends.
  std::size_t source = 0;
  double recorded_from_s = 0;
  double recorded_to_s = 0;
  double period_s = 0;
  double band_Hz = 0;    ///< in which data and model are compared
  double filter_Hz = 0;  ///< of the signals here; wider, so that friction turns as sharply as it does
  std::vector<double> time_s;
  std::vector<double> running_s;  ///< since the first sample
  std::vector<double> position_rad;
  std::vector<double> velocity_rad_per_s;
  std::vector<double> acceleration_rad_per_s2;
  std::vector<double> moving;  ///< 1 or 0
  /// The sign of the velocity through the same filter, for what turns with it, such as friction: about -1
  /// to 1.
  std::vector<double> direction;
  /// Delivered, as measured; where nothing was measured as commanded, at each sample the mean of what was
  /// held before and after it.
  std::vector<double> torque_Nm;
  std::vector<double> torque_rate_Nm_per_s;   ///< of torque_Nm
  std::vector<double> torque_bend_Nm_per_s2;  ///< of torque_rate_Nm_per_s
  bool torque_is_command = false;
  /// At the rate of the slowest recording, unfiltered: for what happens within milliseconds.
  double raw_period_s = 0;
  std::vector<double> raw_position_rad;
  std::vector<double> raw_torque_Nm;  ///< of which torque_Nm is made
  std::vector<double> raw_command_Nm;
  std::vector<double> raw_measured_Nm;
  std::vector<double> raw_velocity_command_rad_per_s;  ///< empty when there is none
  std::vector<double> raw_velocity_rad_per_s;          ///< only beside a command of it

  std::size_t size() const noexcept { return time_s.size(); }
};

/// What all recordings of an analysis share.
struct Band {
  double cutoff_Hz = 0;
  double resolution_rad = 0;
  double torque_sigma_Nm = 0;    ///< of one raw sample: noise and resolution of the sensor
  double slowest_rad_per_s = 0;  ///< below this the joint stands
  double raw_period_s = 0;       ///< of the recording with the lowest rate
};

/// The widest band, up to 25 Hz and a tenth of the lowest sample rate, in which the encoder's steps make less
/// torque noise (through inertia and acceleration) than the torque sensor does, or little against the torque.
/// Rates may differ and times be uneven; a sample counts when its time says.
/// @throws std::invalid_argument naming the recording that lacks a column or samples, or never moves.
Band choose_band(const std::vector<Source>& sources, const model::effects::DriveModel& base);

/// What acts at the samples of a value that is held from each to the next: the mean of both sides, as which
/// it also moves a mass from sample to sample.
std::vector<double> at_samples(std::span<const double> held);

Signals make_signals(const Source& source, const Band& band);

/// The most that one recording covers, its stretches together.
double widest_span_rad(std::span<const Signals> signals);
/// From the position 0.
double farthest_rad(std::span<const Signals> signals);

/// The 90th percentile of the commands' magnitude. With a dead-band threshold above it, the threshold and not
/// the measurement would determine the torque that the motion is compared with.
double usual_command_Nm(std::span<const Signals> signals);

}  // namespace identification::gap
