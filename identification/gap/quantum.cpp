#include "identification/gap/quantum.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

namespace identification::gap {
namespace {

/// Steps of a quantised signal are whole multiples of its quantum, to this share of it; so are almost all
/// of at least so many.
constexpr double kOfStep = 0.05;
constexpr double kMostSteps = 0.99;
constexpr std::size_t kEnoughSteps = 200;
/// Beyond this many, the digits of a text would hide whether a step is a whole multiple.
constexpr double kManySteps = 20;

}  // namespace

std::optional<double> quantum_of(std::span<const double> signal) {
  std::vector<double> changes;
  for (std::size_t i = 1; i < signal.size(); ++i)
    if (const double change = std::abs(signal[i] - signal[i - 1]); change > 0) changes.push_back(change);
  if (changes.size() < kEnoughSteps) return std::nullopt;
  std::ranges::sort(changes);
  const double least = changes[changes.size() / 100];
  // Better known from many steps: of the smallest changes, each a few of them.
  double sum = 0;
  double steps = 0;
  std::size_t whole = 0;
  std::size_t looked = 0;
  for (const double change : changes) {
    const double count = std::round(change / least);
    if (count > kManySteps) break;
    ++looked;
    if (count < 1 || std::abs(change / least - count) > kOfStep * std::max(1.0, std::sqrt(count))) continue;
    ++whole;
    sum += change;
    steps += count;
  }
  if (looked < kEnoughSteps || static_cast<double>(whole) < kMostSteps * static_cast<double>(looked))
    return std::nullopt;
  return sum / steps;
}

}  // namespace identification::gap
