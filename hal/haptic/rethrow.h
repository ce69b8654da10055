/// @file
/// Errors of the layers below, as errors of the HAL.
#pragma once
#include <stdexcept>
#include <utility>

#include "drivers/setup_error.h"
#include "hal/setup_error.h"

namespace hal {

/// Setup: calls `step`. @throws hal::SetupError for its drivers::SetupError, and for what a system library
/// below it throws.
template <typename Step>
void with_hal_errors(Step&& step) {
  try {
    std::forward<Step>(step)();
  } catch (const drivers::SetupError& error) {
    const drivers::SetupError::Report& report = error.report();
    throw SetupError(report.device, report.step,
                     "expected " + report.expected + ", found " + report.found + "; " + report.hint);
  } catch (const SetupError&) {
    throw;
  } catch (const std::runtime_error& error) {
    throw SetupError("haptic device", "open", error.what());
  }
}

}  // namespace hal
