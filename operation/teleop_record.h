/// @file
/// All data of one cycle of teleoperation.
#pragma once
#include <Eigen/Core>
#include <array>
#include <chrono>
#include <cstdint>
#include <type_traits>

#include "control/teleoperation.h"
#include "operation/cycle_record.h"

namespace operation {

/// SI; frames as in control/robot_model.h and hal/haptic_sample.h, quaternions ordered w, x, y, z, joints as
/// in hal::Robot: wheels, then arm. Commands act from this sample's time on; measured values answer the
/// previous row. Plain numbers, because it crosses threads.
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
  std::array<double, 3> contact_estimate_W_N{};               ///< from the torques of the arm
  std::array<double, 3> base_W{};                             ///< odometry: x, y, yaw
  double stiffness_N_per_m = 0.0;
  double force_scale = kNaN;   ///< set now: force on the end effector over force on the hand
  double motion_scale = kNaN;  ///< set now: end effector displacement over handle displacement
  std::array<double, 3> spring_W_N{};
  std::array<double, 6> wrench_W{};
  std::array<double, 3> grip_p_HD_m{};
  std::array<double, 4> grip_q_HD{};
  std::array<double, 3> grip_v_HD_m_per_s{};
  std::array<double, 3> grip_force_H_N{};  ///< commanded now
  std::array<double, 3> held_force_H_N{};  ///< held by the device since the last sample
  double grip_age_s = 0.0;
  std::uint32_t buttons = 0;
  double tank_J = 0.0;
  double withheld_N = 0.0;                ///< from the hand, by the energy tank
  double port_energy_J = 0.0;             ///< delivered to the hand since the start
  double gripper_opening_m = kNaN;        ///< commanded; NaN: no gripper command
  std::array<double, kJoints> command{};  ///< N·m, rad or rad/s; for the arm see `arm_mode`
  std::uint8_t arm_mode = 0;              ///< control::TeleopOutput::Arm
  std::array<double, kJoints> position_rad{};
  std::array<double, kJoints> torque_measured_Nm{};
  std::chrono::nanoseconds wake_up{};  ///< after its deadline
  std::chrono::nanoseconds step{};     ///< time the cycle took
};
static_assert(std::is_trivially_copyable_v<TeleopRecord>);

inline Eigen::Vector3d vector_of(const std::array<double, 3>& values) noexcept {
  return Eigen::Vector3d(values.data());
}

/// Values known only in simulation.
inline void add_truth(TeleopRecord& record, const Eigen::Vector3d& p_WT_m,
                      const Eigen::Vector3d& contact_force_W_N) noexcept {
  record.true_tip_p_WT_m = {p_WT_m.x(), p_WT_m.y(), p_WT_m.z()};
  record.contact_force_W_N = {contact_force_W_N.x(), contact_force_W_N.y(), contact_force_W_N.z()};
}

/// The columns of teleoperation.csv and of the fault report, see runtime/recording/record_rows.h.
template <typename Column>
void visit(const TeleopRecord& r, Column&& column) {
  const auto plain = [&column](const char* name, double number, int decimals) {
    column(name, "", number, decimals);
  };
  const auto vector = [&column](const char* name, const std::array<const char*, 3>& ends, const auto& numbers,
                                int decimals) {
    for (std::size_t i = 0; i < 3; ++i) column(name, ends[i], numbers[i], decimals);
  };
  const auto rotation = [&column](const char* name, const auto& numbers) {
    constexpr std::array<const char*, 4> kParts{"_qw", "_qx", "_qy", "_qz"};
    for (std::size_t i = 0; i < 4; ++i) column(name, kParts[i], numbers[i], 6);
  };
  constexpr std::array<const char*, 3> kMetres{"_x_m", "_y_m", "_z_m"};
  constexpr std::array<const char*, 3> kNewtons{"_x_N", "_y_N", "_z_N"};
  constexpr std::array<const char*, TeleopRecord::kJoints> kJointNames{
      "wheel_1", "wheel_2", "wheel_3", "wheel_4", "arm_1", "arm_2", "arm_3", "arm_4", "arm_5"};
  plain("time_s", std::chrono::duration<double>(r.time).count(), 6);
  plain("phase", static_cast<double>(r.phase), 0);
  plain("rate_control", r.rate_control, 0);
  plain("clutched", r.clutched, 0);
  plain("limited", r.limited, 0);
  plain("protecting", r.protecting, 0);
  vector("setpoint", kMetres, r.setpoint_p_WT_m, 6);
  rotation("setpoint", r.setpoint_q_WT);
  vector("tip", kMetres, r.tip_p_WT_m, 6);
  rotation("tip", r.tip_q_WT);
  vector("true_tip", kMetres, r.true_tip_p_WT_m, 6);
  vector("contact_force", kNewtons, r.contact_force_W_N, 4);
  vector("contact_estimate", kNewtons, r.contact_estimate_W_N, 4);
  vector("base", {"_x_m", "_y_m", "_yaw_rad"}, r.base_W, 6);
  plain("stiffness_N_per_m", r.stiffness_N_per_m, 2);
  plain("force_scale", r.force_scale, 4);
  plain("motion_scale", r.motion_scale, 4);
  vector("spring", kNewtons, r.spring_W_N, 4);
  vector("wrench_force", kNewtons, std::array{r.wrench_W[0], r.wrench_W[1], r.wrench_W[2]}, 4);
  vector("wrench_moment", {"_x_Nm", "_y_Nm", "_z_Nm"},
         std::array{r.wrench_W[3], r.wrench_W[4], r.wrench_W[5]}, 4);
  vector("grip", kMetres, r.grip_p_HD_m, 6);
  rotation("grip", r.grip_q_HD);
  vector("grip_velocity", {"_x_m_per_s", "_y_m_per_s", "_z_m_per_s"}, r.grip_v_HD_m_per_s, 5);
  vector("grip_force_command", kNewtons, r.grip_force_H_N, 4);
  vector("grip_force_held", kNewtons, r.held_force_H_N, 4);
  plain("grip_age_s", r.grip_age_s, 6);
  plain("buttons", static_cast<double>(r.buttons), 0);
  plain("tank_J", r.tank_J, 6);
  plain("withheld_N", r.withheld_N, 4);
  plain("port_energy_J", r.port_energy_J, 6);
  plain("gripper_opening_m", r.gripper_opening_m, 4);
  plain("arm_mode", static_cast<double>(r.arm_mode), 0);
  for (std::size_t i = 0; i < TeleopRecord::kJoints; ++i) {
    const bool wheel = i < 4;
    column(kJointNames[i], wheel ? "_torque_command_Nm" : "_command", r.command[i], 6);
    column(kJointNames[i], "_torque_measured_Nm", r.torque_measured_Nm[i], 6);
    column(kJointNames[i], "_position_rad", r.position_rad[i], 7);
  }
  plain("wake_up_us", std::chrono::duration<double, std::micro>(r.wake_up).count(), 3);
  plain("step_us", std::chrono::duration<double, std::micro>(r.step).count(), 3);
}

}  // namespace operation
