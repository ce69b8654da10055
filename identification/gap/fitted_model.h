/// @file
/// A drive model whose parameters are fitted to the data.
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

/// Maximum change of the given inertia that does not count as an effect.
inline constexpr double kInertiaTolerance = 0.05;
/// An inertia effect changes it at most to a tenth and at most tenfold: beyond, it stands for another term
/// that follows the acceleration, such as a speed loop's response to a ripple.
inline constexpr double kMaxInertiaDecrease = 0.9;
inline constexpr double kMaxInertiaIncrease = 9;
/// Maximum delay of the torque sensor that does not count as an effect.
inline constexpr double kLongestLag_s = 0.01;
/// A torque that may be recorded even later.
constexpr bool is_longest_lag(double lag_s) { return lag_s > 0.99 * kLongestLag_s; }
/// Maximum lead: a recorder's convention may shift the torque by one sample.
inline constexpr double kLongestLead_s = 0.002;
/// Maximum delay of the current loop that does not count as an effect.
inline constexpr double kCurrentLoop_s = 1e-3;
/// In squared sample periods, smoothing_s2: a delay of a whole period, and a value that is held while the
/// motion is sampled.
inline constexpr double kMaxSmoothing = 0.5;
inline constexpr double kMinSmoothing = -1.0 / 12;
/// Two first-order filters of this time constant in the recording of the torque are not an effect either, nor
/// the second order of a delay by the whole lag. Effects that bend the torque no more, such as a spring far
/// above the band, cannot be distinguished from them.
inline constexpr double kTorqueFilter_s = 1.5e-3;
/// With longer periods, the band contains nothing fast enough to be affected.
inline constexpr double kLongestPeriod_s = 0.0125;

/// The model, and the properties of the torque's recording, which do not belong to the drive: a sensor's
/// filter, and whether a row holds the torque of an instant or the mean of a period, at its time or earlier.
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
  double scale = 1;  ///< significant change
};
/// All except the tail of a Stribeck curve, which is one of two forms, the `flank_Hz` of a gap, which is not
/// visible, the shares of a gear's loss beyond that of the load, and the parameters of friction laws, which
/// are given: inertia (within its tolerance, unless there is an inertia effect), lag and smoothing of the
/// torque (for a command, at most half a period, unless there is a delay), and the parameters of all effects.
std::vector<FreeParameter> free_parameters(const FittedModel& fitted, const Rows& rows);
FittedModel with_value(const FittedModel& fitted, const FreeParameter& parameter, double value);

/// Torque rows that the model predicts.
Eigen::VectorXd predicted_rows(const FittedModel& fitted, const Rows& rows);
/// ∂ prediction/∂ parameter, one column each.
Eigen::MatrixXd prediction_jacobian(const FittedModel& fitted, const Rows& rows,
                                    const std::vector<FreeParameter>& parameters);

/// Least squares over `use` (indices of rows): all free parameters, or those selected by `is_free`.
FittedModel refined(const FittedModel& fitted, const Rows& rows, const std::vector<Eigen::Index>& use,
                    const std::function<bool(const FreeParameter&)>& is_free = {});

/// Intervals that allow for residuals which are correlated in time, at a speed or at an acceleration, as
/// those of a missing effect are: the widest of the three. With a gap they also allow for flanks of half and
/// of twice the frequency. In the order of free_parameters(). A parameter that does not affect the data gets
/// a reason instead of a number.
std::vector<fit::Estimate> estimates(const FittedModel& fitted, const Rows& rows,
                                     const std::vector<Eigen::Index>& use);

}  // namespace identification::gap
