/// @file
/// Compares the result of the search on a case with its truth.
#pragma once
#include <string>
#include <vector>

#include "identification/gap/gap.h"
#include "tests/gap/edit_test.h"
#include "tests/gap/gap_cases.h"

namespace gap_test {

/// A name is right if it is the true one, or one of two that the search cannot distinguish, if the other is
/// the true one.
struct Judgement {
  CaseSpec spec;
  double least_size = 0;
  identification::gap::Verdict verdict = identification::gap::Verdict::kNoGap;
  std::vector<std::string> named{};   ///< the true name if it counts as right, otherwise the search's own
  std::vector<std::string> missed{};  ///< true effects without a name
  std::vector<std::string> extra{};   ///< names without a true effect
  bool right() const { return missed.empty() && extra.empty(); }

  double true_floor_Nm = 0;  ///< rms of the torque noise, as sampled
  double floor_Nm = 0;       ///< the search's, in its band
  double gap_before_Nm = 0;
  double gap_after_Nm = 0;
  /// Of the effects rightly named, parameters that mean the same in plant and library.
  int parameters = 0;
  int parameters_inside = 0;                      ///< their 95 % interval
  std::vector<std::string> parameters_outside{};  ///< in words
  /// Of the given model's own, likewise.
  int base_parameters = 0;
  int base_parameters_inside = 0;
  std::vector<Edit> edits{};  ///< of a case called explained, where they were asked for
  double search_s = 0;        ///< wall time
  std::string failure{};      ///< message of the search
};

/// Runs the search on the case, and the edit test if the result is "explained". Does not throw the search's
/// exceptions.
Judgement judge(const Case& gap_case, bool edit = false);

}  // namespace gap_test
