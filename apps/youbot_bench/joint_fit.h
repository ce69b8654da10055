/// @file
/// Checks whether an experiment fits a joint with end stops, before anything moves.
#pragma once
#include <cstdint>
#include <optional>
#include <span>
#include <string>

#include "apps/youbot_bench/arm_weight.h"
#include "hal/robot.h"
#include "identification/experiments/rehearsal.h"

namespace youbot_bench {

/// Why an experiment cannot start at the joint's position.
struct Misfit {
  enum class Kind : std::uint8_t {
    kNone,
    kNotHomed,    ///< `joint` of the robot is not homed
    kRoomBelow,   ///< it needs `need` rad towards the lower end; there are `limit`
    kRoomAbove,   ///< likewise, towards the upper
    kHeavy,       ///< the weight is `need` N·m, more than `limit`
    kFallsAlone,  ///< likewise, for a joint without torque
  };
  Kind kind = Kind::kNone;
  int joint = -1;
  double need = 0.0;
  double limit = 0.0;
  explicit operator bool() const noexcept { return kind != Kind::kNone; }
};

/// One joint and the demands of an experiment.
class JointFit {
 public:
  struct Plan {
    std::string experiment;
    identification::experiments::Demand demand;
    double max_travel_rad = 0.0;  ///< stop limit from its start; 0: no limit
    std::optional<double>
        start_rad{};  ///< position to which the joint is moved first; otherwise it starts at its position
  };
  /// @throws std::invalid_argument naming joint, need, limit and advice, if it fits nowhere.
  JointFit(const Plan& plan, std::span<const hal::JointInfo> joints, std::size_t joint);

  /// Cycle: for the present pose of the robot.
  Misfit check(const hal::RobotSample& sample) noexcept;
  /// Cycle: start of the experiment.
  double start_rad(const hal::JointSample& sample) const noexcept {
    return plan_.start_rad.value_or(sample.position_rad);
  }
  double torque_limit_Nm() const noexcept { return torque_limit_Nm_; }
  /// Setup: text, as in the constructor's exceptions.
  std::string describe(const Misfit& misfit, std::span<const hal::JointInfo> joints) const;

 private:
  Plan plan_;
  hal::JointInfo info_;
  std::size_t joint_;
  double below_rad_ = 0.0;  // needed
  double above_rad_ = 0.0;
  double torque_limit_Nm_;
  ArmWeight weight_;
};

}  // namespace youbot_bench
