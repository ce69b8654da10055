/// @file
/// A figure or table of the thesis as our software makes it, with the printed numbers beside ours.
#pragma once
#include <functional>
#include <limits>
#include <string>
#include <string_view>
#include <vector>

#include "apps/youbot_bench/thesis/printed_numbers.h"
#include "report/report.h"

namespace youbot_bench::thesis {

struct Comparison {
  const Printed* printed = nullptr;  ///< static
  double ours = std::numeric_limits<double>::quiet_NaN();
  std::string why{};  ///< one or two sentences: what differs and why; empty if nothing does

  /// Beyond the printed number, or the nearest end of the printed range: 0 within; NaN for zero, of which
  /// nothing is a percentage, and if we have no number.
  double difference_percent() const noexcept;
  /// Within its limit; with Printed::limited() only.
  bool agrees() const noexcept;
};
/// @throws std::logic_error as printed().
Comparison compare(std::string_view key, double ours, std::string why = {});

struct FigureTable {
  std::string caption;
  std::vector<report::Column> columns;
  std::vector<report::Row> rows;
};

struct Figure {
  std::string number;   ///< "Figure 15"
  std::string caption;  ///< what it shows, in our words
  std::string text{};   ///< how ours was made and what differs
  std::vector<Comparison> compared{};
  std::vector<FigureTable> tables{};
  std::vector<report::Plot> plots{};
  std::function<void(report::Page&)> more{};  ///< tables that another part of the software draws
};

/// What software cannot make, or what is not made here.
struct NotMade {
  std::string_view number;
  std::string_view caption;
  std::string_view reason;
};

}  // namespace youbot_bench::thesis
