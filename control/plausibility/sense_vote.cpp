#include "control/plausibility/sense_vote.h"

#include <algorithm>
#include <cmath>

namespace control {
namespace {

/// Five readings of a wheel that turns with the others.
constexpr double kAwaited_s = 0.05;

}  // namespace

std::optional<int> SenseVote::update(const std::array<int, 4>& senses, double elapsed_s) noexcept {
  const auto forward = std::ranges::count(senses, 1);
  const auto backward = std::ranges::count(senses, -1);
  if (forward == 0 || backward == 0) {
    differ_s_ = 0.0;
    return std::nullopt;
  }
  differ_s_ += elapsed_s;
  const bool complete = forward + backward == static_cast<std::ptrdiff_t>(senses.size());
  if (!complete && differ_s_ < kAwaited_s) return std::nullopt;
  if (std::min(forward, backward) > 1 || forward == backward) return -1;
  const int fewer = forward < backward ? 1 : -1;
  return static_cast<int>(std::ranges::find(senses, fewer) - senses.begin());
}

}  // namespace control
