/// @file
#pragma once
#include <stdexcept>
#include <string>

namespace drivers::ethercat {

/// Thrown in set-up only: device, step, what was found and what to try.
class BusError : public std::runtime_error {
 public:
  BusError(const std::string& device, const std::string& step, const std::string& problem)
      : std::runtime_error(device + ": " + step + ": " + problem), device_(device), step_(step) {}
  const std::string& device() const noexcept { return device_; }
  const std::string& step() const noexcept { return step_; }

 private:
  std::string device_;
  std::string step_;
};

/// Another master is active on the bus.
class AnotherMaster : public BusError {
 public:
  using BusError::BusError;
};

}  // namespace drivers::ethercat
