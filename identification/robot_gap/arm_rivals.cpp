#include "identification/robot_gap/arm_rivals.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <random>

#include "identification/gap/noise_draws.h"

namespace identification::robot_gap {
namespace {

/// Candidates with this share of the chosen one's gain are fitted, the best of them.
constexpr double kNearGain = 0.8;
constexpr std::size_t kMostRivals = 8;
/// Draws that a rival must win: one of twenty happens to effects that are clearly worse.
constexpr int kLeastWins = 2;
constexpr int kPoses = 2000;
constexpr int kPoseBins = 6;
/// Difference in units of sigma that shows in a single row.
constexpr double kShows = 1;

/// Whether `outer` has all terms of `inner`.
bool contains(const Catalogue& catalogue, std::size_t outer, std::size_t inner) {
  const std::vector<std::size_t>& terms = catalogue.candidates[outer].terms;
  return std::ranges::all_of(catalogue.candidates[inner].terms,
                             [&](std::size_t term) { return std::ranges::find(terms, term) != terms.end(); });
}

struct Range {
  double lower = 0;
  double upper = 0;
};
Range range_of(std::span<const ArmMotion> motions, Eigen::Index joint) {
  Range range{motions.front().position_rad(joint, 0), motions.front().position_rad(joint, 0)};
  for (const ArmMotion& motion : motions) {
    range.lower = std::min(range.lower, motion.position_rad.row(joint).minCoeff());
    range.upper = std::max(range.upper, motion.position_rad.row(joint).maxCoeff());
  }
  return range;
}

double rms_row(std::span<const ArmMotion> motions, Eigen::Index joint, Eigen::MatrixXd ArmMotion::*quantity) {
  double sum = 0;
  double count = 0;
  for (const ArmMotion& motion : motions) {
    sum += (motion.*quantity).row(joint).squaredNorm();
    count += static_cast<double>((motion.*quantity).cols());
  }
  return std::sqrt(sum / std::max(1.0, count));
}

/// Random states as if they were a motion.
ArmMotion random_states(const ArmData& data, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> uniform(-1, 1);
  const Eigen::Index joints = data.sigma_Nm.size();
  ArmMotion states;
  states.period_s = 1;
  states.position_rad.resize(joints, kPoses);
  states.velocity_rad_per_s.resize(joints, kPoses);
  states.acceleration_rad_per_s2.resize(joints, kPoses);
  states.torque_Nm = Eigen::MatrixXd::Zero(joints, kPoses);
  for (Eigen::Index j = 0; j < joints; ++j) {
    const Range range = range_of(data.motions, j);
    const double centre = 0.5 * (range.lower + range.upper);
    const double half = range.upper - range.lower;  // half of it beyond either end
    const double v = rms_row(data.motions, j, &ArmMotion::velocity_rad_per_s);
    const double a = rms_row(data.motions, j, &ArmMotion::acceleration_rad_per_s2);
    for (Eigen::Index i = 0; i < kPoses; ++i) {
      states.position_rad(j, i) = centre + half * uniform(random);
      states.velocity_rad_per_s(j, i) = std::sqrt(3.0) * v * uniform(random);
      // The sign of a velocity is averaged over the period: none of it reverses.
      states.acceleration_rad_per_s2(j, i) = std::sqrt(3.0) * a * uniform(random);
    }
  }
  states.period_s = 1e-9;
  return states;
}

}  // namespace

ArmRivals rivals_of(const control::ArmDescription& given, const ArmData& data, const Linearised& rows,
                    const Catalogue& catalogue, const Chosen& chosen, std::size_t place,
                    std::span<const std::size_t> banned, std::uint64_t seed) {
  Chosen rest = chosen;
  rest.erase(rest.begin() + static_cast<std::ptrdiff_t>(place));
  const std::size_t own = chosen[place];
  const double before = rows.left_out(rest);
  const double gain = before - rows.left_out(chosen);
  struct Tried {
    std::size_t candidate = 0;
    double left = 0;
  };
  std::vector<Tried> tried;
  for (std::size_t c = 0; c < catalogue.candidates.size(); ++c) {
    const auto same = [&](std::size_t other) {
      return catalogue.candidates[c].same_effect(catalogue.candidates[other]);
    };
    if (std::ranges::any_of(chosen, same) || std::ranges::any_of(banned, same) || contains(catalogue, c, own))
      continue;
    Chosen with = rest;
    with.push_back(c);
    if (const double left = rows.left_out(with); before - left >= kNearGain * gain)
      tried.push_back({c, left});
  }
  std::ranges::stable_sort(tried, {}, &Tried::left);
  if (tried.size() > kMostRivals) tried.resize(kMostRivals);
  std::vector<std::size_t> others;
  std::vector<std::vector<double>> squares{rows.fit(chosen).held_out_of};
  for (const Tried& one : tried) {
    Chosen with = rest;
    with.push_back(one.candidate);
    others.push_back(one.candidate);
    squares.push_back(left_out_squares(given, data, catalogue, with));
  }
  const std::vector<int> wins = gap::draws_won(squares, seed);
  ArmRivals result;
  result.own_wins = wins.front();
  for (std::size_t i = 0; i < others.size(); ++i) {
    if (wins[i + 1] < kLeastWins) continue;
    // The best variant of each.
    const auto known = std::ranges::find_if(result.rivals, [&](const ArmRival& rival) {
      return catalogue.candidates[rival.candidate].same_effect(catalogue.candidates[others[i]]);
    });
    if (known == result.rivals.end())
      result.rivals.push_back({others[i], wins[i + 1]});
    else
      known->wins += wins[i + 1];
  }
  std::ranges::stable_sort(result.rivals, std::ranges::greater{}, &ArmRival::wins);
  return result;
}

std::string deciding_pose(const control::ArmDescription& one, const control::ArmDescription& other,
                          const ArmData& data, std::uint64_t seed) {
  const ArmMotion states = random_states(data, seed);
  const Eigen::MatrixXd difference = data.sigma_Nm.cwiseInverse().asDiagonal() *
                                     (predicted_torque_Nm(one, states) - predicted_torque_Nm(other, states));
  const Eigen::VectorXd squares = difference.colwise().squaredNorm().transpose();
  double most = -1;
  Eigen::Index best_joint = 0;
  Range best;
  for (Eigen::Index j = 0; j < difference.rows(); ++j) {
    const Range seen = range_of(data.motions, j);
    const double width = 2 * (seen.upper - seen.lower) / kPoseBins;
    const double from = seen.lower - (seen.upper - seen.lower) / 2;
    std::array<double, kPoseBins> sum{};
    std::array<double, kPoseBins> count{};
    for (Eigen::Index i = 0; i < kPoses; ++i) {
      const auto bin = static_cast<std::size_t>(
          std::clamp((states.position_rad(j, i) - from) / width, 0.0, kPoseBins - 1.0));
      sum[bin] += squares[i];
      ++count[bin];
    }
    for (std::size_t b = 0; b < kPoseBins; ++b) {
      const double mean = count[b] > 0 ? sum[b] / count[b] : 0;
      if (mean <= most) continue;
      most = mean;
      best_joint = j;
      best = {from + static_cast<double>(b) * width, from + static_cast<double>(b + 1) * width};
    }
  }
  const double sigmas = std::sqrt(std::max(0.0, most));
  if (sigmas < kShows)
    return "none: in no pose of twice the range that was driven do the two differ by more than the noise";
  Eigen::Index seen_at = 0;
  difference.cwiseAbs().rowwise().mean().maxCoeff(&seen_at);
  std::array<char, 300> text{};
  std::snprintf(text.data(), text.size(),
                "move %s between %.2f and %.2f rad, the others as before: the two models then differ by %.1f "
                "standard deviations of a row, most of it in the torque of %s",
                one.arm.links[static_cast<std::size_t>(best_joint)].joint.c_str(), best.lower, best.upper,
                sigmas, one.arm.links[static_cast<std::size_t>(seen_at)].joint.c_str());
  return text.data();
}

}  // namespace identification::robot_gap
