/// @file
/// Parameter check for constructors: rejects values that are not finite and positive.
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

}  // namespace control
