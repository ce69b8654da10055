/// @file
/// Statistics for intervals and verdicts.
#pragma once
#include <Eigen/Core>
#include <cstddef>
#include <limits>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace identification::fit {

/// Estimate of one parameter: a number with its 95 % interval, or the reason why there is none.
struct Estimate {
  std::string name;  ///< ends with its unit; for an effect: the name of the effect's parameter
  double value = std::numeric_limits<double>::quiet_NaN();
  double lower = -std::numeric_limits<double>::infinity();  ///< of the 95 % interval
  double upper = std::numeric_limits<double>::infinity();
  std::string not_identifiable{};  ///< the reason; empty if `value` is valid
  std::string effect{};            ///< of the drive model, to which the parameter belongs; empty: the drive
                                   ///< itself
  bool ok() const noexcept { return not_identifiable.empty(); }
  /// "stribeck static_torque_Nm"
  std::string title() const { return effect.empty() ? name : effect + " " + name; }
};
/// Null if it is not there.
const Estimate* find_estimate(std::span<const Estimate> estimates, std::string_view effect,
                              std::string_view name);
/// @throws std::invalid_argument if it is not there
const Estimate& estimate_of(std::span<const Estimate> estimates, std::string_view effect,
                            std::string_view name);

/// Quantile `p` of Student's t. [Cornish–Fisher expansion, Abramowitz & Stegun 26.7.5: better than 1 % for p
/// = 0.975 from 3 degrees of freedom on, less accurate further out]
double student_quantile(double p, double degrees_of_freedom);
/// Half a 95 % interval in standard deviations: the 97.5 % point; exact for 1 and 2 degrees of freedom.
double student_975(double degrees_of_freedom);
/// Quantile `p` of the normal distribution, 0 < p < 1; to 1e-9.
double normal_quantile(double p);
/// From absolute deviations from zero, scaled to a standard deviation of normal noise; 0 for none.
double robust_sigma(std::vector<double> deviations);
double median(std::vector<double> values);

struct MeanOf {
  double mean;    ///< NaN without values
  double ci95;    ///< half the 95 % interval, Student's t; NaN with fewer than two values
  double values;  ///< number of finite ones
};
/// Over the finite values.
MeanOf mean_of(std::span<const double> values);

/// Relative error 100·‖y − ŷ‖/‖y‖ in percent. 0/0 is 0.
double relative_error_percent(const Eigen::VectorXd& measured, const Eigen::VectorXd& predicted);
/// Coefficient of determination 1 − ‖y − ŷ‖²/‖y − mean(y)‖².
double r_squared(const Eigen::VectorXd& measured, const Eigen::VectorXd& predicted);

/// (JᵀJ)⁻¹ with columns scaled first, so that units do not matter; a direction without information becomes
/// very uncertain instead of an error.
Eigen::MatrixXd normal_inverse(const Eigen::MatrixXd& jacobian);
/// Ratio of the largest to the smallest singular value of J with columns of unit length; infinite if one is
/// zero.
double condition_number(const Eigen::MatrixXd& jacobian);
/// Covariance of a least-squares estimate whose residuals are correlated in time: (JᵀJ)⁻¹·Σ_b
/// s_b·s_bᵀ·(JᵀJ)⁻¹ with s_b = Σ J_iᵀ·r_i over block b of `blocks` equal stretches of time, times
/// blocks/(blocks − parameters). [cluster-robust "sandwich"; K.-Y. Liang, S. Zeger, Biometrika 73, 1986]
Eigen::MatrixXd block_covariance(const Eigen::MatrixXd& jacobian, const Eigen::VectorXd& residuals,
                                 std::size_t blocks);
/// The same for rows grouped in any other way: `group` of each row, from 0 to below `groups`.
Eigen::MatrixXd group_covariance(const Eigen::MatrixXd& jacobian, const Eigen::VectorXd& residuals,
                                 const std::vector<std::size_t>& group, std::size_t groups);

}  // namespace identification::fit
