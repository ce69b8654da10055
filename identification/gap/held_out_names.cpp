#include "identification/gap/held_out_names.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdio>
#include <set>

namespace identification::gap {
namespace {

struct Stretch {
  double from_s;
  double to_s;
};

std::string seconds(double value) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%.2f s", value);
  return text.data();
}

/// ", 2.00 s to 4.00 s" or ", 24 stretches, 96.00 s in all, between 2.00 s and 400.00 s"
std::string place_of(const std::vector<Stretch>& stretches) {
  const Stretch all{stretches.front().from_s, stretches.back().to_s};
  if (stretches.size() == 1) return ", " + seconds(all.from_s) + " to " + seconds(all.to_s);
  double length_s = 0;
  for (const Stretch& stretch : stretches) length_s += stretch.to_s - stretch.from_s;
  return ", " + std::to_string(stretches.size()) + " stretches, " + seconds(length_s) + " in all, between " +
         seconds(all.from_s) + " and " + seconds(all.to_s);
}

}  // namespace

std::vector<std::string> held_out_names(const Rows& rows, const std::vector<Eigen::Index>& judging,
                                        double from, double to) {
  std::set<std::size_t> used;
  for (const Eigen::Index row : judging) used.insert(rows.recording(row));
  std::vector<std::string> names;
  for (auto at = used.begin(); at != used.end();) {
    const Signals& first = rows.signals()[*at];
    const double length_s = first.recorded_to_s - first.recorded_from_s;
    std::vector<Stretch> stretches;
    for (; at != used.end() && rows.signals()[*at].source == first.source; ++at) {
      const Signals& s = rows.signals()[*at];
      const Stretch own{std::max(s.time_s.front(), s.recorded_from_s + from * length_s),
                        std::min(s.time_s.back(), s.recorded_from_s + to * length_s)};
      if (!stretches.empty() && own.from_s - stretches.back().to_s < 2 * rows.length_s())
        stretches.back().to_s = own.to_s;
      else
        stretches.push_back(own);
    }
    const double used_s = stretches.back().to_s - stretches.front().from_s;
    const bool whole = stretches.size() == 1 && used_s > length_s - 2 * rows.length_s();
    names.push_back(first.name + (whole ? std::string() : place_of(stretches)));
  }
  return names;
}

}  // namespace identification::gap
