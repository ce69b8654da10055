/// @file
/// Whether an experiment fits a joint that has end stops, judged before anything moves.
#pragma once
#include <cstdint>
#include <optional>
#include <span>
#include <string>

#include "apps/youbot_bench/arm_weight.h"
#include "hal/robot.h"
#include "identification/experiments/rehearsal.h"

namespace youbot_bench {

/// Why an experiment cannot begin where its joint stands.
struct Misfit {
  enum class Kind : std::uint8_t {
    kNone,
    kNotHomed,    ///< `joint` of the robot does not know its place between its end stops
    kRoomBelow,   ///< it needs `need` rad towards the lower end; there are `limit`
    kRoomAbove,   ///< likewise, towards the upper
    kHeavy,       ///< the weight is `need` N·m, of which `limit` may be
    kFallsAlone,  ///< likewise, of a joint that is left without torque
  };
  Kind kind = Kind::kNone;
  int joint = -1;
  double need = 0.0;
  double limit = 0.0;
  explicit operator bool() const noexcept { return kind != Kind::kNone; }
};

/// One joint and what an experiment will ask of it.
class JointFit {
 public:
  struct Plan {
    std::string experiment;
    identification::experiments::Demand demand;
    double max_travel_rad = 0.0;  ///< where it is stopped, from where it began; 0: nowhere
    std::optional<double>
        start_rad{};  ///< where the joint is taken first; otherwise it begins where it stands
  };
  /// @throws std::invalid_argument naming joint, need, limit and what to do, when it fits nowhere.
  JointFit(const Plan& plan, std::span<const hal::JointInfo> joints, std::size_t joint);

  /// Cycle: for a robot that stands like this.
  Misfit check(const hal::RobotSample& sample) noexcept;
  /// Cycle: where the experiment begins.
  double start_rad(const hal::JointSample& sample) const noexcept {
    return plan_.start_rad.value_or(sample.position_rad);
  }
  double torque_limit_Nm() const noexcept { return torque_limit_Nm_; }
  /// Setup: in words, as those that the constructor throws.
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
