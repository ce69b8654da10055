/// @file
/// Compares an answer of youbot-gap with the truth of its case.
#pragma once
#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "tests/gap_second/answer.h"
#include "tests/gap_second/cases.h"
#include "tests/gap_second/edit_test.h"

namespace gap_second {

enum class Outcome : std::uint8_t {
  kRight,         ///< what is hidden, and nothing else; nothing where nothing is hidden
  kHalfRight,     ///< a part of it, or all of it and more
  kWrongName,     ///< something else
  kFalseAlarm,    ///< nothing is hidden and something was named
  kAbstained,     ///< nothing named; it says that something is unexplained
  kMissed,        ///< something is hidden; "no gap", or "explained" by nothing
  kRefusedCause,  ///< bad data refused, naming what is wrong with them
  kRefusedOther,  ///< refused with another reason
  kFailed,        ///< crashed or out of time
};
constexpr std::size_t kOutcomes = 9;
const char* name(Outcome outcome);

struct Score {
  Outcome outcome = Outcome::kFailed;
  bool by_rival = false;   ///< a hidden effect is only among the rivals of the named one
  bool diagnosed = false;  ///< bad data: `diagnosis` names what is wrong
  bool worse = false;    ///< according to gap.json itself, the delivered model is worse on held-out data than
                         ///< the given one
  int undetermined = 0;  ///< effects named without a parameter that differs from zero
  int intervals = 0;     ///< that can be judged
  int intervals_right = 0;
  std::vector<std::string> wrong_intervals;  ///< with truth and interval
  std::vector<Edit> edits;                   ///< of a case called explained
};

Score judge(const Case& drawn, const Answer& answer);
/// Truth and answer in one line.
std::string report_line(const Case& drawn, const Answer& answer, const Score& score);

/// Counts of one class or one kind.
struct Tally {
  std::array<int, kOutcomes> outcomes{};
  int cases = 0, by_rival = 0, diagnosed = 0, worse = 0, undetermined = 0, intervals = 0, intervals_right = 0;
  int edited = 0, edits_passed = 0;  ///< cases
  double seconds = 0.0, longest_s = 0.0;
  void add(const Answer& answer, const Score& score);
};
std::string table_head(std::size_t name_width);
std::string table_row(const std::string& row_name, const Tally& tally, std::size_t name_width);

}  // namespace gap_second
