/// @file
/// Runs youbot-gap like a user and parses its answer.
#pragma once
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "tests/gap_second/cases.h"

namespace gap_second {

struct NamedEffect {
  std::string type;
  std::vector<std::string> equivalent;  ///< rivals that the data cannot distinguish, according to the answer
  bool determined = true;  ///< it has no parameters, or the interval of one of them excludes zero
};

struct Answer {
  int exit_code = -1;  ///< 124: out of time; 128 and more: ended by a signal
  double seconds = 0.0;
  std::string error;      ///< its error message
  std::string verdict;    ///< empty without gap.json
  std::string diagnosis;  ///< from gap.json, lower case
  std::vector<NamedEffect> effects;
  double floor_Nm = 0.0, gap_before_Nm = 0.0, gap_refitted_Nm = 0.0, gap_after_Nm = 0.0;
  std::optional<std::pair<double, double>> simulation;  ///< before and after
  double inertia_kg_m2 = 0.0;              ///< of the delivered model, an inertia effect included
  std::vector<std::string> model_effects;  ///< of the delivered model
  /// 95 % intervals by "effect.parameter".
  std::map<std::string, std::pair<double, double>> intervals;
};

/// Blocks until the program ends or `longest_s` is over. Its output is DIR/log.txt, its results are in
/// DIR/gap.
/// @throws std::runtime_error if gap.json exists but does not match its documentation.
Answer ask(const std::string& program, const CaseFiles& files, const std::string& directory, int longest_s);

}  // namespace gap_second
