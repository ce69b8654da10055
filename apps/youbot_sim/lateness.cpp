#include "apps/youbot_sim/lateness.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <utility>

namespace youbot_sim {

void Lateness::add(std::chrono::nanoseconds after) noexcept {
  if (after <= kLate) return;
  for (Counts* const counts : {&total_, &unreported_}) {
    ++counts->late;
    counts->longest = std::max(counts->longest, after);
  }
}

std::optional<Lateness::Counts> Lateness::due(std::chrono::nanoseconds now) noexcept {
  if (unreported_.late == 0 || (reported_at_ && now - *reported_at_ < kPause)) return std::nullopt;
  reported_at_ = now;
  return std::exchange(unreported_, {});
}

std::string describe(const Lateness::Counts& counts) {
  using Milliseconds = std::chrono::duration<double, std::milli>;
  return fmt::format("{} answer{} came later than {:.1f} ms, the longest after {:.1f} ms", counts.late,
                     counts.late == 1 ? "" : "s", Milliseconds(Lateness::kLate).count(),
                     Milliseconds(counts.longest).count());
}

}  // namespace youbot_sim
