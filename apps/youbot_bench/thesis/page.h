/// @file
/// The page of all figures, and the compared numbers for other programs.
#pragma once
#include <nlohmann/json_fwd.hpp>
#include <span>
#include <string>

#include "apps/youbot_bench/thesis/figure.h"
#include "report/report.h"

namespace youbot_bench::thesis {

/// "4 to 5", "242 or more".
std::string expected_text(const Printed& printed);

/// How many numbers were compared, by what they mean.
struct Tally {
  std::size_t compared = 0;
  std::size_t must_agree = 0;
  std::size_t agree = 0;  ///< of those that must
  std::size_t settings = 0;
  std::size_t by_construction = 0;
  std::size_t may_differ = 0;
  std::size_t outside = 0;  ///< of any kind, beyond their limit
};
Tally tally(std::span<const Figure> figures, Origin origin);

/// `selected`: only some of the chapters were made.
report::Page page_of(std::span<const Figure> figures, bool selected);
/// "youbot-thesis/1": each number with its origin, place, kind, ours, difference and limit in percent, and
/// the tally of each origin.
nlohmann::json json_of(std::span<const Figure> figures);

}  // namespace youbot_bench::thesis
