#include "identification/gap/shrink.h"

#include <algorithm>
#include <cmath>
#include <random>

namespace identification::gap {
namespace {

constexpr std::size_t kBlocksOfRecording = 20;
constexpr std::size_t kMinRowsOfBlock = 5;
constexpr int kResamples = 1000;

struct Squares {
  double before = 0;
  double after = 0;
};

/// Sums of squares per block, by recording.
std::vector<std::vector<Squares>> blocks_of(const HeldOutRows& rows) {
  std::vector<std::vector<Squares>> recordings;
  const std::size_t count = rows.recording.size();
  for (std::size_t from = 0; from < count;) {
    std::size_t to = from;
    while (to < count && rows.recording[to] == rows.recording[from]) ++to;
    const std::size_t length = to - from;
    const std::size_t blocks = std::clamp<std::size_t>(length / kMinRowsOfBlock, 1, kBlocksOfRecording);
    std::vector<Squares>& own = recordings.emplace_back(blocks);
    for (std::size_t i = from; i < to; ++i) {
      Squares& block = own[(i - from) * blocks / length];
      const auto row = static_cast<Eigen::Index>(i);
      block.before += rows.before_Nm[row] * rows.before_Nm[row];
      block.after += rows.after_Nm[row] * rows.after_Nm[row];
    }
    from = to;
  }
  return recordings;
}

double share_of(const Squares& sum) { return sum.before > 0 ? 1 - std::sqrt(sum.after / sum.before) : 0; }

double standard_deviation(const Eigen::VectorXd& values) {
  return std::sqrt((values.array() - values.mean()).square().mean());
}
double rms(const Eigen::VectorXd& values) {
  return std::sqrt(values.squaredNorm() / static_cast<double>(values.size()));
}

RecordingGap gap_of(const HeldOutRows& rows, const std::vector<Eigen::Index>& use) {
  const Eigen::VectorXd torque = rows.torque_Nm(use);
  const Eigen::VectorXd before = rows.before_Nm(use);
  const Eigen::VectorXd after = rows.after_Nm(use);
  const double spread = standard_deviation(torque);
  const auto nrmse = [&](const Eigen::VectorXd& left) { return spread > 0 ? rms(left) / spread : 0; };
  const auto vaf = [&](const Eigen::VectorXd& left) {
    return spread > 0 ? 1 - std::pow(standard_deviation(left) / spread, 2) : 0;
  };
  return {.recording = {},
          .before_Nm = rms(before),
          .after_Nm = rms(after),
          .nrmse_before = nrmse(before),
          .nrmse_after = nrmse(after),
          .vaf_before = vaf(before),
          .vaf_after = vaf(after)};
}

}  // namespace

Shrink shrink_of(const HeldOutRows& rows, std::uint64_t seed) {
  const std::vector<std::vector<Squares>> recordings = blocks_of(rows);
  if (recordings.empty()) return {};
  std::mt19937_64 random(seed);
  const auto any_of = [&random](const auto& list) -> const auto& {
    return list[std::uniform_int_distribution<std::size_t>(0, list.size() - 1)(random)];
  };
  std::vector<double> shares;
  for (int n = 0; n < kResamples; ++n) {
    Squares sum;
    for (std::size_t r = 0; r < recordings.size(); ++r) {
      const std::vector<Squares>& blocks = any_of(recordings);
      for (std::size_t b = 0; b < blocks.size(); ++b) {
        const Squares& block = any_of(blocks);
        sum.before += block.before;
        sum.after += block.after;
      }
    }
    shares.push_back(share_of(sum));
  }
  std::ranges::sort(shares);
  Squares all;
  for (const std::vector<Squares>& blocks : recordings) {
    for (const Squares& block : blocks) {
      all.before += block.before;
      all.after += block.after;
    }
  }
  return {.share = share_of(all),
          .lower = shares[shares.size() / 40],
          .upper = shares[shares.size() - 1 - shares.size() / 40]};
}

std::vector<RecordingGap> recording_gaps(const HeldOutRows& rows, const std::vector<std::string>& names) {
  std::vector<std::vector<Eigen::Index>> rows_of(names.size());
  std::vector<Eigen::Index> all;
  for (std::size_t i = 0; i < rows.recording.size(); ++i) {
    rows_of[rows.recording[i]].push_back(static_cast<Eigen::Index>(i));
    all.push_back(static_cast<Eigen::Index>(i));
  }
  std::vector<RecordingGap> gaps;
  for (std::size_t r = 0; r < names.size(); ++r) {
    if (rows_of[r].empty()) continue;
    gaps.push_back(gap_of(rows, rows_of[r]));
    gaps.back().recording = names[r];
  }
  if (!all.empty()) gaps.push_back(gap_of(rows, all));
  return gaps;
}

}  // namespace identification::gap
