/// @file
/// What the Force Dimension SDK (libdhd, libdrd, version 3) offers of what we use: its functions as pointers,
/// its numbers, and words for them. Nothing here calls or links the SDK.
///
/// Every function takes the device's id last, as a char; -1 would be the device opened last and is not used
/// here. The C++ default arguments of the vendor's headers do not exist behind a pointer: all are passed.
/// int results: see sdk_failed(). Metres, newtons, kilograms; the frame is the device's base H (x towards the
/// operator, y to the operator's right, z up). Source: the vendor's public headers 3.2 to 3.17.5.
#pragma once
#include <cstddef>
#include <cstdint>

namespace drivers::haptic {

/// Null where the library lacks the symbol: releases differ, so each is looked up for itself. The symbol
/// is the name with its prefix in front: dhdGetStatus, drdAutoInit.
struct SdkFunctions {
  // About the library and the calling thread.
  void (*get_sdk_version)(int* major, int* minor, int* release, int* revision) = nullptr;
  int (*error_get_last)() = nullptr;  ///< of the calling thread

  // Discovery. The first count includes devices that another program holds.
  int (*get_device_count)() = nullptr;
  int (*get_available_count)() = nullptr;
  int (*get_system_type)(char id) = nullptr;
  int (*get_serial_number)(std::uint16_t* serial, char id) = nullptr;
  int (*get_version)(double* firmware, char id) = nullptr;

  // The openers return an id, or -1.
  int (*open_id)(char index) = nullptr;
  int (*open_type)(int type) = nullptr;
  int (*open_serial)(int serial) = nullptr;
  int (*close)(char id) = nullptr;

  // State. The status has grown from 14 to 17 slots over the releases: see kStatusCapacity.
  int (*get_status)(int* status, char id) = nullptr;
  std::uint32_t (*get_button_mask)(char id) = nullptr;
  int (*get_button)(int index, char id) = nullptr;  ///< 1: down

  // Pose. Rotation by rows; never from angles, whose axes differ between devices.
  int (*get_position)(double* x_m, double* y_m, double* z_m, char id) = nullptr;
  int (*get_orientation_frame)(double rotation[3][3], char id) = nullptr;
  int (*get_position_and_orientation_frame)(double* x_m, double* y_m, double* z_m, double rotation[3][3],
                                            char id) = nullptr;

  // Force. Gravity compensation happens on the host, inside set_force only.
  int (*enable_force)(std::uint8_t on, char id) = nullptr;
  int (*stop)(char id) = nullptr;  ///< force off, brakes on
  int (*set_force)(double x_N, double y_N, double z_N, char id) = nullptr;
  int (*set_max_force)(double force_N, char id) = nullptr;
  int (*set_gravity_compensation)(int on, char id) = nullptr;
  int (*set_effector_mass)(double mass_kg, char id) = nullptr;

  // Calibration; drd_auto_init moves the handle. A device opened above is handed to libdrd by its number,
  // which the vendor documents for devices that are open already; from then on it is closed by drd_close.
  int (*drd_open_id)(char index) = nullptr;
  int (*drd_close)(char id) = nullptr;
  bool (*drd_is_initialized)(char id) = nullptr;
  int (*drd_auto_init)(char id) = nullptr;
  int (*drd_stop)(bool keep_force, char id) = nullptr;

  // Expert mode is one for the whole process; what is below needs it.
  int (*enable_expert_mode)() = nullptr;
  int (*disable_expert_mode)() = nullptr;
  int (*set_watchdog)(std::uint8_t ticks, char id) = nullptr;  ///< see kWatchdogTick_us; 0 is off
  int (*get_watchdog)(std::uint8_t* ticks, char id) = nullptr;
  /// The unit depends on the device. That the setter is not in this table is on purpose: the factory's
  /// threshold stays.
  int (*get_velocity_threshold)(std::uint32_t* threshold, char id) = nullptr;
  int (*set_time_guard)(int guard_us, char id) = nullptr;
};

/// Results. Only what is negative has failed; its code is error_get_last().
inline constexpr int kSdkTimeGuard = 1;       ///< asked sooner than the time guard allows: the old sample
inline constexpr int kSdkMotorSaturated = 2;  ///< all motors scaled down together: the direction is kept
constexpr bool sdk_failed(int result) noexcept { return result < 0; }

inline constexpr int kSdkErrorGeneric = 1;
inline constexpr int kSdkErrorCommunication = 2;
inline constexpr int kSdkErrorNoDevice = 5;
inline constexpr int kSdkErrorNotAvailable = 6;
inline constexpr int kSdkErrorNotReady = 12;
inline constexpr int kSdkErrorDeviceInUse = 20;
/// "communication error"; for a number outside 0..22 "unknown error".
const char* describe_sdk_error(int code) noexcept;

inline constexpr int kOmega6Right = 34;
inline constexpr int kOmega6Left = 36;
/// "omega.3"; "another device" for types that are not known here.
const char* describe_system_type(int type) noexcept;

/// More slots than any release is known to write.
inline constexpr std::size_t kStatusCapacity = 32;
namespace status_slot {
inline constexpr std::size_t kPower = 0;
inline constexpr std::size_t kConnected = 1;
inline constexpr std::size_t kReset = 3;  ///< waits for calibration
inline constexpr std::size_t kForce = 5;  ///< force is on
inline constexpr std::size_t kWristDetected = 8;
inline constexpr std::size_t kError = 9;
inline constexpr std::size_t kWristInitialised = 12;
inline constexpr std::size_t kForceOffCause = 14;  ///< see describe_force_off(); releases before 3.16 lack it
}  // namespace status_slot

inline constexpr int kForceOffVelocity = 2;
inline constexpr int kForceOffWatchdog = 3;
inline constexpr int kForceOffUnplugged = 5;
/// Why the device switched its force off: "an axis moved faster than the device's velocity threshold".
const char* describe_force_off(int cause) noexcept;

inline constexpr int kWatchdogTick_us = 125;
inline constexpr int kWatchdogMaxTicks = 255;
inline constexpr double kFirstFirmwareWithWatchdog = 3.0;

}  // namespace drivers::haptic
