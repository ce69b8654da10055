#include "identification/experiments/block_mean.h"

#include <cmath>
#include <limits>

namespace identification::experiments {

double student_t95(double degrees) noexcept {
  // Abramowitz & Stegun 26.7.5 with the normal quantile z.
  constexpr double kZ = 1.959963985;
  constexpr double kZ3 = kZ * kZ * kZ;
  constexpr double kZ5 = kZ3 * kZ * kZ;
  constexpr double kZ7 = kZ5 * kZ * kZ;
  const double n = 1 / degrees;
  return kZ + n * ((kZ3 + kZ) / 4 + n * ((5 * kZ5 + 16 * kZ3 + 3 * kZ) / 96 +
                                         n * (3 * kZ7 + 19 * kZ5 + 17 * kZ3 - 15 * kZ) / 384));
}

void BlockMean::add(double value) noexcept {
  block_sum_ += value;
  if (++in_block_ < samples_per_block_) return;
  const double block = block_sum_ / static_cast<double>(samples_per_block_);
  ++blocks_;
  const double off = block - mean_of_blocks_;
  mean_of_blocks_ += off / static_cast<double>(blocks_);
  squares_ += off * (block - mean_of_blocks_);
  block_sum_ = 0.0;
  in_block_ = 0;
}

double BlockMean::mean() const noexcept {
  const auto in_blocks = static_cast<double>(blocks_ * samples_per_block_);
  return (mean_of_blocks_ * in_blocks + block_sum_) / (in_blocks + static_cast<double>(in_block_));
}

double BlockMean::ci95() const noexcept {
  if (blocks_ < kFewestBlocks) return std::numeric_limits<double>::quiet_NaN();
  const auto count = static_cast<double>(blocks_);
  return student_t95(count - 1) * std::sqrt(squares_ / (count - 1) / count);
}

}  // namespace identification::experiments
