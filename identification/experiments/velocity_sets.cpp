#include "identification/experiments/velocity_sets.h"

#include <charconv>
#include <cmath>
#include <stdexcept>
#include <string>

namespace identification::experiments {
namespace {

[[noreturn]] void refuse(std::string_view sets) {
  throw std::invalid_argument("sets = '" + std::string(sets) + "', expected numbers from 1 to " +
                              std::to_string(kTable3.size()) + " such as 1,2,7-9");
}

/// Parses and removes a number at the front of `rest`.
int take_number(std::string_view& rest, std::string_view sets) {
  int number = 0;
  const auto [end, error] = std::from_chars(rest.data(), rest.data() + rest.size(), number);
  if (error != std::errc() || number < 1 || number > static_cast<int>(kTable3.size())) refuse(sets);
  rest.remove_prefix(static_cast<std::size_t>(end - rest.data()));
  return number;
}

}  // namespace

std::vector<double> velocities_rad_per_s(const VelocitySet& set) {
  const double step = std::copysign(set.step_rad_per_s, set.to_rad_per_s - set.from_rad_per_s);
  std::vector<double> velocities;
  for (int left = set.measurements - 1; left >= 0; --left) {
    // On a grid of 0.1 mrad/s, so that 0.15 equals the literal 0.15.
    velocities.push_back(std::round((set.to_rad_per_s - left * step) * 1e4) / 1e4);
  }
  return velocities;
}

std::vector<double> velocities_rad_per_s(std::string_view sets) {
  std::vector<double> velocities;
  std::string_view rest = sets;
  for (bool more = true; more;) {
    const int first = take_number(rest, sets);
    int last = first;
    if (rest.starts_with('-')) {
      rest.remove_prefix(1);
      last = take_number(rest, sets);
    }
    if (last < first) refuse(sets);
    for (int number = first; number <= last; ++number) {
      const std::vector<double> more_velocities =
          velocities_rad_per_s(kTable3[static_cast<std::size_t>(number - 1)]);
      velocities.insert(velocities.end(), more_velocities.begin(), more_velocities.end());
    }
    more = rest.starts_with(',');
    if (more) rest.remove_prefix(1);
  }
  if (!rest.empty()) refuse(sets);
  return velocities;
}

}  // namespace identification::experiments
