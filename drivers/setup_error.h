/// @file
#pragma once
#include <stdexcept>
#include <string>
#include <utility>

namespace drivers {

/// Thrown in set-up only. Reads "DEVICE: STEP: expected E, found F; what to try".
class SetupError : public std::runtime_error {
 public:
  struct Report {
    std::string device;  ///< "slave 3 (TMCM-1632)", "can0, module 1"
    std::string step;    ///< "set maximum_motor_current (6) to 2850 mA"
    std::string expected;
    std::string found;
    std::string hint;  ///< what to try next
  };
  explicit SetupError(Report report)
      : std::runtime_error(report.device + ": " + report.step + ": expected " + report.expected + ", found " +
                           report.found + "; " + report.hint),
        report_(std::move(report)) {}

  const Report& report() const noexcept { return report_; }

 private:
  Report report_;
};

}  // namespace drivers
