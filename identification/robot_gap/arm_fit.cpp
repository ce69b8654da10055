#include "identification/robot_gap/arm_fit.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <stdexcept>
#include <utility>

#include "control/serial_arm.h"
#include "identification/robot_gap/arm_noise.h"
#include "identification/robot_gap/arm_parameters.h"
#include "identification/robot_gap/arm_rows.h"
#include "identification/robot_gap/base_parameters.h"
#include "identification/robot_gap/rigid_arm.h"

namespace identification::robot_gap {
namespace {

using control::ArmDescription;

/// Blocks of all data, and their shortest length in periods of the band, as in the search.
constexpr double kFitBlocks = 60;
constexpr double kLeastFitBlock = 8;
/// Below this share of its top speed a joint counts as at rest. Around a reversal it sticks, and friction is
/// neither Coulomb nor viscous: more of the motion than in the search, where that would be an effect to name.
constexpr double kReversalShare = 0.2;
/// Fits, each linearised at and weighted by the one before.
constexpr int kLinearisedFits = 4;
/// A link whose fitted inertia no body has is fitted again, each time with so much of its deviation.
constexpr double kTighter = 0.5;
constexpr int kTightenings = 6;
constexpr double k95 = 1.96;
/// Of the joint's Coulomb friction, which varies by more: an offset below it is none.
constexpr double kOffsetShare = 0.02;
/// Share of its deviation before the fit that is left of a determined value.
constexpr double kDetermined = 0.5;
/// What a description of stiff gears does not say, in the intervals alone: how much gears bend, and how well
/// homing finds the zero.
constexpr double kComplianceSigma_rad_per_Nm = 5e-4;
constexpr double kZeroSigma_rad = 1e-3;
/// Of the recorded torques, before a fit.
constexpr double kLagSigma_s = 0.005;
constexpr double kLeastSigma = 1e-9;

bool is_friction(ArmTerm::Kind kind) {
  return kind == ArmTerm::Kind::kCoulomb || kind == ArmTerm::Kind::kViscous;
}

/// Recordings, compared with an arm.
struct Data {
  std::vector<ArmMotion> motions;
  RowPlan plan;

  Data(std::span<const ArmRecording> recordings, std::span<const double> rest_rad_per_s, double band_Hz) {
    double length_s = 0;
    for (const ArmRecording& recording : recordings) {
      motions.push_back(filtered(recording, band_Hz));
      length_s += static_cast<double>(motions.back().rows()) * motions.back().row_s();
    }
    const std::vector<double> rest(rest_rad_per_s.begin(), rest_rad_per_s.end());
    plan = plan_rows(motions, rest, std::max(kLeastFitBlock / band_Hz, length_s / kFitBlocks));
  }
};

/// Squares of a residual, by joint.
Eigen::VectorXd mean_squares(const RowPlan& plan, const Eigen::VectorXd& residual, Eigen::Index joints) {
  Eigen::VectorXd sum = Eigen::VectorXd::Zero(joints);
  Eigen::VectorXd count = Eigen::VectorXd::Zero(joints);
  for (std::size_t row = 0; row < plan.rows.size(); ++row) {
    const double one = residual[static_cast<Eigen::Index>(row)];
    sum[plan.rows[row].channel] += one * one;
    ++count[plan.rows[row].channel];
  }
  return sum.cwiseQuotient(count.cwiseMax(1));
}

/// Given values, changes, and what is fitted of them.
struct Unknowns {
  std::vector<ArmParameter> parameters;
  Eigen::VectorXd change;     // of each parameter, then the lag
  std::vector<bool> is_free;  // likewise

  explicit Unknowns(const ArmDescription& arm)
      : parameters(arm_parameters(arm)),
        change(Eigen::VectorXd::Zero(static_cast<Eigen::Index>(parameters.size()) + 1)),
        is_free(parameters.size() + 1, true) {}

  double sigma(std::size_t k) const { return k < parameters.size() ? parameters[k].sigma : kLagSigma_s; }
  void fix(std::size_t k, double value) {
    is_free[k] = false;
    change[static_cast<Eigen::Index>(k)] = value;
  }
  ArmDescription arm(const ArmDescription& given) const {
    ArmDescription result = given;
    for (std::size_t k = 0; k < parameters.size(); ++k)
      if (const double by = change[static_cast<Eigen::Index>(k)]; by != 0)
        robot_gap::change(result, parameters[k].term, by);
    return result;
  }
  std::vector<std::size_t> free() const {
    std::vector<std::size_t> list;
    for (std::size_t k = 0; k < is_free.size(); ++k)
      if (is_free[k]) list.push_back(k);
    return list;
  }
};

/// A linear fit in units of the unknowns' deviations.
struct Step {
  std::vector<std::size_t> of;  // unknowns
  Eigen::VectorXd change;       // their new changes
  Eigen::MatrixXd covariance;
  Eigen::MatrixXd by_torque;  // change of each unknown with each measured torque
};

class Fitting {
 public:
  Fitting(const ArmDescription& given, const Data& data, Eigen::VectorXd floor)
      : given_(given), data_(data), floor_(std::move(floor)), sigma_(floor_), unknowns_(given) {}

  void run() {
    for (int tightened = 0;; ++tightened) {
      converge();
      if (drop_offsets_and_negative_friction()) converge();
      if (tightened == kTightenings || !tighten_impossible_links()) break;
    }
    add_errors_of_angles();
  }

  const Unknowns& unknowns() const { return unknowns_; }
  const Step& last() const { return last_; }
  ArmDescription arm() const { return unknowns_.arm(given_); }
  double lag_s() const { return unknowns_.change[unknowns_.change.size() - 1]; }

 private:
  void converge() {
    for (int fit = 0; fit < kLinearisedFits; ++fit) {
      last_ = step();
      for (std::size_t k = 0; k < last_.of.size(); ++k)
        unknowns_.change[static_cast<Eigen::Index>(last_.of[k])] = last_.change[static_cast<Eigen::Index>(k)];
    }
  }

  Step step() {
    std::vector<ArmTerm> terms;
    for (const ArmParameter& one : unknowns_.parameters) terms.push_back(one.term);
    terms.push_back({ArmTerm::Kind::kLag});
    ComparedRows rows = compare(arm(), data_.motions, data_.plan, terms);
    const Eigen::VectorXd residual = rows.measured - rows.predicted - lag_s() * rows.columns.rightCols(1);
    sigma_ = mean_squares(data_.plan, residual, floor_.size()).cwiseSqrt().cwiseMax(floor_);
    Step step{unknowns_.free(), {}, {}, {}};
    const auto count = static_cast<Eigen::Index>(step.of.size());
    Eigen::MatrixXd columns(residual.size(), count);
    Eigen::VectorXd now(count);
    for (Eigen::Index k = 0; k < count; ++k) {
      const std::size_t of = step.of[static_cast<std::size_t>(k)];
      columns.col(k) = unknowns_.sigma(of) * rows.columns.col(static_cast<Eigen::Index>(of));
      now[k] = unknowns_.change[static_cast<Eigen::Index>(of)] / unknowns_.sigma(of);
    }
    Eigen::VectorXd scaled = residual;
    for (Eigen::Index row = 0; row < scaled.size(); ++row) {
      const double weight = 1 / sigma_[data_.plan.rows[static_cast<std::size_t>(row)].channel];
      scaled[row] *= weight;
      columns.row(row) *= weight;
    }
    solve(columns, scaled, now, step);
    for (Eigen::Index row = 0; row < scaled.size(); ++row)
      step.by_torque.col(row) /= sigma_[data_.plan.rows[static_cast<std::size_t>(row)].channel];
    return step;
  }

  void solve(const Eigen::MatrixXd& columns, const Eigen::VectorXd& residual, const Eigen::VectorXd& now,
             Step& step) const {
    const Eigen::Index count = columns.cols();
    const Eigen::MatrixXd unit = Eigen::MatrixXd::Identity(count, count);
    const Eigen::MatrixXd information = columns.transpose() * columns;
    const Eigen::LDLT<Eigen::MatrixXd> plain(information + unit);
    const Eigen::VectorXd left =
        residual - columns * plain.solve(columns.transpose() * residual - now).eval();
    const Eigen::MatrixXd scatter = scatter_of(columns, left);
    // Residuals that hang together count less than as many independent ones.
    const double repeats =
        std::max(1.0, plain.solve(scatter).trace() / std::max(1e-9, plain.solve(information).trace()));
    const Eigen::LDLT<Eigen::MatrixXd> both(information / repeats + unit);
    const Eigen::VectorXd by = both.solve(columns.transpose() * residual / repeats - now);
    // The blocks are few: their scatter is mixed with that of an equal correlation of all residuals.
    const double blocks = data_.plan.blocks();
    const double share = blocks / (blocks + static_cast<double>(count));
    const Eigen::MatrixXd mixed = share * scatter + (1 - share) * repeats * information;
    const Eigen::MatrixXd inverse = both.solve(unit);
    Eigen::VectorXd sigma(count);
    for (Eigen::Index k = 0; k < count; ++k) sigma[k] = unknowns_.sigma(step.of[static_cast<std::size_t>(k)]);
    step.change = (now + by).cwiseProduct(sigma);
    step.by_torque = sigma.asDiagonal() * both.solve(columns.transpose()).eval() / repeats;
    step.covariance = sigma.asDiagonal() * (inverse * (mixed / (repeats * repeats) + unit) * inverse).eval() *
                      sigma.asDiagonal();
  }

  /// What the fit would find of them. [consider covariance, S. Schmidt, 1966]
  void add_errors_of_angles() {
    std::vector<ArmTerm> terms;
    Eigen::VectorXd sigma(2 * floor_.size());
    for (int joint = 0; joint < static_cast<int>(floor_.size()); ++joint) {
      sigma[static_cast<Eigen::Index>(terms.size())] = kZeroSigma_rad;
      terms.push_back({ArmTerm::Kind::kEncoderZero, joint});
      sigma[static_cast<Eigen::Index>(terms.size())] = kComplianceSigma_rad_per_Nm;
      terms.push_back({ArmTerm::Kind::kCompliance, joint, 1});
    }
    const Eigen::MatrixXd torque =
        compare(arm(), data_.motions, data_.plan, terms).columns * sigma.asDiagonal();
    const Eigen::MatrixXd found = last_.by_torque * torque;
    last_.covariance += found * found.transpose();
  }

  /// Of the sums over blocks.
  Eigen::MatrixXd scatter_of(const Eigen::MatrixXd& columns, const Eigen::VectorXd& left) const {
    Eigen::MatrixXd sums = Eigen::MatrixXd::Zero(columns.cols(), data_.plan.blocks());
    for (Eigen::Index row = 0; row < left.size(); ++row)
      sums.col(data_.plan.block[static_cast<std::size_t>(row)]) += left[row] * columns.row(row).transpose();
    return sums * sums.transpose();
  }

  bool drop_offsets_and_negative_friction() {
    bool dropped = false;
    const ArmDescription now = arm();
    for (std::size_t k = 0; k < last_.of.size(); ++k) {
      const std::size_t of = last_.of[k];
      if (of == unknowns_.parameters.size()) continue;
      const ArmTerm& term = unknowns_.parameters[of].term;
      const double given = value_of(term, given_);
      const auto at = static_cast<Eigen::Index>(k);
      const double value = given + last_.change[at];
      const double sigma = std::sqrt(last_.covariance(at, at));
      const double friction_Nm = now.drives[static_cast<std::size_t>(term.part)].coulomb_Nm;
      const bool may_be_zero = sigma < kDetermined * unknowns_.sigma(of) &&
                               std::abs(value) <= std::max(k95 * sigma, kOffsetShare * friction_Nm);
      if ((term.kind == ArmTerm::Kind::kOffset && may_be_zero) || (is_friction(term.kind) && value < 0)) {
        unknowns_.fix(of, -given);
        dropped = true;
      }
    }
    return dropped;
  }

  /// Whether a link has no body's inertia.
  bool tighten_impossible_links() {
    bool tightened = false;
    const ArmDescription now = arm();
    for (std::size_t i = 0; i < now.arm.links.size(); ++i) {
      const control::LinkInertia& body = now.arm.links[i].inertia;
      const double scale =
          std::max(body.about_C_kg_m2.norm(), given_.arm.links[i].inertia.about_C_kg_m2.norm());
      if (body.mass_kg > 0 && !control::negative_moment_kg_m2(body.about_C_kg_m2, scale)) continue;
      for (ArmParameter& one : unknowns_.parameters)
        if (one.term.part == static_cast<int>(i) && one.term.kind <= ArmTerm::Kind::kLinkInertia)
          one.sigma *= kTighter;
      tightened = true;
    }
    return tightened;
  }

  const ArmDescription& given_;
  const Data& data_;
  Eigen::VectorXd floor_;
  Eigen::VectorXd sigma_;
  Unknowns unknowns_;
  Step last_;
};

double fitted_lag_s(const ComparedRows& rows) {
  const Eigen::VectorXd lag = rows.columns.col(0);
  return lag.squaredNorm() > 0 ? lag.dot(rows.measured - rows.predicted) / lag.squaredNorm() : 0;
}

Residuals residuals_of(const Data& data, const ArmDescription& given, const ArmDescription& fitted,
                       double lag_s, const Eigen::VectorXd& floor) {
  const std::vector<ArmTerm> lag{{ArmTerm::Kind::kLag}};
  const ComparedRows before = compare(given, data.motions, data.plan, lag);
  const ComparedRows after = compare(fitted, data.motions, data.plan, lag);
  const Eigen::VectorXd left_before =
      before.measured - before.predicted - fitted_lag_s(before) * before.columns.col(0);
  const Eigen::VectorXd left_after = after.measured - after.predicted - lag_s * after.columns.col(0);
  const Eigen::VectorXd squares_before = mean_squares(data.plan, left_before, floor.size());
  const Eigen::VectorXd squares_after = mean_squares(data.plan, left_after, floor.size());
  const auto rows = std::max(1.0, static_cast<double>(left_before.size()));
  Residuals result{
      {}, std::sqrt(left_before.squaredNorm() / rows), std::sqrt(left_after.squaredNorm() / rows)};
  for (Eigen::Index j = 0; j < floor.size(); ++j)
    result.joints.push_back({given.drives[static_cast<std::size_t>(j)].joint, std::sqrt(squares_before[j]),
                             std::sqrt(squares_after[j]), floor[j]});
  return result;
}

std::vector<double> reversal_speeds_rad_per_s(std::span<const ArmRecording> data, double band_Hz) {
  std::vector<ArmMotion> motions;
  for (const ArmRecording& recording : data) motions.push_back(filtered(recording, band_Hz));
  std::vector<double> rest = rest_speeds_rad_per_s(motions, data, band_Hz);
  const std::vector<double> top = top_speeds_rad_per_s(motions);
  for (std::size_t j = 0; j < rest.size(); ++j) rest[j] = std::max(rest[j], kReversalShare * top[j]);
  return rest;
}

std::vector<FittedNumber> drive_numbers(const ArmDescription& given, const ArmDescription& fitted,
                                        const Unknowns& unknowns, const Step& last) {
  std::vector<FittedNumber> numbers;
  for (std::size_t k = 0; k < unknowns.parameters.size(); ++k) {
    const ArmTerm& term = unknowns.parameters[k].term;
    if (!is_friction(term.kind) && term.kind != ArmTerm::Kind::kOffset) continue;
    const auto found = std::ranges::find(last.of, k);
    const auto at = static_cast<Eigen::Index>(found - last.of.begin());
    const double half = found == last.of.end() ? 0 : k95 * std::sqrt(last.covariance(at, at));
    const char* const name = term.kind == ArmTerm::Kind::kCoulomb   ? "coulomb_Nm"
                             : term.kind == ArmTerm::Kind::kViscous ? "viscous_Nm_s_per_rad"
                                                                    : "offset_Nm";
    numbers.push_back({name + (" of " + given.drives[static_cast<std::size_t>(term.part)].joint),
                       value_of(term, given), value_of(term, fitted), half});
  }
  return numbers;
}

/// Change of inertial_parameters() per unit of a parameter.
Eigen::VectorXd inertial_slope(const ArmDescription& arm, const ArmTerm& term) {
  const auto joints = static_cast<Eigen::Index>(arm.drives.size());
  Eigen::VectorXd slope = Eigen::VectorXd::Zero(11 * joints);
  const control::LinkInertia& body = arm.arm.links[static_cast<std::size_t>(term.part)].inertia;
  auto of_link = slope.segment<10>(Eigen::Index{10} * term.part);
  switch (term.kind) {
    case ArmTerm::Kind::kLinkMass: of_link = unit_mass_at(body.p_LC_m); break;
    case ArmTerm::Kind::kLinkCentre: of_link = by_centre(body).col(term.index); break;
    case ArmTerm::Kind::kLinkInertia: of_link = by_inertia().col(term.index); break;
    case ArmTerm::Kind::kRotorInertia: slope[10 * joints + term.part] = 1; break;
    default: break;
  }
  return slope;
}

std::vector<FittedNumber> base_numbers(const ArmDescription& given, const ArmDescription& fitted,
                                       const Unknowns& unknowns, const Step& last) {
  const BaseParameters base(given);
  const auto count = static_cast<Eigen::Index>(last.of.size());
  Eigen::MatrixXd slopes = Eigen::MatrixXd::Zero(base.combinations().cols(), count);
  for (Eigen::Index k = 0; k < count; ++k)
    if (const std::size_t of = last.of[static_cast<std::size_t>(k)]; of < unknowns.parameters.size())
      slopes.col(k) = inertial_slope(fitted, unknowns.parameters[of].term);
  const Eigen::MatrixXd by = base.combinations() * slopes;
  const Eigen::VectorXd variance = (by * last.covariance * by.transpose()).diagonal();
  const Eigen::VectorXd before = base.of(given);
  const Eigen::VectorXd after = base.of(fitted);
  std::vector<FittedNumber> numbers;
  for (Eigen::Index k = 0; k < base.count(); ++k)
    numbers.push_back({base.names()[static_cast<std::size_t>(k)], before[k], after[k],
                       k95 * std::sqrt(std::max(0.0, variance[k]))});
  return numbers;
}

}  // namespace

ArmFit fit_arm(const ArmDescription& given, std::span<const ArmRecording> data,
               std::span<const ArmRecording> held_out, double band_Hz) {
  if (data.empty()) throw std::invalid_argument("there is no recording to fit");
  band_Hz = usable_band_Hz(held_out, usable_band_Hz(data, band_Hz));
  const std::vector<double> rest = reversal_speeds_rad_per_s(data, band_Hz);
  const Data searched(data, rest, band_Hz);
  if (searched.plan.rows.empty()) throw std::invalid_argument("no joint moves in the recordings");
  const Eigen::VectorXd floor = noise_floor_Nm(given, data, band_Hz).cwiseMax(kLeastSigma);
  Fitting fitting(given, searched, floor);
  fitting.run();
  ArmFit fit;
  fit.arm = fitting.arm();
  fit.lag_s = fitting.lag_s();
  fit.band_Hz = band_Hz;
  fit.drives = drive_numbers(given, fit.arm, fitting.unknowns(), fitting.last());
  fit.base = base_numbers(given, fit.arm, fitting.unknowns(), fitting.last());
  fit.searched = residuals_of(searched, given, fit.arm, fit.lag_s, floor);
  if (!held_out.empty())
    fit.held_out = residuals_of(Data(held_out, rest, band_Hz), given, fit.arm, fit.lag_s, floor);
  return fit;
}

double residual_Nm(const ArmDescription& arm, std::span<const ArmRecording> recordings, double band_Hz) {
  band_Hz = usable_band_Hz(recordings, band_Hz);
  const Data data(recordings, reversal_speeds_rad_per_s(recordings, band_Hz), band_Hz);
  const Eigen::VectorXd floor = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(arm.drives.size()));
  return residuals_of(data, arm, arm, 0, floor).given_Nm;
}

}  // namespace identification::robot_gap
