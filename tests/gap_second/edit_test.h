/// @file
/// The edit test: an effect is removed from the drive and from the delivered model, and the same program
/// reports the gap on new recordings before any fit. [RCILab, "Fidelity Is Not Identification" (SAPC), 2026]
#pragma once
#include <string>
#include <vector>

#include "tests/gap_second/answer.h"
#include "tests/gap_second/cases.h"

namespace gap_second {

struct Edit {
  std::string effect;
  double gap_Nm = 0.0;            ///< NaN if the program rejected the new recordings
  double floor_Nm = 0.0;          ///< the noise of a drive that never had the effect
  double refitted_Nm = 0.0;       ///< residual of the edited model after a refit
  bool parameters_agree = false;  ///< then, within the 95 % intervals of both
  /// At the floor, as for "explained", or above it by no more than its intervals explain.
  bool passed() const {
    return gap_Nm <= 1.2 * floor_Nm || (refitted_Nm <= 1.2 * floor_Nm && parameters_agree);
  }
};

/// The text of a drive model without the effects of a type, but for as many as `given` of the first of them.
std::string without_effect(const std::string& model, const std::string& effect, int given = 0);

/// One for each effect that was named, several of one type together, of a case called explained. Works in new
/// directories below DIR, in which the case was answered.
std::vector<Edit> edit_tests(const std::string& program, const Case& drawn, const Answer& answer,
                             const std::string& directory, int longest_s);

}  // namespace gap_second
