/// @file
/// The axis parameters of the youBot's motor controllers and of its gripper.
///
///   client.set(drive_parameter("maximum_motor_current"), 2850);   // a misspelt name does not compile
///
/// Numbers, names and protection from the official driver; ranges from the TMCM-1630 firmware manual (a
/// sister product) where it has the number, otherwise int32 as in that driver. Firmware before 2.0: KU Leuven
/// driver.
#pragma once
#include <array>
#include <cstdint>
#include <limits>
#include <string_view>

#include "drivers/tmcl/axis_parameter.h"

namespace drivers::tmcl {
namespace detail {

using enum Unit;
using enum Access;
using enum Protection;
using enum Generation;
inline constexpr std::int32_t kLow = std::numeric_limits<std::int32_t>::min();
inline constexpr std::int32_t kHigh = std::numeric_limits<std::int32_t>::max();

inline constexpr std::array kDriveRows = std::to_array<AxisParameter>({
    {0, "target_position", kTicks, kLow, kHigh, kReadWrite},
    {1, "actual_position", kTicks, kLow, kHigh, kReadWrite},  // writing sets the counter
    {2, "target_speed", kRpm, -200000, 200000, kReadWrite},
    {3, "actual_speed", kRpm, kLow, kHigh, kRead},
    {4, "maximum_positioning_velocity", kRpm, 0, 200000, kStored},
    {5, "pwm_limit", kNone, 0, kHigh, kReadWrite, kOpen, kBefore200},
    {6, "maximum_motor_current", kMilliampere, 0, 20000, kStored, kPassword},
    {7, "maximum_velocity_to_set_position", kRpm, 0, 200000, kStored},
    {8, "speed_control_switching_threshold", kRpm, kLow, kHigh, kStored},  // PID set 1 below; 0: set 2
    {9, "motor_halted_velocity", kRpm, 0, 200000, kStored, kPassword},
    {10, "position_target_reached_distance", kTicks, 0, 100000, kStored},
    {11, "motor_acceleration", kRpmPerSecond, 0, 100000, kStored},
    {12, "position_control_switching_threshold", kRpm, kLow, kHigh, kStored},
    {13, "ramp_generator_speed", kRpm, kLow, kHigh, kRead},
    {14, "velocity_threshold_for_hall_fx", kRpm, kLow, kHigh, kStored},
    {15, "initialize_joint", kSwitch, 0, 1, kReadWrite},  // writing 1 starts it; reads 1 when done
    {25, "thermal_winding_time_constant", kMillisecond, 0, kHigh, kStored, kPassword},
    {26, "i2t_limit", kNone, 0, kHigh, kStored, kPassword},  // I² in A² times ms; 211200 by default
    {27, "i2t_sum", kNone, 0, kHigh, kRead},
    {28, "i2t_exceed_counter", kNone, 0, kHigh, kStored, kPassword},
    {29, "clear_i2t_exceeded_flag", kNone, kLow, kHigh, kWrite},
    {30, "operational_time", kMinute, 0, kHigh, kStored, kPassword},
    {31, "reinitialize_bldc", kNone, kLow, kHigh, kWrite, kOpen, kUnverified},
    {90, "motor_controller_timeout", kMillisecond, 0, kHigh, kStored, kPassword},
    {130, "position_pid1_p", kNone, 0, kHigh, kStored},
    {131, "position_pid1_i", kNone, kLow, kHigh, kStored},
    {132, "position_pid1_d", kNone, kLow, kHigh, kStored},
    {133, "pid_control_time", kMillisecond, 0, 10, kStored, kPassword},
    {134, "current_control_loop_delay", kFiftyMicroseconds, 0, 10, kStored, kPassword},
    {135, "position_pid1_i_clipping", kPerMille, kLow, kHigh, kStored},  // of the maximum velocity
    {140, "velocity_pid1_p", kNone, kLow, kHigh, kStored},
    {141, "velocity_pid1_i", kNone, kLow, kHigh, kStored},
    {142, "velocity_pid1_d", kNone, kLow, kHigh, kStored},
    {143, "velocity_pid1_i_clipping", kPerMille, kLow, kHigh, kStored},
    {146, "ramp_generator_enabled", kSwitch, 0, 1, kStored},
    {150, "actual_motor_current", kMilliampere, kLow, kHigh, kRead},
    {151, "actual_motor_voltage", kCentivolt, kLow, kHigh, kRead},
    {152, "motor_driver_temperature", kAdcCounts, kLow, kHigh, kRead},
    {153, "actual_pwm", kPwmCounts, kLow, kHigh, kRead, kOpen, kBefore200},
    {154, "target_pwm", kPwmCounts, -1799, 1799, kReadWrite, kOpen, kBefore200},
    {155, "target_current", kMilliampere, -20000, 20000, kReadWrite},
    {156, "error_and_status", kNone, kLow, kHigh, kRead},  // see StatusFlags
    {157, "module_supply_current", kMilliampere, kLow, kHigh, kRead},
    {158, "clear_motor_controller_timeout_flag", kNone, kLow, kHigh, kWrite},
    {159, "commutation_mode", kNone, 0, 8, kStored, kPassword},  // 6 to 8: the sister only
    {160, "sine_reinitialization_state", kNone, kLow, kHigh, kRead, kOpen, kBefore200},
    {161, "zero_at_next_n_channel", kSwitch, 0, 1, kStored, kPassword},
    {162, "zero_at_next_switch", kSwitch, 0, 1, kStored, kPassword},
    {163, "zero_only_once", kSwitch, 0, 1, kStored, kPassword},
    {164, "encoder_stop_switch", kNone, 0, 3, kStored, kPassword},
    {165, "actual_commutation_offset", kNone, 0, 65535, kStored, kPassword},
    {166, "stop_switch_polarity", kNone, 0, 3, kStored, kPassword},
    {167, "block_pwm_scheme", kNone, 0, 2, kStored, kOpen, kBefore200},
    {168, "current_pid1_p", kNone, kLow, kHigh, kStored, kOpen, kBefore200},
    {169, "current_pid1_i", kNone, kLow, kHigh, kStored, kOpen, kBefore200},
    {170, "current_pid1_d", kNone, kLow, kHigh, kStored, kOpen, kBefore200},
    {171, "current_pid1_i_clipping", kPerMille, kLow, kHigh, kStored, kOpen, kBefore200},
    {172, "current_pid2_p", kNone, 0, 65535, kStored},  // the only set in firmware 2.0
    {173, "current_pid2_i", kNone, 0, 65535, kStored},
    {174, "current_pid2_d", kNone, 0, 65535, kStored},
    {175, "current_pid2_i_clipping", kPerMille, 0, 65535, kStored},  // of the PWM limit
    {176, "current_control_switching_threshold", kNone, kLow, kHigh, kStored, kOpen, kBefore200},
    {177, "commutation_motor_current", kMilliampere, 0, 20000, kStored, kPassword},
    {200, "current_error", kMilliampere, kLow, kHigh, kRead},
    {201, "current_error_sum", kNone, kLow, kHigh, kRead},
    {209, "encoder_count", kTicks, kLow, kHigh, kRead},
    {210, "hall_angle", kNone, kLow, kHigh, kRead},
    {211, "encoder_angle", kNone, kLow, kHigh, kRead},  // motor gear ratio in early firmware
    {212, "controlled_angle", kNone, kLow, kHigh, kRead},
    {226, "position_error", kTicks, kLow, kHigh, kRead},
    {227, "position_error_sum", kNone, kLow, kHigh, kRead},
    {228, "velocity_error", kRpm, kLow, kHigh, kRead},
    {229, "velocity_error_sum", kNone, kLow, kHigh, kRead},
    // 230 to 233: open in the official driver, though some board may answer "protected".
    {230, "position_pid2_p", kNone, 0, 65535, kStored},
    {231, "position_pid2_i", kNone, 0, 65535, kStored},
    {232, "position_pid2_d", kNone, 0, 65535, kStored},
    {233, "position_pid2_i_clipping", kPerMille, 0, 65535, kStored},
    {234, "velocity_pid2_p", kNone, 0, 65535, kStored},
    {235, "velocity_pid2_i", kNone, 0, 65535, kStored},
    {236, "velocity_pid2_d", kNone, 0, 65535, kStored},
    {237, "velocity_pid2_i_clipping", kPerMille, 0, 65535, kStored},
    {238, "mass_inertia_constant", kNone, kLow, kHigh, kStored, kPassword},
    {239, "bemf_constant", kNone, kLow, kHigh, kStored, kPassword},
    {240, "motor_coil_resistance", kMilliohm, kLow, kHigh, kStored, kPassword},
    {241, "sine_initialization_velocity", kRpm, kLow, kHigh, kStored, kPassword},
    {242, "init_block_offset_cw", kNone, kLow, kHigh, kStored, kPassword, kBefore200},
    {243, "init_block_offset_ccw", kNone, kLow, kHigh, kStored, kPassword, kBefore200},
    {244, "init_sine_delay", kMillisecond, 0, 10000, kStored, kPassword},  // driver: ±32.767 s
    {245, "overvoltage_protection", kSwitch, 0, 1, kStored, kPassword},
    {248, "approve_protected_parameters", kNone, kLow, kHigh, kWrite},  // takes the password; 0 locks again
    {249, "initialization_mode", kNone, 0, 2, kStored, kPassword},
    {250, "encoder_resolution", kTicks, 0, 65535, kStored, kPassword},  // 4000
    {251, "reversing_encoder_direction", kSwitch, 0, 1, kStored, kPassword},
    {252, "encoder_null_polarity", kSwitch, 0, 1, kStored, kPassword, kBefore200},
    {253, "motor_poles", kNone, 2, 254, kStored, kPassword},  // 16; arm joint 5: 8
    {254, "hall_sensor_polarity_reversal", kSwitch, 0, 1, kStored, kPassword},
});

constexpr AxisParameter gripper_row(std::uint8_t number, std::string_view name, Unit unit, std::int32_t min,
                                    std::int32_t max, Access access = kReadWrite) noexcept {
  return {number, name, unit, min, max, access, kOpen, kAll, kGripperModule};
}

// Ranges of the official driver. It is not documented which parameters the gripper stores in EEPROM, so none
// is kStored.
inline constexpr std::array kGripperRows = std::to_array<AxisParameter>({
    gripper_row(0, "target_position", kMicrosteps, kLow, kHigh),
    gripper_row(1, "actual_position", kMicrosteps, kLow, kHigh),
    gripper_row(2, "target_velocity", kNone, kLow, kHigh),
    gripper_row(3, "actual_velocity", kNone, kLow, kHigh, kRead),
    gripper_row(4, "maximum_positioning_speed", kNone, 0, 2047),
    gripper_row(5, "maximum_acceleration", kNone, 0, 2047),
    gripper_row(6, "maximum_current", kNone, 0, 255),
    gripper_row(7, "standby_current", kNone, 0, 255),
    gripper_row(8, "target_position_reached", kSwitch, 0, 1, kRead),
    gripper_row(130, "minimum_speed", kNone, 0, 2047),
    gripper_row(135, "actual_acceleration", kNone, 0, 2047, kRead),
    gripper_row(138, "ramp_mode", kNone, 0, 2),
    gripper_row(140, "microstep_resolution", kNone, 0, 8),
    gripper_row(153, "ramp_divisor", kNone, 0, 13),
    gripper_row(154, "pulse_divisor", kNone, 0, 13),
    gripper_row(160, "step_interpolation_enable", kSwitch, 0, 1),
    gripper_row(161, "double_step_enable", kSwitch, 0, 1),
    gripper_row(162, "chopper_blank_time", kNone, 0, 3),
    gripper_row(163, "chopper_mode", kSwitch, 0, 1),
    gripper_row(164, "chopper_hysteresis_decrement", kNone, 0, 3),
    gripper_row(165, "chopper_hysteresis_end", kNone, -3, 12),
    gripper_row(166, "chopper_hysteresis_start", kNone, 0, 8),
    gripper_row(167, "chopper_off_time", kNone, 0, 15),
    gripper_row(168, "smart_energy_current_minimum", kNone, 0, 1),
    gripper_row(169, "smart_energy_current_down_step", kNone, 0, 3),
    gripper_row(170, "smart_energy_hysteresis", kNone, 0, 15),
    gripper_row(171, "smart_energy_current_up_step", kNone, 1, 3),
    gripper_row(172, "smart_energy_hysteresis_start", kNone, 0, 15),
    gripper_row(173, "stall_guard_filter_enable", kSwitch, 0, 1),
    gripper_row(174, "stall_guard_threshold", kNone, -64, 63),
    gripper_row(175, "slope_control_high_side", kNone, 0, 3),
    gripper_row(176, "slope_control_low_side", kNone, 0, 3),
    gripper_row(177, "short_protection_disable", kSwitch, 0, 1),
    gripper_row(178, "short_detection_timer", kNone, 0, 3),
    gripper_row(179, "vsense", kSwitch, 0, 1),
    gripper_row(180, "smart_energy_actual_current", kNone, 0, 31, kRead),
    gripper_row(181, "stop_on_stall", kNone, kLow, kHigh),
    gripper_row(182, "smart_energy_threshold_speed", kNone, 0, 2047),
    gripper_row(183, "smart_energy_slow_run_current", kNone, 0, 255),
    gripper_row(204, "freewheeling", kNone, 0, 65535),
    gripper_row(206, "actual_load_value", kNone, 0, 1023, kRead),
    gripper_row(208, "error_flags", kNone, kLow, kHigh, kRead),  // see GripperFlag
    gripper_row(214, "power_down_delay", kNone, 1, 65535),
});

template <typename Table>
constexpr const AxisParameter* find(const Table& table, std::uint8_t number) noexcept {
  for (const AxisParameter& row : table) {
    if (row.number == number) return &row;
  }
  return nullptr;
}
template <typename Table>
constexpr const AxisParameter* find(const Table& table, std::string_view name) noexcept {
  for (const AxisParameter& row : table) {
    if (row.name == name) return &row;
  }
  return nullptr;
}
void no_axis_parameter_has_this_name();  // not constexpr: reaching it does not compile
template <typename Table>
consteval const AxisParameter& require(const Table& table, std::string_view name) {
  for (const AxisParameter& row : table) {
    if (row.name == name) return row;
  }
  no_axis_parameter_has_this_name();
  return table.front();
}

}  // namespace detail

inline constexpr const auto& kDriveParameters = detail::kDriveRows;      ///< module 0, by number
inline constexpr const auto& kGripperParameters = detail::kGripperRows;  ///< module 1, by number

/// Null if there is none.
constexpr const AxisParameter* find_drive_parameter(std::uint8_t number) noexcept {
  return detail::find(kDriveParameters, number);
}
constexpr const AxisParameter* find_drive_parameter(std::string_view name) noexcept {
  return detail::find(kDriveParameters, name);
}
constexpr const AxisParameter* find_gripper_parameter(std::uint8_t number) noexcept {
  return detail::find(kGripperParameters, number);
}
constexpr const AxisParameter* find_gripper_parameter(std::string_view name) noexcept {
  return detail::find(kGripperParameters, name);
}

/// Looked up at compile time.
consteval const AxisParameter& drive_parameter(std::string_view name) {
  return detail::require(kDriveParameters, name);
}
consteval const AxisParameter& gripper_parameter(std::string_view name) {
  return detail::require(kGripperParameters, name);
}

}  // namespace drivers::tmcl
