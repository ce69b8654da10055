// How an answer of the search is judged.
#pragma once
#include <string>
#include <vector>

#include "identification/robot_gap/robot_gap.h"

namespace robot_gap_test {

struct Judged {
  identification::robot_gap::RobotResult result;
  bool right = false;         // exactly the hidden effects on their parts, or nothing
  bool among_rivals = false;  // every hidden effect is named, or is a rival of a named one, and none else
  bool wrong_name = false;    // something is named that is not there and has no rival that is
  int parameters = 0;         // of right effects whose true value is one number
  int parameters_inside = 0;  // their 95 % intervals
  double seconds = 0;
};

bool same(const identification::robot_gap::NamedEffect& a, const identification::robot_gap::NamedEffect& b);
/// Compares the names with the hidden ones; parameters are the caller's.
void judge_names(Judged& judged, const std::vector<identification::robot_gap::NamedEffect>& truth);
/// Counts the first parameter of `found` and whether its interval contains `value`.
void judge_parameter(Judged& judged, const identification::robot_gap::FoundPart& found, double value);

}  // namespace robot_gap_test
