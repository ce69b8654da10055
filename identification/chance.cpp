#include "identification/chance.h"

#include <algorithm>
#include <cstddef>
#include <vector>

#include "identification/gap/parallel.h"

namespace identification {
namespace {

/// Checked after this many draws, whatever the number of cores.
constexpr int kDrawsAtOnce = 16;

}  // namespace

double ChanceTest::p_value(double gain) const {
  int exceeded = 0;
  int done = 0;
  while (done < repetitions && exceeded < enough_exceedances) {
    std::vector<Eigen::VectorXd> draws(static_cast<std::size_t>(std::min(kDrawsAtOnce, repetitions - done)));
    for (Eigen::VectorXd& data : draws) data = draw();
    std::vector<char> exceeds(draws.size());
    gap::in_parallel(draws.size(), [&](std::size_t i) { exceeds[i] = most_gain(draws[i]) >= gain ? 1 : 0; });
    exceeded += static_cast<int>(std::ranges::count(exceeds, 1));
    done += static_cast<int>(draws.size());
  }
  return (1.0 + exceeded) / (1.0 + done);
}

}  // namespace identification
