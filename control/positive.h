/// @file
/// Parameter checks for constructors: reject values that are not finite, or not positive, or negative.
#pragma once
#include <cmath>
#include <stdexcept>
#include <string>

namespace control {

///   const RequirePositive require_positive{"hand presence"};
///   require_positive(config.period_s, "period_s");
struct RequirePositive {
  const char* whose;

  /// Returns the value. @throws std::invalid_argument naming owner, parameter and value.
  double operator()(double value, const char* name) const {
    if (!(std::isfinite(value) && value > 0))
      throw std::invalid_argument(std::string(whose) + ": " + name + " must be positive, not " +
                                  std::to_string(value));
    return value;
  }
};

/// The same for a value that may be zero.
struct RequireNotNegative {
  const char* whose;

  /// Returns the value. @throws std::invalid_argument naming owner, parameter and value.
  double operator()(double value, const char* name) const {
    if (!(std::isfinite(value) && value >= 0))
      throw std::invalid_argument(std::string(whose) + ": " + name + " must not be negative, and not " +
                                  std::to_string(value));
    return value;
  }
};

}  // namespace control
