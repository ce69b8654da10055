/// @file
/// Right for the right reason: an effect is taken away from the hidden drive and from the delivered model,
/// and nothing is fitted again. [RCILab, "Fidelity Is Not Identification" (SAPC), 2026: the edit test]
#pragma once
#include <string>
#include <vector>

#include "identification/gap/gap.h"
#include "tests/gap/gap_cases.h"

namespace gap_test {

/// A model that held the effect under another name, or wrong parameters that make up for each other, leaves a
/// gap on the drive that has lost it.
struct Edit {
  std::string effect;
  double gap_Nm = 0;       ///< that the edited model leaves of the edited drive's recordings
  double never_Nm = 0;     ///< that is left of a drive which never had the effect: the noise floor
  double refitted_Nm = 0;  ///< that the edited model leaves when it may follow the edited drive
  /// Its parameters then agree with the delivered ones, all within the 95 % intervals of both.
  bool parameters_agree = false;

  bool at_the_floor() const;
  /// At the floor, or off it by no more than the delivered parameters are uncertain by their own intervals.
  bool passed() const;
};

/// One for each effect that the search named, several of one type together. The edited drive follows the same
/// plan with the same seeds.
std::vector<Edit> edit_tests(const Case& gap_case, const identification::gap::Result& result);

}  // namespace gap_test
