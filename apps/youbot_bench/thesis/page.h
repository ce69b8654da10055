/// @file
/// The page of all figures, and the compared numbers for other programs.
#pragma once
#include <nlohmann/json_fwd.hpp>
#include <span>

#include "apps/youbot_bench/thesis/figure.h"
#include "report/report.h"

namespace youbot_bench::thesis {

/// How many numbers were compared, and what came out.
struct Tally {
  std::size_t compared = 0;
  std::size_t settings = 0;  ///< of them, taken from the thesis
  std::size_t must_agree = 0;
  std::size_t agree = 0;  ///< of those that must
};
Tally tally(std::span<const Figure> figures);

/// `selected`: only some of the chapters were made.
report::Page page_of(std::span<const Figure> figures, bool selected);
/// "youbot-thesis/1": each compared number with its place, ours, difference and tolerance in percent.
nlohmann::json json_of(std::span<const Figure> figures);

}  // namespace youbot_bench::thesis
