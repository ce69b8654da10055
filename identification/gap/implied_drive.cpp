#include "identification/gap/implied_drive.h"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstddef>

#include "identification/fit/statistics.h"
#include "identification/gap/zero_phase.h"

namespace identification::gap {
namespace {

constexpr double kSlow_Hz = 5;
constexpr double kOfSampleRate = 0.1;
constexpr std::size_t kMinRowsToFit = 200;
/// For such a slow motion, more rows than these add no information.
constexpr std::size_t kMaxRowsToFit = 1'000'000;
/// Relative to the fastest: below, friction need not follow the sign of the velocity.
constexpr double kMoving = 0.05;
constexpr std::size_t kFitBlocks = 20;
/// Standard deviations from zero at which a sign is certain.
constexpr double kCertain = 5;
/// Minimum share that the acceleration must remove of the residual of the other terms. A speed loop that
/// responds to a torque ripple looks like an inertia, too, but drives all the time.
constexpr double kMinInertiaShare = 0.8;
/// Minimum share that the terms of a weight must remove. With less they are left out: for small motions they
/// hardly differ from the inertia's.
constexpr double kMinWeightShare = 0.5;
constexpr double kAnother = 5;
constexpr double kAgreement = 1.5;

Eigen::VectorXd solution(const Eigen::MatrixXd& columns, const Eigen::VectorXd& target) {
  return fit::normal_inverse(columns) * (columns.transpose() * target);
}
/// Squared residual of the target after the columns.
double left_of(const Eigen::MatrixXd& columns, const Eigen::VectorXd& target) {
  return (target - columns * solution(columns, target)).squaredNorm();
}

}  // namespace

SmoothMotion smooth_motion_of(const Source& source) {
  const Recording& recording = source.recording;
  SmoothMotion motion{.rows = EvenRows(source), .position_rad = {}, .velocity_rad_per_s = {}};
  if (recording.has("position_rad")) {
    motion.position_rad = smooth(motion, recording.column("position_rad"));
    motion.velocity_rad_per_s = derivative(motion.position_rad, motion.rows.period_s());
  } else if (recording.has("velocity_rad_per_s")) {
    motion.velocity_rad_per_s = smooth(motion, recording.column("velocity_rad_per_s"));
  }
  return motion;
}

std::vector<double> smooth(const SmoothMotion& motion, std::span<const double> column) {
  const double period_s = motion.rows.period_s();
  return zero_phase(motion.rows.of(column, Between::kCurve), period_s,
                    std::min(kSlow_Hz, kOfSampleRate / period_s));
}

std::optional<ImpliedDrive> implied_by(const Source& source, const SmoothMotion& motion,
                                       Quadrants quadrants) {
  const Recording& recording = source.recording;
  const char* const name = recording.has("torque_measured_Nm") ? "torque_measured_Nm" : "torque_command_Nm";
  if (!recording.has(name) || motion.velocity_rad_per_s.empty()) return {};
  const std::vector<double> torque = smooth(motion, recording.column(name));
  const std::vector<double>& velocity = motion.velocity_rad_per_s;
  const std::vector<double> acceleration = derivative(velocity, motion.rows.period_s());
  double fastest = 0;
  for (const double v : velocity) fastest = std::max(fastest, std::abs(v));
  std::vector<std::size_t> rows;
  rows.reserve(std::min(velocity.size(), kMaxRowsToFit));
  for (std::size_t i = 0; i < velocity.size(); i += 1 + velocity.size() / kMaxRowsToFit)
    if (std::abs(velocity[i]) > kMoving * fastest &&
        (quadrants == Quadrants::kAll || torque[i] * velocity[i] < 0))
      rows.push_back(i);
  if (rows.size() < kMinRowsToFit) return {};
  const bool has_weight = !motion.position_rad.empty();
  const auto count = static_cast<Eigen::Index>(rows.size());
  Eigen::MatrixXd columns(count, has_weight ? 6 : 4);
  Eigen::VectorXd target(count);
  for (Eigen::Index k = 0; k < count; ++k) {
    const std::size_t i = rows[static_cast<std::size_t>(k)];
    columns.row(k).head(4) << acceleration[i], std::copysign(1, velocity[i]), velocity[i], 1;
    if (has_weight)
      columns.row(k).tail(2) << std::sin(motion.position_rad[i]), std::cos(motion.position_rad[i]);
    target[k] = torque[i];
  }
  if (has_weight && left_of(columns, target) > (1 - kMinWeightShare) * left_of(columns.leftCols(4), target))
    columns.conservativeResize(Eigen::NoChange, 4);
  const Eigen::VectorXd fitted = solution(columns, target);
  const Eigen::MatrixXd covariance = fit::block_covariance(columns, target - columns * fitted, kFitBlocks);
  const double left = (target - columns * fitted).squaredNorm();
  const double left_without = left_of(columns.rightCols(columns.cols() - 1), target);
  const Eigen::VectorXd friction = columns.middleCols(1, 2) * fitted.segment(1, 2);
  return ImpliedDrive{.inertia_kg_m2 = fitted[0],
                      .inertia_sigma = std::sqrt(covariance(0, 0)),
                      .inertia_share = left_without > 0 ? 1 - left / left_without : 0,
                      .coulomb_Nm = fitted[1],
                      .coulomb_sigma = std::sqrt(covariance(1, 1)),
                      .viscous_Nm_s_per_rad = fitted[2],
                      .friction_W = friction.dot(columns.col(2)) / static_cast<double>(count)};
}

bool ImpliedDrive::inertia_is_sure() const noexcept {
  return std::abs(inertia_kg_m2) > kCertain * inertia_sigma;
}
bool ImpliedDrive::friction_is_sure() const noexcept {
  return std::abs(coulomb_Nm) > kCertain * coulomb_sigma;
}

std::optional<double> another_inertia(std::span<const Source> sources,
                                      const model::effects::DriveModel& base) {
  std::vector<double> found;
  bool braked = false;
  for (const Source& source : sources) {
    const SmoothMotion motion = smooth_motion_of(source);
    for (const Quadrants quadrants : {Quadrants::kAll, Quadrants::kBraking}) {
      const auto implied = implied_by(source, motion, quadrants);
      const bool sure = implied && implied->inertia_is_sure() && implied->inertia_share > kMinInertiaShare;
      if (sure) found.push_back(implied->inertia_kg_m2);
      if (!sure && quadrants == Quadrants::kAll) break;
      braked = braked || (sure && quadrants == Quadrants::kBraking);
    }
  }
  if (found.empty() || base.inertia_kg_m2 <= 0) return {};
  const double inertia = fit::median(found);
  const double factor = inertia / base.inertia_kg_m2;
  const bool agreed = std::ranges::all_of(
      found, [&](double j) { return j > inertia / kAgreement && j < kAgreement * inertia; });
  if (!braked || !agreed || inertia <= 0 || (factor < kAnother && factor > 1 / kAnother)) return {};
  return inertia;
}

}  // namespace identification::gap
