/// @file
/// Names and numbers in the sentences of a report.
#pragma once
#include <span>
#include <string>
#include <vector>

namespace runtime {

/// "wheel-2"; "wheel-1 and wheel-4"; "wheel-1 to wheel-4" for three or more consecutive numbers; otherwise
/// "wheel-1, wheel-2 and wheel-4".
std::string list_text(std::span<const std::string> names);

/// Three significant digits: "0.0721 N·m".
std::string number_text(double value, const std::string& unit = {});
/// From minimum to maximum of the finite values, "0.0721 to 0.104 N·m"; one number if they look the same, "–"
/// if there are none.
std::string range_text(std::span<const double> values, const std::string& unit = {});

/// A value with its interval.
struct IntervalText {
  std::string value;
  std::string lower;
  std::string upper;
  bool more_digits = false;  ///< than were asked for
};
/// With at least these significant digits, and with as many as it takes for bounds that differ to look
/// different, and for the value to lie between them.
IntervalText interval_text(double value, double lower, double upper, int value_digits = 3,
                           int bound_digits = 4);

/// "1 slip", "14 slips".
std::string count_text(long long count, const std::string& noun);

}  // namespace runtime
