/// @file
/// Right for the right reason: an effect is removed from the hidden drive and from the delivered model,
/// without another fit. [RCILab, "Fidelity Is Not Identification" (SAPC), 2026: the edit test]
#pragma once
#include <string>
#include <vector>

#include "identification/gap/gap.h"
#include "tests/gap/gap_cases.h"

namespace gap_test {

/// A model that contained the effect under another name, or wrong parameters that compensate each other,
/// leaves a gap on the drive without it.
struct Edit {
  std::string effect;
  double gap_Nm = 0;       ///< residual of the edited model on the edited drive's recordings
  double never_Nm = 0;     ///< residual of a drive that never had the effect: the noise floor
  double refitted_Nm = 0;  ///< residual of the edited model after a refit to the edited drive
  /// Its parameters then agree with the delivered ones, all within the 95 % intervals of both.
  bool parameters_agree = false;

  bool at_the_floor() const;
  /// At the floor, or above it by no more than the intervals of the delivered parameters explain.
  bool passed() const;
};

/// One for each effect that the search named, several of one type together. The edited drive follows the same
/// plan with the same seeds.
std::vector<Edit> edit_tests(const Case& gap_case, const identification::gap::Result& result);

}  // namespace gap_test
