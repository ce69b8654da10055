/// @file
/// All data of one cycle: recorded, kept for a fault report and summarised.
#pragma once
#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <type_traits>

#include "runtime/task.h"

namespace operation {

inline constexpr std::size_t kWheels = 4;

using runtime::Phase;

/// What was limited in a cycle: bits, as in the recordings' column `limited`.
namespace limiter {
inline constexpr std::uint8_t kEffort = 1;      ///< a force, moment or torque
inline constexpr std::uint8_t kTorqueRate = 2;  ///< the rate of a torque
inline constexpr std::uint8_t kWorkspace = 4;   ///< a set-point, at a workspace limit
inline constexpr std::uint8_t kSetpoint = 8;    ///< a set-point's speed, acceleration or jerk
}  // namespace limiter

/// SI, wheels in bus order, planar values ordered x, y, yaw. The torque command acts from this sample's time
/// on.
struct CycleRecord {
  static constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
  static constexpr std::array<double, 3> kUnknown{kNaN, kNaN, kNaN};

  std::chrono::nanoseconds time{};  ///< since the first cycle
  Phase phase = Phase::kStarting;
  std::uint8_t limited = 0;  ///< bits of `limiter`
  std::array<double, 4> torque_command_Nm{};
  std::array<double, 4> torque_measured_Nm{};
  std::array<double, 4> position_rad{};
  std::array<double, 4> velocity_rad_per_s{};           ///< filtered from the position
  std::array<double, 4> reported_velocity_rad_per_s{};  ///< the motor controllers' own
  std::array<double, 4> friction_factor{1, 1, 1, 1};    ///< of each wheel's model in the compensation
  std::array<double, 3> reference_W = kUnknown;         ///< NaN without a reference
  std::array<double, 3> odometry_W{};
  std::array<double, 3> truth_W = kUnknown;  ///< of the simulated base; NaN for a real robot
  std::array<double, 3> wrench_B{};
  std::chrono::nanoseconds wake_up{};  ///< after its deadline
  std::chrono::nanoseconds step{};     ///< time the cycle took
};
static_assert(std::is_trivially_copyable_v<CycleRecord>);

/// The columns of base.csv and of the fault report, see runtime/recording/record_rows.h.
template <typename Column>
void visit(const CycleRecord& r, Column&& column) {
  const auto vector = [&column](const char* name, const std::array<const char*, 3>& ends,
                                const std::array<double, 3>& numbers, int decimals) {
    for (std::size_t i = 0; i < 3; ++i) column(name, ends[i], numbers[i], decimals);
  };
  constexpr std::array<const char*, 3> kPose{"_x_m", "_y_m", "_yaw_rad"};
  constexpr std::array<const char*, kWheels> kWheelNames{"wheel_1", "wheel_2", "wheel_3", "wheel_4"};
  column("time_s", "", std::chrono::duration<double>(r.time).count(), 6);
  column("phase", "", static_cast<double>(r.phase), 0);
  column("limited", "", r.limited, 0);
  vector("reference", kPose, r.reference_W, 6);
  vector("odometry", kPose, r.odometry_W, 6);
  vector("truth", kPose, r.truth_W, 6);
  vector("", {"force_x_N", "force_y_N", "moment_Nm"}, r.wrench_B, 4);
  for (std::size_t i = 0; i < kWheels; ++i) {
    column(kWheelNames[i], "_torque_command_Nm", r.torque_command_Nm[i], 6);
    column(kWheelNames[i], "_torque_measured_Nm", r.torque_measured_Nm[i], 6);
    column(kWheelNames[i], "_position_rad", r.position_rad[i], 7);
    column(kWheelNames[i], "_velocity_rad_per_s", r.velocity_rad_per_s[i], 6);
    column(kWheelNames[i], "_reported_velocity_rad_per_s", r.reported_velocity_rad_per_s[i], 6);
    column(kWheelNames[i], "_friction_factor", r.friction_factor[i], 4);
  }
  column("wake_up_us", "", std::chrono::duration<double, std::micro>(r.wake_up).count(), 3);
  column("step_us", "", std::chrono::duration<double, std::micro>(r.step).count(), 3);
}

/// One wheel of a record: the columns of wheel-1.csv to wheel-4.csv.
struct WheelOfRecord {
  const CycleRecord& record;
  std::size_t wheel;
};
template <typename Column>
void visit(const WheelOfRecord& of, Column&& column) {
  const CycleRecord& r = of.record;
  column("time_s", "", std::chrono::duration<double>(r.time).count(), 6);
  column("torque_command_Nm", "", r.torque_command_Nm[of.wheel], 6);
  column("torque_measured_Nm", "", r.torque_measured_Nm[of.wheel], 6);
  column("position_rad", "", r.position_rad[of.wheel], 7);
  column("velocity_rad_per_s", "", r.velocity_rad_per_s[of.wheel], 6);
}

}  // namespace operation
