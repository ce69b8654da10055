/// @file
/// An estimate in a table of a report.
#pragma once
#include <array>
#include <limits>

#include "identification/fit/statistics.h"
#include "report/report.h"
#include "runtime/program/wording.h"

namespace analysis {

/// Value, 95 % from, to; bounds only of an estimate that is ok. As numbers, or as text with more digits where
/// the bounds would look the same.
inline std::array<report::Cell, 3> interval_cells(double value,
                                                  const identification::fit::Estimate& estimate) {
  constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
  constexpr int kDigits = 4;  // of a number in a table
  if (!estimate.ok()) return {value, kNone, kNone};
  const auto text = runtime::interval_text(value, estimate.lower, estimate.upper, kDigits, kDigits);
  if (!text.more_digits) return {value, estimate.lower, estimate.upper};
  return {text.value, text.lower, text.upper};
}

}  // namespace analysis
