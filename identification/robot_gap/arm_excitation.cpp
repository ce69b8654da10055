#include "identification/robot_gap/arm_excitation.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <memory>
#include <optional>
#include <random>
#include <span>
#include <stdexcept>
#include <utility>

#include "identification/gap/parallel.h"
#include "identification/robot_gap/arm_motion.h"
#include "identification/robot_gap/arm_parameters.h"
#include "identification/robot_gap/arm_rows.h"
#include "identification/robot_gap/arm_terms.h"

namespace identification::robot_gap {
namespace {

using control::ArmDescription;
using experiments::FourierMotion;

/// Samples of a planned motion in a period of its highest harmonic.
constexpr double kSamplesPerHarmonic = 20;
/// The band of the comparison, in highest harmonics.
constexpr double kBandOfHarmonics = 4;
/// Of a joint's friction at 1 rad/s: what models miss of torques; and at least so much [N·m].
constexpr double kMissedShare = 0.1;
constexpr double kMissed_Nm = 0.02;
/// Share of the range, around its middle, in which centres lie.
constexpr double kCentres = 0.8;
/// Tries that are made before their best is kept.
constexpr std::size_t kBatch = 16;
/// Largest change of a try by an improvement, in its own size; smaller ones are tried, too.
constexpr double kLargestChange = 0.5;
/// Between checked poses on the way from one motion to the next.
constexpr double kPoseGrid_rad = 0.05;

ArmMotion sampled(const FourierMotion& motion) {
  const double top_Hz = static_cast<double>(motion.sine_rad.cols()) / motion.period_s;
  ArmMotion result;
  result.period_s = 1 / (kSamplesPerHarmonic * top_Hz);
  result.band_Hz = kBandOfHarmonics * top_Hz;
  const auto samples = static_cast<Eigen::Index>(motion.duration_s / result.period_s);
  for (Eigen::MatrixXd* matrix :
       {&result.position_rad, &result.velocity_rad_per_s, &result.acceleration_rad_per_s2})
    matrix->resize(motion.joints(), samples);
  for (Eigen::Index j = 0; j < motion.joints(); ++j)
    for (Eigen::Index i = 0; i < samples; ++i) {
      const FourierMotion::State state = motion.at(j, static_cast<double>(i) * result.period_s);
      result.position_rad(j, i) = state.position_rad;
      result.velocity_rad_per_s(j, i) = state.velocity_rad_per_s;
      result.acceleration_rad_per_s2(j, i) = state.acceleration_rad_per_s2;
    }
  result.torque_Nm = Eigen::MatrixXd::Zero(motion.joints(), samples);
  return result;
}

Eigen::VectorXd missed_Nm(const ArmDescription& arm) {
  Eigen::VectorXd sigma(static_cast<Eigen::Index>(arm.drives.size()));
  for (std::size_t j = 0; j < arm.drives.size(); ++j)
    sigma[static_cast<Eigen::Index>(j)] =
        kMissed_Nm + kMissedShare * (arm.drives[j].coulomb_Nm + arm.drives[j].viscous_Nm_s_per_rad);
  return sigma;
}

/// Rows of one motion, in units of the torques' deviations and of the parameters'.
struct WeighedRows {
  Eigen::VectorXd predicted;
  Eigen::MatrixXd columns;
};
WeighedRows weighed_rows(const ArmDescription& arm, const ArmMotion& motion,
                         std::span<const ArmParameter> parameters, const Eigen::VectorXd& missed_Nm) {
  const std::vector<double> rest(arm.drives.size(), 1e-3);
  const std::span<const ArmMotion> one(&motion, 1);
  const RowPlan plan = plan_rows(one, rest, motion.period_s * static_cast<double>(motion.samples()));
  std::vector<ArmTerm> terms;
  for (const ArmParameter& parameter : parameters) terms.push_back(parameter.term);
  ComparedRows rows = compare(arm, one, plan, terms);
  for (Eigen::Index row = 0; row < rows.predicted.size(); ++row) {
    const double weight = 1 / missed_Nm[plan.rows[static_cast<std::size_t>(row)].channel];
    rows.predicted[row] *= weight;
    rows.columns.row(row) *= weight;
  }
  for (std::size_t k = 0; k < parameters.size(); ++k)
    rows.columns.col(static_cast<Eigen::Index>(k)) *= parameters[k].sigma;
  return {std::move(rows.predicted), std::move(rows.columns)};
}

/// What motions are worth together. Functions are thread-safe but for add().
class Purpose {
 public:
  Purpose() = default;
  Purpose(const Purpose&) = delete;
  Purpose& operator=(const Purpose&) = delete;
  virtual ~Purpose() = default;
  virtual double with(const ArmMotion& motion) const = 0;
  virtual void add(const ArmMotion& motion) = 0;
};

class Information final : public Purpose {
 public:
  explicit Information(const ArmDescription& arm)
      : arm_(arm), parameters_(arm_parameters(arm)), missed_Nm_(missed_Nm(arm)) {
    const auto count = static_cast<Eigen::Index>(parameters_.size());
    information_.setIdentity(count, count);
  }
  double with(const ArmMotion& motion) const override {
    const Eigen::LLT<Eigen::MatrixXd> root(information_ + of(motion));
    return 2 * root.matrixLLT().diagonal().array().log().sum();
  }
  void add(const ArmMotion& motion) override { information_ += of(motion); }

 private:
  Eigen::MatrixXd of(const ArmMotion& motion) const {
    const Eigen::MatrixXd columns = weighed_rows(arm_, motion, parameters_, missed_Nm_).columns;
    return columns.transpose() * columns;
  }

  const ArmDescription& arm_;
  std::vector<ArmParameter> parameters_;
  Eigen::VectorXd missed_Nm_;
  Eigen::MatrixXd information_;
};

/// Parameters of this arm that are not as given, each free by as much as it differs.
std::vector<ArmParameter> own_parameters(const ArmDescription& given, const ArmDescription& arm) {
  const std::vector<double> top_speed(arm.drives.size(), 1.0);
  std::vector<double> ripples;
  for (const control::ArmDrive& drive : arm.drives)
    for (const control::ArmDrive::Ripple& ripple : drive.ripples) ripples.push_back(ripple.periods_per_rev);
  std::vector<ArmParameter> own;
  for (const ArmTerm& term : arm_catalogue(arm, top_speed, ripples).terms) {
    if (term.kind == ArmTerm::Kind::kLinkDensity || term.kind == ArmTerm::Kind::kTilt) continue;
    if (const double change = value_of(term, arm) - value_of(term, given); change != 0)
      own.push_back({term, std::abs(change)});
  }
  return own;
}

class Separation final : public Purpose {
 public:
  Separation(const ArmDescription& given, const ArmDescription& one, const ArmDescription& other)
      : missed_Nm_(missed_Nm(given)) {
    sides_[0] = {one, own_parameters(given, one), {}};
    sides_[1] = {other, own_parameters(given, other), {}};
  }
  double with(const ArmMotion& motion) const override {
    const auto squares = squares_with(motion);
    return std::min(left(squares[0]), left(squares[1]));
  }
  void add(const ArmMotion& motion) override {
    const auto squares = squares_with(motion);
    for (std::size_t i = 0; i < 2; ++i) sides_[i].squares = squares[i];
  }

 private:
  /// Of the difference of the two models, and of the columns of the one that is fitted to it.
  struct Squares {
    Eigen::MatrixXd columns;
    Eigen::VectorXd product;
    double difference = 0;
  };
  struct Side {
    ArmDescription arm;
    std::vector<ArmParameter> own;
    Squares squares;
  };

  std::array<Squares, 2> squares_with(const ArmMotion& motion) const {
    const std::array rows{weighed_rows(sides_[0].arm, motion, sides_[0].own, missed_Nm_),
                          weighed_rows(sides_[1].arm, motion, sides_[1].own, missed_Nm_)};
    const Eigen::VectorXd difference = rows[0].predicted - rows[1].predicted;
    std::array<Squares, 2> result;
    for (std::size_t i = 0; i < 2; ++i) {
      result[i] = {rows[i].columns.transpose() * rows[i].columns, rows[i].columns.transpose() * difference,
                   difference.squaredNorm()};
      if (sides_[i].squares.columns.size() == 0) continue;
      result[i].columns += sides_[i].squares.columns;
      result[i].product += sides_[i].squares.product;
      result[i].difference += sides_[i].squares.difference;
    }
    return result;
  }
  static double left(const Squares& squares) {
    const Eigen::Index count = squares.columns.rows();
    if (count == 0) return squares.difference;
    // Directions without information need a little of their own.
    const Eigen::MatrixXd unit = Eigen::MatrixXd::Identity(count, count);
    const Eigen::LDLT<Eigen::MatrixXd> solver(squares.columns + 1e-9 * (1 + squares.columns.trace()) * unit);
    return std::max(0.0, squares.difference - squares.product.dot(solver.solve(squares.product)));
  }

  Eigen::VectorXd missed_Nm_;
  std::array<Side, 2> sides_;
};

class Planner {
 public:
  Planner(std::span<const ArmDescription* const> arms, const ExcitationLimits& limits,
          const ExcitationOptions& options)
      : arms_(arms.begin(), arms.end()), limits_(limits), options_(options), random_(options.seed) {}

  ExcitationPlan plan(Purpose& purpose) {
    ExcitationPlan plan;
    Eigen::VectorXd from = limits_.ready_rad;
    for (int number = 0; number < options_.motions; ++number) {
      const Tried best = best_motion(purpose, from, number + 1 == options_.motions);
      if (!best.motion)
        throw std::invalid_argument("no motion keeps the limits of the arm in " +
                                    std::to_string(options_.tries) +
                                    " tries: allow a wider range, or more torque");
      purpose.add(sampled(*best.motion));
      from = best.motion->centre_rad;
      plan.motions.push_back(*best.motion);
      plan.worth.push_back(best.worth);
    }
    plan.refused = refused_;
    return plan;
  }

 private:
  struct Tried {
    std::optional<FourierMotion> motion;  // none: beyond a limit
    double worth = 0;
  };

  /// Half of the tries are at random; the others change the best so far, less and less.
  Tried best_motion(const Purpose& purpose, const Eigen::VectorXd& from, bool is_last) {
    Tried best;
    const auto tries = static_cast<std::size_t>(options_.tries);
    for (std::size_t made = 0; made < tries; made += kBatch) {
      std::vector<FourierMotion> motions;
      for (std::size_t i = 0; i < std::min(kBatch, tries - made); ++i) {
        const double left = 2 * (1 - static_cast<double>(made + i) / static_cast<double>(tries));
        motions.push_back(left < 1 && best.motion ? changed(*best.motion, kLargestChange * left)
                                                  : at_random());
      }
      std::vector<Tried> tried(motions.size());
      gap::in_parallel(motions.size(), [&](std::size_t i) {
        if (std::optional<FourierMotion> kept = within_limits(motions[i], from, is_last))
          tried[i] = {kept, purpose.with(sampled(*kept))};
      });
      for (Tried& one : tried) {
        if (!one.motion)
          ++refused_;
        else if (!best.motion || one.worth > best.worth)
          best = std::move(one);
      }
    }
    return best;
  }

  double uniform() { return std::uniform_real_distribution<double>(-1, 1)(random_); }
  double normal() { return std::normal_distribution<double>()(random_); }

  FourierMotion at_random() {
    FourierMotion motion{options_.period_s, options_.motion_s, options_.ramp_s};
    const experiments::MotionLimits& given = limits_.motion;
    const Eigen::Index joints = given.lower_rad.size();
    motion.centre_rad = (given.lower_rad + given.upper_rad) / 2;
    motion.sine_rad.resize(joints, options_.harmonics);
    motion.cosine_rad.resize(joints, options_.harmonics);
    for (Eigen::Index j = 0; j < joints; ++j) {
      motion.centre_rad[j] += kCentres * uniform() * (given.upper_rad[j] - given.lower_rad[j]) / 2;
      for (Eigen::Index k = 0; k < options_.harmonics; ++k) {
        motion.sine_rad(j, k) = normal() / static_cast<double>(k + 1);
        motion.cosine_rad(j, k) = normal() / static_cast<double>(k + 1);
      }
    }
    return motion;
  }

  FourierMotion changed(FourierMotion motion, double by) {
    const experiments::MotionLimits& given = limits_.motion;
    for (Eigen::Index j = 0; j < motion.joints(); ++j) {
      const double half = (given.upper_rad[j] - given.lower_rad[j]) / 2;
      motion.centre_rad[j] =
          std::clamp(motion.centre_rad[j] + by * half * uniform() / 2,
                     given.lower_rad[j] + (1 - kCentres) * half, given.upper_rad[j] - (1 - kCentres) * half);
      const double size = motion.sine_rad.row(j).norm() + motion.cosine_rad.row(j).norm();
      for (Eigen::Index k = 0; k < motion.sine_rad.cols(); ++k) {
        motion.sine_rad(j, k) += by * size * normal() / static_cast<double>(k + 1);
        motion.cosine_rad(j, k) += by * size * normal() / static_cast<double>(k + 1);
      }
    }
    return motion;
  }

  std::optional<FourierMotion> within_limits(const FourierMotion& wanted, const Eigen::VectorXd& from,
                                             bool is_last) const {
    if (!is_clear_between(from, wanted.centre_rad)) return {};
    if (is_last && !is_clear_between(wanted.centre_rad, limits_.ready_rad)) return {};
    FourierMotion motion = filling(wanted, limits_.motion);
    ArmMotion samples = sampled(motion);
    for (Eigen::Index i = 0; i < samples.position_rad.cols(); ++i)
      if (!limits_.is_clear(samples.position_rad.col(i))) return {};
    for (const ArmDescription* arm : arms_) {
      const Eigen::MatrixXd torque_Nm = predicted_torque_Nm(*arm, samples);
      for (Eigen::Index j = 0; j < torque_Nm.rows(); ++j)
        if (!(torque_Nm.row(j).cwiseAbs().maxCoeff() <= limits_.torque_Nm[j])) return {};
    }
    return motion;
  }

  bool is_clear_between(const Eigen::VectorXd& from, const Eigen::VectorXd& to) const {
    const double longest = (to - from).cwiseAbs().maxCoeff();
    const int steps = 1 + static_cast<int>(longest / kPoseGrid_rad);
    for (int i = 0; i <= steps; ++i)
      if (!limits_.is_clear(from + (to - from) * i / steps)) return false;
    return true;
  }

  std::vector<const ArmDescription*> arms_;
  const ExcitationLimits& limits_;
  const ExcitationOptions& options_;
  std::mt19937_64 random_;
  int refused_ = 0;
};

}  // namespace

ExcitationPlan plan_for_information(const ArmDescription& arm, const ExcitationLimits& limits,
                                    const ExcitationOptions& options) {
  Information information(arm);
  return Planner(std::array{&arm}, limits, options).plan(information);
}

ExcitationPlan plan_for_separation(const ArmDescription& given, const ArmDescription& one,
                                   const ArmDescription& other, const ExcitationLimits& limits,
                                   const ExcitationOptions& options) {
  Separation separation(given, one, other);
  ExcitationPlan plan = Planner(std::array{&one, &other}, limits, options).plan(separation);
  if (!(plan.worth.back() > 0))
    throw std::invalid_argument("the two models predict the same torques: there is nothing to separate");
  return plan;
}

}  // namespace identification::robot_gap
