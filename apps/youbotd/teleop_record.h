/// @file
/// Everything one cycle of teleoperation knew and did.
#pragma once
#include <array>
#include <chrono>
#include <cstdint>
#include <type_traits>

#include "apps/youbotd/cycle_record.h"
#include "control/teleoperation.h"

namespace youbotd {

/// SI; frames as in control/robot_model.h and hal/haptic_sample.h, quaternions ordered w, x, y, z, joints as
/// hal::Robot has them: wheels, then arm. Commands act from this sample's moment on; measured values answer
/// the row before. Plain numbers, because it crosses threads.
struct TeleopRecord {
  static constexpr double kNaN = CycleRecord::kNaN;
  static constexpr std::size_t kJoints = 9;

  std::chrono::nanoseconds time{};  ///< since the first cycle
  control::TeleopPhase phase = control::TeleopPhase::kOff;
  bool rate_control = false;
  bool clutched = false;
  std::uint8_t limited = 0;  ///< bits of `limiter`
  bool protecting = false;
  std::array<double, 3> setpoint_p_WT_m{};
  std::array<double, 4> setpoint_q_WT{};
  std::array<double, 3> tip_p_WT_m{};  ///< from the joints
  std::array<double, 4> tip_q_WT{};
  std::array<double, 3> true_tip_p_WT_m{kNaN, kNaN, kNaN};    ///< of the simulated robot
  std::array<double, 3> contact_force_W_N{kNaN, kNaN, kNaN};  ///< likewise
  std::array<double, 3> base_W{};                             ///< odometry: x, y, yaw
  double stiffness_N_per_m = 0.0;
  std::array<double, 3> spring_W_N{};
  std::array<double, 6> wrench_W{};
  std::array<double, 3> grip_p_HD_m{};
  std::array<double, 4> grip_q_HD{};
  std::array<double, 3> grip_v_HD_m_per_s{};
  std::array<double, 3> grip_force_H_N{};  ///< told to the device now
  std::array<double, 3> held_force_H_N{};  ///< by the device since the last sample
  double grip_age_s = 0.0;
  std::uint32_t buttons = 0;
  double tank_J = 0.0;
  double withheld_N = 0.0;                ///< from the hand, by the tank
  double port_energy_J = 0.0;             ///< given to the hand since the start
  double gripper_opening_m = kNaN;        ///< commanded; NaN: as it is
  std::array<double, kJoints> command{};  ///< N·m, rad or rad/s, as `arm_mode` says of the arm's
  std::uint8_t arm_mode = 0;              ///< control::TeleopOutput::Arm
  std::array<double, kJoints> position_rad{};
  std::array<double, kJoints> torque_measured_Nm{};
  std::chrono::nanoseconds wake_up{};  ///< after its deadline
  std::chrono::nanoseconds step{};     ///< time the cycle took
};
static_assert(std::is_trivially_copyable_v<TeleopRecord>);

}  // namespace youbotd
