/// @file
/// Limits on settings over the control socket.
#pragma once
#include <cstddef>

#include "operation/config.h"
#include "tests/fuzz/fuzz_target.h"

namespace fuzz {

/// No limit of force, torque or speed above the file's, and no protection off that is on in the file.
inline void check_ceilings(const operation::Config& set, const operation::Config& file) {
  using operation::Config;
  const auto no_more = [&](auto value) { require(value(set) <= value(file)); };
  no_more([](const Config& c) { return c.cycle.controller.wrench_limits.force_N; });
  no_more([](const Config& c) { return c.cycle.controller.wrench_limits.moment_Nm; });
  no_more([](const Config& c) { return c.cycle.controller.torque_limit_Nm; });
  no_more([](const Config& c) { return c.cycle.wheel_speed_limit_rad_per_s; });
  no_more([](const Config& c) { return c.path.limits.speed_m_per_s; });
  no_more([](const Config& c) { return c.path.limits.acceleration_m_per_s2; });
  no_more([](const Config& c) { return c.path.limits.turn_speed_rad_per_s; });
  no_more([](const Config& c) { return c.path.limits.turn_acceleration_rad_per_s2; });
  for (std::size_t i = 0; i < 5; ++i)
    no_more([i](const Config& c) { return c.teleoperation.robot.arm_torque_limit_Nm[i]; });
  for (std::size_t i = 0; i < 5; ++i)
    no_more([i](const Config& c) { return c.teleoperation.robot.arm_friction.coulomb_Nm[i]; });
  no_more([](const Config& c) { return c.teleoperation.robot.arm_compensator.margin; });
  no_more([](const Config& c) { return c.teleoperation.robot.model.payload_kg; });
  no_more([](const Config& c) { return c.teleoperation.joint_speed_limit_rad_per_s; });
  no_more([](const Config& c) { return c.teleoperation.robot.spring.force_limit_N; });
  no_more([](const Config& c) { return c.teleoperation.robot.spring.moment_limit_Nm; });
  no_more([](const Config& c) { return c.teleoperation.feedback.force_limit_N; });
  require(set.cycle.controller.damping[0] >= file.cycle.controller.damping[0]);
  require(set.cycle.controller.damping[2] >= file.cycle.controller.damping[2]);
  require(!set.cycle.controller.compensate_friction || file.cycle.controller.compensate_friction);
  require(!set.teleoperation.force_feedback || file.teleoperation.force_feedback);
  require(set.teleoperation.tank.active || !file.teleoperation.tank.active);
  require(set.teleoperation.detect_release || !file.teleoperation.detect_release);
}

}  // namespace fuzz
