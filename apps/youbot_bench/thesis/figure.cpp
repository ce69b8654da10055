#include "apps/youbot_bench/thesis/figure.h"

#include <cmath>
#include <utility>

namespace youbot_bench::thesis {

double Comparison::difference_percent() const noexcept {
  constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();
  if (!std::isfinite(ours)) return kUnknown;
  if (ours >= printed->from && ours <= printed->to) return 0;
  const double nearest = ours < printed->from ? printed->from : printed->to;
  return nearest == 0 ? kUnknown : 100 * (ours - nearest) / std::abs(nearest);
}

bool Comparison::agrees() const noexcept {
  return std::abs(difference_percent()) <= printed->within_percent;  // false for NaN
}

Comparison compare(std::string_view key, double ours, std::string why) {
  return {&printed(key), ours, std::move(why)};
}

}  // namespace youbot_bench::thesis
