#include "apps/youbotctl/export_statistics.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

namespace youbotctl {
namespace {

struct Quantile {
  const char* name;
  std::size_t percent;
};
constexpr std::array<Quantile, 5> kQuantiles{
    {{"q01", 1}, {"q10", 10}, {"q50", 50}, {"q90", 90}, {"q99", 99}}};

}  // namespace

Statistics statistics(std::span<const double> values, std::size_t width) {
  const std::size_t count = values.size() / width;
  Statistics result{
      {"min", {}}, {"max", {}}, {"mean", {}}, {"std", {}}, {"count", {static_cast<double>(count)}}};
  constexpr std::size_t kFirstQuantile = 5;
  for (const Quantile& quantile : kQuantiles) result.emplace_back(quantile.name, std::vector<double>());
  std::vector<double> sorted(count);
  for (std::size_t d = 0; d < width; ++d) {
    for (std::size_t i = 0; i < count; ++i) sorted[i] = values[i * width + d];
    std::ranges::sort(sorted);
    const double mean = std::accumulate(sorted.begin(), sorted.end(), 0.0) / static_cast<double>(count);
    double squares = 0;
    for (const double value : sorted) squares += (value - mean) * (value - mean);
    result[0].second.push_back(sorted.front());
    result[1].second.push_back(sorted.back());
    result[2].second.push_back(mean);
    result[3].second.push_back(std::sqrt(squares / static_cast<double>(count)));
    for (std::size_t q = 0; q < kQuantiles.size(); ++q) {
      const std::size_t rank = (kQuantiles[q].percent * count + 99) / 100;  // rounded up, so at least 1
      result[kFirstQuantile + q].second.push_back(sorted[rank - 1]);
    }
  }
  return result;
}

}  // namespace youbotctl
