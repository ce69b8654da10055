/// @file
/// Alternatives to a step-by-step search: fits of all of the library's effects at once. Both baselines get
/// the same rows and torque columns as the search.
#pragma once
#include <string>
#include <vector>

#include "tests/gap/gap_cases.h"

namespace gap_test {

struct BaselineAnswer {
  std::vector<std::string> named{};  ///< effects of the library, each once
  double gap_after_Nm = 0;           ///< rms residual of the held-out rows
};

struct BaselineAnswers {
  /// Effects without a torque column cannot be named: those that act on the command of a measured torque, and
  /// a lost sign.
  bool could_name_all = false;
  /// Sequentially thresholded least squares (Brunton, Proctor and Kutz, PNAS 113:3932, 2016) over every shape
  /// of every effect; the threshold is the one that predicts left-out blocks best.
  BaselineAnswer sparse{};
  /// All parameters free at once without selection, as in system identification of a complete model; each
  /// effect in the shape that is best alone. Named: the 95 % interval of least squares excludes zero.
  BaselineAnswer all_parameters{};
};

/// @throws the exceptions of the preparation of the recordings.
BaselineAnswers baseline_answers(const Case& gap_case);

/// Whether it names exactly what the search could name.
bool is_right(const BaselineAnswer& answer, const CaseSpec& spec);

}  // namespace gap_test
