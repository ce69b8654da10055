// Cases of hidden arms and how an answer about them is judged.
#pragma once
#include <cstdint>
#include <string>
#include <vector>

#include "identification/robot_gap/arm_subject.h"
#include "identification/robot_gap/robot_gap.h"
#include "tests/robot_gap/hidden_arm.h"

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

struct Answer {
  RobotCase asked;
  identification::robot_gap::RobotResult result;
  control::ArmDescription arm;  // with the corrections
  bool right = false;           // exactly the hidden effects on their parts, or nothing
  bool among_rivals = false;    // every hidden effect is named, or is a rival of a named one, and none else
  bool wrong_name = false;      // something is named that is not there and has no rival that is
  int parameters = 0;           // of right effects whose true value is one number
  int parameters_inside = 0;    // their 95 % intervals
  double seconds = 0;
};
Answer answer(const RobotCase& asked);

/// The published description of a hidden arm, as the search gets it.
control::ArmDescription published(const ArmDesign& design, const std::vector<Friction>& friction);
identification::robot_gap::ArmRecording as_recorded(HiddenRecording recording);

}  // namespace robot_gap_test
