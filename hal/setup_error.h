/// @file
#pragma once
#include <stdexcept>
#include <string>

namespace hal {

/// Thrown in set-up only. Reads "DEVICE: STEP: what to do".
class SetupError : public std::runtime_error {
 public:
  SetupError(const std::string& device, const std::string& step, const std::string& hint)
      : std::runtime_error(device + ": " + step + ": " + hint) {}
};

}  // namespace hal
