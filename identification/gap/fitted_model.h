/// @file
/// A drive model whose parameters follow the data.
#pragma once
#include <Eigen/Core>
#include <cstdint>
#include <functional>
#include <string_view>
#include <vector>

#include "identification/fit/statistics.h"
#include "identification/gap/prediction.h"
#include "model/effects/drive_model.h"

namespace identification::gap {

/// How far the data may move the given inertia before that is called an effect.
inline constexpr double kInertiaTolerance = 0.05;
/// An inertia effect makes of it no less than a tenth and no more than ten times: beyond, another term that
/// goes with the acceleration is taken for it, such as a speed loop's answer to a ripple.
inline constexpr double kMostInertiaLess = 0.9;
inline constexpr double kMostInertiaMore = 9;
/// A torque sensor may report this late without being called an effect.
inline constexpr double kLongestLag_s = 0.01;
/// Nor early by a sample, which is what a recorder's convention may shift it; at most this.
inline constexpr double kLongestLead_s = 0.002;
/// A current loop may deliver a command this late without being called an effect.
inline constexpr double kCurrentLoop_s = 1e-3;
/// In squared sample periods, smoothing_s2: a whole period late, and a value that is held where the motion is
/// sampled.
inline constexpr double kMostSmoothing = 0.5;
inline constexpr double kLeastSmoothing = -1.0 / 12;
/// Two first-order filters of this time constant in the torque's way into the recording are no effect either.
/// What bends the torque no more, such as a spring far above the band, cannot be told from them.
inline constexpr double kTorqueFilter_s = 1.5e-3;
/// Where periods are longer, nothing that is quick enough for it to matter is in the band.
inline constexpr double kLongestPeriod_s = 0.0125;

/// The model, and what the torque's way into the recording does, which is no property of the drive: a
/// sensor's filter, and a row that holds the torque of an instant or the mean of a period, at its time or
/// before.
struct FittedModel {
  model::effects::DriveModel model;
  double given_inertia_kg_m2 = 0;
  double lag_s = 0;
  double smoothing_s2 = 0;
};

/// One number in a FittedModel that a fit may change.
struct FreeParameter {
  enum class Kind : std::uint8_t { kInertia, kLag, kSmoothing, kEffect };
  Kind kind = Kind::kEffect;
  std::size_t effect = 0;   ///< index, for kEffect
  std::string_view name{};  ///< for kEffect
  double value = 0;
  double lower = 0;
  double upper = 0;
  double scale = 1;  ///< how far it has to move to matter
};
/// All of them but the tail of a Stribeck curve, which is one form or the other, and the `flank_Hz` of a gap,
/// which does not show: inertia (within its
/// tolerance, unless an inertia effect has taken over), lag and smoothing of the torque (of a command, half a
/// period at most, unless a delay has taken over), and the parameters of all effects.
std::vector<FreeParameter> free_parameters(const FittedModel& fitted, const Rows& rows);
FittedModel with_value(const FittedModel& fitted, const FreeParameter& parameter, double value);

/// Torque rows that the model predicts.
Eigen::VectorXd predicted_rows(const FittedModel& fitted, const Rows& rows);
/// ∂ prediction/∂ parameter, one column each.
Eigen::MatrixXd prediction_jacobian(const FittedModel& fitted, const Rows& rows,
                                    const std::vector<FreeParameter>& parameters);

/// Least squares over `use` (indices of rows): all free parameters together, or those that `is_free` says.
FittedModel refined(const FittedModel& fitted, const Rows& rows, const std::vector<Eigen::Index>& use,
                    const std::function<bool(const FreeParameter&)>& is_free = {});

/// Intervals that allow for residuals which belong together in time, at a speed or at an acceleration, as
/// what a model lacks does: the widest of the three. With a gap they also allow for flanks of half and of
/// twice the frequency. In the order of free_parameters(). One that the data does not move gets a reason
/// instead of a number.
std::vector<fit::Estimate> estimates(const FittedModel& fitted, const Rows& rows,
                                     const std::vector<Eigen::Index>& use);

}  // namespace identification::gap
