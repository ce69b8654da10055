#include "identification/robot_gap/arm_judgement.h"

#include <algorithm>
#include <cmath>
#include <random>
#include <span>

#include "identification/gap/block_comparison.h"

namespace identification::robot_gap {
namespace {

/// Standard errors by which a correction must be worse on a recording to be refuted: many recordings and
/// joints are compared.
constexpr double kHarmful = 3;
/// Increase of the squares below which harm does not count.
constexpr double kNoticeable = 1.1;
/// Fewer blocks have no reliable standard error: their squares must grow by kObvious.
constexpr std::size_t kFewBlocks = 5;
constexpr double kObvious = 1.5;
constexpr int kResamples = 200;

/// Blocks of one recording.
std::vector<double> of_motion(const std::vector<double>& squares, const RowPlan& plan, std::size_t motion) {
  std::vector<double> own;
  for (std::size_t b = 0; b < squares.size(); ++b)
    if (plan.block_motion[b] == motion) own.push_back(squares[b]);
  return own;
}

double total(const std::vector<double>& values) {
  double sum = 0;
  for (const double value : values) sum += value;
  return sum;
}

double rms_where(const Eigen::VectorXd& residual_Nm, const RowPlan& plan, std::size_t motion,
                 Eigen::Index joint) {
  double sum = 0;
  double count = 0;
  for (std::size_t i = 0; i < plan.rows.size(); ++i) {
    if (plan.rows[i].motion != motion || (joint >= 0 && plan.rows[i].joint != joint)) continue;
    const double one = residual_Nm[static_cast<Eigen::Index>(i)];
    sum += one * one;
    ++count;
  }
  return count > 0 ? std::sqrt(sum / count) : 0;
}

}  // namespace

Eigen::VectorXd residual_Nm(const FittedArm& fitted, const ArmData& data) {
  const std::vector<Term> lag{{Term::Kind::kLag}};
  const ComparedRows rows = compare(fitted.arm, data.motions, data.plan, lag);
  return rows.measured_Nm - rows.predicted_Nm - fitted.lag_s * rows.columns.col(0);
}

double rms_Nm(const Eigen::VectorXd& residual_Nm) {
  return residual_Nm.size() == 0
             ? 0
             : std::sqrt(residual_Nm.squaredNorm() / static_cast<double>(residual_Nm.size()));
}

double rms_of_joint_Nm(const Eigen::VectorXd& residual_Nm, const ArmData& data, Eigen::Index joint) {
  double sum = 0;
  double count = 0;
  for (std::size_t i = 0; i < data.plan.rows.size(); ++i) {
    if (data.plan.rows[i].joint != joint) continue;
    const double one = residual_Nm[static_cast<Eigen::Index>(i)];
    sum += one * one;
    ++count;
  }
  return count > 0 ? std::sqrt(sum / count) : 0;
}

std::vector<double> block_squares(const Eigen::VectorXd& residual_Nm, const ArmData& data,
                                  Eigen::Index joint) {
  std::vector<double> squares(static_cast<std::size_t>(data.plan.blocks()), 0);
  for (std::size_t i = 0; i < data.plan.rows.size(); ++i) {
    const Eigen::Index own = data.plan.rows[i].joint;
    if (joint >= 0 && own != joint) continue;
    const double one = residual_Nm[static_cast<Eigen::Index>(i)] / data.sigma_Nm[own];
    squares[static_cast<std::size_t>(data.plan.block[i])] += one * one;
  }
  return squares;
}

Harm worst_harm(const Eigen::VectorXd& before_Nm, const Eigen::VectorXd& after_Nm, const ArmData& data,
                const control::ArmDescription& arm) {
  Harm worst;
  double worst_increase = 0;
  for (Eigen::Index joint = -1; joint < data.sigma_Nm.size(); ++joint) {
    const std::vector<double> all_before = block_squares(before_Nm, data, joint);
    const std::vector<double> all_after = block_squares(after_Nm, data, joint);
    for (std::size_t m = 0; m < data.motions.size(); ++m) {
      const std::vector<double> before = of_motion(all_before, data.plan, m);
      const std::vector<double> after = of_motion(all_after, data.plan, m);
      const double increase = total(after) - total(before);
      const double ratio = total(before) > 0 ? total(after) / total(before) : 1;
      const bool harmful = before.size() < kFewBlocks
                               ? ratio > kObvious
                               : ratio > kNoticeable && gap::decisiveness(after, before) > kHarmful;
      if (!harmful || increase <= worst_increase) continue;
      worst_increase = increase;
      worst = {true, data.motions[m].name,
               joint < 0 ? "" : arm.arm.links[static_cast<std::size_t>(joint)].joint,
               rms_where(before_Nm, data.plan, m, joint), rms_where(after_Nm, data.plan, m, joint)};
    }
  }
  return worst;
}

std::vector<std::vector<fit::Estimate>> intervals(const control::ArmDescription& given,
                                                  const FittedArm& fitted, const ArmData& data,
                                                  const Catalogue& catalogue, const Chosen& chosen,
                                                  std::uint64_t seed) {
  const Catalogue own = only(catalogue, chosen);
  Chosen all;
  for (std::size_t i = 0; i < own.candidates.size(); ++i) all.push_back(i);
  const Linearised rows(given, fitted.arm, all, data, own);
  const gap::BlockRegression::Target target = rows.regression().target(rows.residual());
  const Eigen::Index columns = rows.columns().cols();
  const auto blocks = static_cast<std::size_t>(data.plan.blocks());
  std::vector<Eigen::MatrixXd> gram(blocks, Eigen::MatrixXd::Zero(columns, columns));
  Eigen::Index first = 0;
  while (first < rows.columns().rows()) {
    Eigen::Index last = first;
    const int block = data.plan.block[static_cast<std::size_t>(first)];
    while (last < rows.columns().rows() && data.plan.block[static_cast<std::size_t>(last)] == block) ++last;
    const auto part = rows.columns().middleRows(first, last - first);
    gram[static_cast<std::size_t>(block)].noalias() = part.transpose() * part;
    first = last;
  }
  std::mt19937_64 random(seed);
  const std::vector<gap::Bounds> free(static_cast<std::size_t>(columns));
  Eigen::MatrixXd draws(columns, kResamples);
  for (int draw = 0; draw < kResamples; ++draw) {
    Eigen::MatrixXd g = Eigen::MatrixXd::Zero(columns, columns);
    Eigen::VectorXd p = Eigen::VectorXd::Zero(columns);
    for (std::size_t taken = 0; taken < blocks; ++taken) {
      const std::size_t b = random() % blocks;
      g += gram[b];
      p += target.product[b];
    }
    draws.col(draw) = gap::bounded_solution(g, p, free);
  }
  const double degrees = std::max(1.0, static_cast<double>(blocks) - static_cast<double>(columns));
  const double t = fit::student_975(degrees);
  std::vector<std::vector<fit::Estimate>> result;
  for (const Candidate& candidate : own.candidates) {
    result.emplace_back();
    for (const std::size_t column : candidate.terms) {
      const Term& term = own.terms[column];
      const auto sample = draws.row(static_cast<Eigen::Index>(column)).array();
      const double deviation = std::sqrt((sample - sample.mean()).square().sum() / (kResamples - 1));
      fit::Estimate estimate;
      estimate.name = reported_name(term, given);
      estimate.value = reported_value(term, given, fitted.arm);
      estimate.lower = estimate.value - t * deviation;
      estimate.upper = estimate.value + t * deviation;
      estimate.effect = candidate.effect;
      result.back().push_back(std::move(estimate));
    }
  }
  return result;
}

}  // namespace identification::robot_gap
