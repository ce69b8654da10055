#include "identification/gap/chance_data.h"

#include <algorithm>
#include <utility>

namespace identification::gap {
namespace {

/// Long enough to contain the correlation, short enough for many draws.
Eigen::Index stretch_length(const Eigen::VectorXd& residual) {
  const Eigen::Index n = residual.size();
  const double power = residual.squaredNorm();
  Eigen::Index lag = 1;
  while (lag < n / 40 && residual.head(n - lag).dot(residual.tail(n - lag)) > 0.1 * power) ++lag;
  const Eigen::Index longest = std::max<Eigen::Index>(1, n / 10);
  return std::clamp(4 * lag, std::min<Eigen::Index>(25, longest), longest);
}

}  // namespace

ChanceData::ChanceData(Eigen::VectorXd residual, std::uint64_t seed)
    : residual_(std::move(residual)), random_(seed), stretch_(stretch_length(residual_)) {}

Eigen::VectorXd ChanceData::draw() {
  Eigen::VectorXd result(residual_.size());
  const Eigen::Index n = residual_.size();
  std::uniform_int_distribution<Eigen::Index> start(0, n - 1);
  for (Eigen::Index at = 0; at < n; at += stretch_) {
    const Eigen::Index from = start(random_);
    const double sign = random_() % 2 == 0 ? 1 : -1;
    // The end continues at the beginning; otherwise the ends would be drawn less often.
    for (Eigen::Index i = 0; i < std::min(stretch_, n - at); ++i)
      result[at + i] = sign * residual_[(from + i) % n];
  }
  return result;
}

}  // namespace identification::gap
