// Cases of hidden arms and how an answer about them is judged.
#pragma once
#include <cstdint>
#include <string>
#include <vector>

#include "identification/robot_gap/arm_subject.h"
#include "tests/robot_gap/hidden_arm.h"
#include "tests/robot_gap/judged.h"

namespace robot_gap_test {

struct RobotCase {
  enum class Kind { kNone, kOne, kPair, kOutside };
  Kind kind = Kind::kNone;
  std::string arm;  // "planar", "elbow", "industrial"
  std::vector<HiddenEffect> hidden;
  std::uint64_t seed = 1;
  std::string name() const;
};

/// All kinds on all arms, with the sizes that a laboratory would notice.
std::vector<RobotCase> robot_cases(std::uint64_t seeds);

struct Answer : Judged {
  control::ArmDescription arm;  // with the corrections
};
Answer answer(const RobotCase& asked);

/// The published description of a hidden arm, as the search gets it.
control::ArmDescription published(const ArmDesign& design, const std::vector<Friction>& friction);
identification::robot_gap::ArmRecording as_recorded(HiddenRecording recording);

}  // namespace robot_gap_test
