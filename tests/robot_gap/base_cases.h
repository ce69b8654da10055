// Cases of hidden bases.
#pragma once
#include <cstdint>
#include <string>
#include <vector>

#include "identification/robot_gap/robot_gap.h"
#include "tests/robot_gap/hidden_base.h"
#include "tests/robot_gap/judged.h"

namespace robot_gap_test {

struct BaseCase {
  enum class Group {
    kNothing,
    kSingle,
    kPairs,
    kOutside,
    kForcesNothing,
    kForcesSingle,
    kForcesPairs,
    kForcesOutside
  };
  Group group = Group::kNothing;
  BaseDesign base;
  std::vector<BaseEffect> hidden;
  std::uint64_t seed = 1;
  std::string name() const;  // "base_single: mecanum: slip_sideways base"
};
/// "base_single"
std::string group_name(BaseCase::Group group);

/// All groups on all bases, then bases whose torques are recorded. Every other seed has a camera instead of
/// motion capture.
std::vector<BaseCase> base_cases(std::uint64_t seeds);

Judged judge_base(const BaseCase& asked);

/// The only function that knows the library's recordings and models of bases.
identification::robot_gap::RobotResult analyse_base(const BaseDesign& published,
                                                    const std::vector<BaseRecording>& data,
                                                    const std::vector<BaseRecording>& held_out,
                                                    std::uint64_t seed);

}  // namespace robot_gap_test
