#include "identification/robot_gap/torque_lag.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numeric>

#include "identification/gap/block_comparison.h"
#include "identification/gap/parallel.h"
#include "identification/robot_gap/least_near.h"

namespace identification::robot_gap {
namespace {

constexpr double kCoarseLag_s = 0.02;
/// Neighbours of the best lag that must leave significantly more.
constexpr double kNeighbour_s = 0.01;
/// Standard errors by which another lag must leave more.
constexpr double kLeavesMore = 2;

using SquaresByLag = std::vector<double> LeftByLag::*;

double sum_over_stretches(const std::vector<double>& squares) {
  return std::accumulate(squares.begin(), squares.end(), 0.0);
}

class LagSearch {
 public:
  LagSearch(const std::function<LeftByLag(double)>& left_at, double longest_s)
      : left_at_(left_at),
        longest_s_(longest_s),
        reach_(static_cast<int>(std::floor(longest_s / kCoarseLag_s + 1e-9))),
        coarse_(static_cast<std::size_t>(2 * reach_ + 1)) {
    gap::in_parallel(coarse_.size(), [&](std::size_t i) { coarse_[i] = left_at_(coarse_lag_s(i)); });
  }

  TorqueLag found() const {
    std::size_t start = 0;
    for (std::size_t i = 1; i < coarse_.size(); ++i)
      if (sum_over_stretches(coarse_[i].by_all) < sum_over_stretches(coarse_[start].by_all)) start = i;
    TorqueLag result;
    result.lag_s = refined(start, &LeftByLag::by_all, -longest_s_, longest_s_);
    const LeftByLag best = left_at_(result.lag_s);
    const auto is_refuted = [&](const LeftByLag& other) {
      return gap::decisiveness(other.by_all, best.by_all) > kLeavesMore;
    };
    std::size_t first = start;
    std::size_t last = start;
    while (first > 0 && !is_refuted(coarse_[first - 1])) --first;
    while (last + 1 < coarse_.size() && !is_refuted(coarse_[last + 1])) ++last;
    result.shortest_s = std::min(result.lag_s, coarse_lag_s(first));
    result.longest_s = std::max(result.lag_s, coarse_lag_s(last));
    result.is_determined =
        std::ranges::all_of(std::vector<double>{-kNeighbour_s, kNeighbour_s}, [&](double by_s) {
          const double other_s = result.lag_s + by_s;
          return std::abs(other_s) <= longest_s_ && is_refuted(left_at_(other_s));
        });
    if (result.is_determined) {
      if (!is_refuted(none())) result.lag_s = 0;
      return result;
    }
    result.lag_s = kindest(first, last, result);
    return result;
  }

 private:
  double coarse_lag_s(std::size_t i) const { return kCoarseLag_s * (static_cast<int>(i) - reach_); }
  const LeftByLag& none() const { return coarse_[static_cast<std::size_t>(reach_)]; }

  /// Of the lags from coarse one to coarse one, that with which the given model leaves least. A lag of zero
  /// among them that does not leave significantly more is preferred.
  double kindest(std::size_t first, std::size_t last, const TorqueLag& allowed) const {
    std::size_t start = first;
    for (std::size_t i = first; i <= last; ++i)
      if (sum_over_stretches(coarse_[i].by_given) < sum_over_stretches(coarse_[start].by_given)) start = i;
    const double lag_s = refined(start, &LeftByLag::by_given, allowed.shortest_s, allowed.longest_s);
    const bool allows_none = allowed.shortest_s <= 0 && 0 <= allowed.longest_s;
    return allows_none && gap::decisiveness(none().by_given, left_at_(lag_s).by_given) <= kLeavesMore ? 0
                                                                                                      : lag_s;
  }

  double refined(std::size_t start, SquaresByLag squares, double shortest_s, double longest_s) const {
    return least_near(coarse_lag_s(start), {shortest_s, longest_s, kCoarseLag_s},
                      [&](double lag_s) { return sum_over_stretches(left_at_(lag_s).*squares); });
  }

  const std::function<LeftByLag(double)>& left_at_;
  double longest_s_;
  int reach_;
  std::vector<LeftByLag> coarse_;  // at multiples of the coarse step
};

}  // namespace

TorqueLag torque_lag(const std::function<LeftByLag(double)>& left_at, double longest_s) {
  return LagSearch(left_at, longest_s).found();
}

}  // namespace identification::robot_gap
