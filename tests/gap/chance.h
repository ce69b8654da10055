/// @file
/// Random numbers that do not depend on the standard library.
#pragma once
#include <cmath>
#include <cstdint>
#include <numbers>

namespace gap_test {

/// [S. Vigna, splitmix64]
class Chance {
 public:
  explicit Chance(std::uint64_t seed) : state_(seed) {}

  std::uint64_t bits() {
    std::uint64_t z = (state_ += 0x9E3779B97F4A7C15u);
    z = (z ^ (z >> 30u)) * 0xBF58476D1CE4E5B9u;
    z = (z ^ (z >> 27u)) * 0x94D049BB133111EBu;
    return z ^ (z >> 31u);
  }
  double uniform(double from, double to) {
    return from + (to - from) * 0x1p-53 * static_cast<double>(bits() >> 11u);
  }
  double sign() { return (bits() & 1u) != 0 ? 1 : -1; }
  /// Standard normal. [Box–Muller]
  double normal() {
    if (has_spare_) {
      has_spare_ = false;
      return spare_;
    }
    const double radius = std::sqrt(-2 * std::log(1 - uniform(0, 1)));
    const double angle = uniform(0, 2 * std::numbers::pi);
    spare_ = radius * std::sin(angle);
    has_spare_ = true;
    return radius * std::cos(angle);
  }

 private:
  std::uint64_t state_;
  double spare_ = 0;
  bool has_spare_ = false;
};

}  // namespace gap_test
