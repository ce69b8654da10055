#include "identification/robot_gap/judgement.h"

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
/// Filters, steps of sensors and slopes in place of curves leave this share of a change, beside what blocks
/// show. Of 95 %, on arms that DART simulates.
constexpr double kApproximation = 1e-3;

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

/// In the unit of the channel; of all channels, in noise floors.
double rms_where(const Eigen::VectorXd& residual, const View& view, std::size_t motion,
                 Eigen::Index channel) {
  double sum = 0;
  double count = 0;
  const RowPlan& plan = view.plan();
  for (std::size_t i = 0; i < plan.rows.size(); ++i) {
    if (plan.rows[i].motion != motion || (channel >= 0 && plan.rows[i].channel != channel)) continue;
    const double unit = channel >= 0 ? 1 : view.subject.noise_floor()[plan.rows[i].channel];
    const double one = residual[static_cast<Eigen::Index>(i)] / unit;
    sum += one * one;
    ++count;
  }
  return count > 0 ? std::sqrt(sum / count) : 0;
}

}  // namespace

Eigen::VectorXd residual_of(const View& view, const Fitted& fitted) {
  const ComparedRows rows = view.subject.compare(view.part, fitted, {});
  return rows.measured - rows.predicted;
}

double rms_of_channel(const Eigen::VectorXd& residual, const RowPlan& plan, Eigen::Index channel) {
  double sum = 0;
  double count = 0;
  for (std::size_t i = 0; i < plan.rows.size(); ++i) {
    if (plan.rows[i].channel != channel) continue;
    const double one = residual[static_cast<Eigen::Index>(i)];
    sum += one * one;
    ++count;
  }
  return count > 0 ? std::sqrt(sum / count) : 0;
}

std::vector<double> block_squares(const Eigen::VectorXd& residual, const View& view, Eigen::Index channel) {
  const RowPlan& plan = view.plan();
  std::vector<double> squares(static_cast<std::size_t>(plan.blocks()), 0);
  for (std::size_t i = 0; i < plan.rows.size(); ++i) {
    const Eigen::Index own = plan.rows[i].channel;
    if (channel >= 0 && own != channel) continue;
    const double one = residual[static_cast<Eigen::Index>(i)] / view.sigma[own];
    squares[static_cast<std::size_t>(plan.block[i])] += one * one;
  }
  return squares;
}

Harm worst_harm(const Eigen::VectorXd& before, const Eigen::VectorXd& after, const View& view,
                const std::vector<bool>& counts) {
  Harm worst;
  double worst_increase = 0;
  const std::vector<std::string>& motions = view.subject.motions(view.part);
  for (Eigen::Index channel = -1; channel < view.sigma.size(); ++channel) {
    if (channel >= 0 && !counts[static_cast<std::size_t>(channel)]) continue;
    const std::vector<double> all_before = block_squares(before, view, channel);
    const std::vector<double> all_after = block_squares(after, view, channel);
    for (std::size_t m = 0; m < motions.size(); ++m) {
      const std::vector<double> own_before = of_motion(all_before, view.plan(), m);
      const std::vector<double> own_after = of_motion(all_after, view.plan(), m);
      const double increase = total(own_after) - total(own_before);
      const double ratio = total(own_before) > 0 ? total(own_after) / total(own_before) : 1;
      const bool harmful = own_before.size() < kFewBlocks
                               ? ratio > kObvious
                               : ratio > kNoticeable && gap::decisiveness(own_after, own_before) > kHarmful;
      if (!harmful || increase <= worst_increase) continue;
      const double left = rms_where(after, view, m, channel);
      // What the sensors' noise leaves is no harm.
      if (left <= (channel < 0 ? 1 : view.subject.noise_floor()[channel])) continue;
      worst_increase = increase;
      worst = {true, motions[m], "noise floors", rms_where(before, view, m, channel), left};
      if (channel < 0) continue;
      const Channel& own = view.subject.channels()[static_cast<std::size_t>(channel)];
      worst.place += ", " + own.name;
      worst.unit = own.unit;
    }
  }
  return worst;
}

std::vector<std::vector<fit::Estimate>> intervals(const View& view, const Fitted& fitted,
                                                  const Chosen& chosen, std::uint64_t seed) {
  const Linearised rows(view, fitted, chosen);
  const gap::BlockRegression::Target target = rows.regression().target(rows.residual());
  const Eigen::Index columns = rows.columns().cols();
  const RowPlan& plan = view.plan();
  const auto blocks = static_cast<std::size_t>(plan.blocks());
  std::vector<Eigen::MatrixXd> gram(blocks, Eigen::MatrixXd::Zero(columns, columns));
  Eigen::Index first = 0;
  while (first < rows.columns().rows()) {
    Eigen::Index last = first;
    const int block = plan.block[static_cast<std::size_t>(first)];
    while (last < rows.columns().rows() && plan.block[static_cast<std::size_t>(last)] == block) ++last;
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
  for (const std::size_t candidate : chosen) {
    result.emplace_back();
    for (const std::size_t index : view.catalogue().candidates[candidate].terms) {
      const Term& term = view.catalogue().terms[index];
      const auto sample = draws.row(rows.column_of(index)).array();
      const double deviation = std::sqrt((sample - sample.mean()).square().sum() / (kResamples - 1));
      fit::Estimate estimate;
      estimate.name = term.name;
      estimate.value = term.given + fitted.changes[static_cast<Eigen::Index>(index)];
      const double half =
          std::hypot(t * deviation, kApproximation * fitted.changes[static_cast<Eigen::Index>(index)]);
      estimate.lower = estimate.value - half;
      estimate.upper = estimate.value + half;
      estimate.effect = view.catalogue().candidates[candidate].effect;
      result.back().push_back(std::move(estimate));
    }
  }
  return result;
}

}  // namespace identification::robot_gap
