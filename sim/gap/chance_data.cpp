#include "sim/gap/chance_data.h"

#include <algorithm>
#include <utility>

namespace sim::gap {
namespace {

/// Long enough to hold what is correlated, short enough to be drawn often.
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
  std::uniform_int_distribution<Eigen::Index> start(0, residual_.size() - stretch_);
  for (Eigen::Index at = 0; at < result.size(); at += stretch_) {
    const Eigen::Index length = std::min(stretch_, result.size() - at);
    const double sign = random_() % 2 == 0 ? 1 : -1;
    result.segment(at, length) = sign * residual_.segment(start(random_), length);
  }
  return result;
}

}  // namespace sim::gap
