/// @file
/// Control interface of the stand-in for the vendor's libdrd: a shared library of our own that exports the
/// vendor's symbols and behaves as its documentation and users describe (modes, watchdog, limits). Its time
/// is virtual: nothing moves except in advance(), in calibration, and in calls that take time.
///
/// It is a test artifact under a name that no search path contains; load it by its path, then look up
/// kStandInControl. Unpublished behaviour is a guess and marked [G], the worst case where a force is
/// involved. One thread, except for hold() and held().
#pragma once
#include <array>
#include <atomic>
#include <cstdint>

namespace sim::devices {

using Axes = std::array<double, 3>;  ///< x towards the operator, y to the operator's right, z up

/// Configuration and faults of the device. A test may change it at any time.
struct ForceDimensionScript {
  bool connected = true;       ///< to the USB bus; false in mid-run: unplugged
  bool powered = true;         ///< without it calibration and watchdog are lost, the latter is then off [G]
  bool held_by_other = false;  ///< counted, not available
  int type = 34;
  std::uint16_t serial = 4711;
  double firmware = 3.2;  ///< below 3.0 there is no watchdog
  int error = 0;          ///< the status' error slot
  bool calibrated = true;
  bool drd_agrees = true;  ///< false: drdIsInitialized denies the calibration
  bool wrist_calibrated = true;
  bool calibration_fails = false;           ///< before anything moves
  bool calibration_fails_half_way = false;  ///< with the regulation left running [G]
  double calibration_s = 4.0;
  /// drd... fails on a device that drdOpenID has not opened, dhdClose on one that it has [G].
  bool drd_needs_its_own_open = true;
  bool drd_counts_otherwise = false;                 ///< drdOpenID numbers the devices in reverse order [G]
  std::uint32_t velocity_threshold_mm_per_s = 1500;  ///< 0: off [G]
  int time_guard_us = 0;                             ///< the SDK's default [G]
  double effector_mass_kg = 0.25;                    ///< stored in the device [G]; fits the handle below

  std::uint32_t buttons = 0;
  Axes wrist_rad{};
  Axes hand_N{};            ///< pushes on the handle
  bool hand_holds = false;  ///< a spring and damper to hand_m, and the arm's mass
  Axes hand_m{};
  double hand_stiffness_N_per_m = 300.0;
  double hand_damping_N_s_per_m = 10.0;

  bool pose_is_nan = false;
  int nan_value = 1;                       ///< index: 0 to 2 the position, 3 to 11 the rotation by rows
  bool pose_is_stuck = false;              ///< the time guard never passes
  bool status_says_no_power = false;       ///< although the motors have power
  bool status_says_not_connected = false;  ///< likewise
  bool status_says_reset = false;          ///< likewise
  bool status_says_braked = false;         ///< likewise
  bool refuses_force_when_braked = false;  ///< whether dhdSetForce fails with the force off is not public
  bool brake_keeps_command = true;         ///< and enabling brings it back [G]
  bool close_keeps_mode = true;            ///< closing leaves the force on [G]
  bool refuses_to_enable = false;
  int watchdog_reads_back = -1;  ///< result of dhdGetWatchdog; negative: the set value
  int failing_stops = 0;         ///< number of dhdStop calls that fail, each decrements it
  int failing_drd_stops = 0;     ///< number of drdStop calls that fail
  int failing_poses = 0;         ///< number of pose reads that fail with `failing_code`
  int failing_forces = 0;        ///< number of force commands that fail with `failing_code`
  int failing_code = 7;          ///< time-out
  double status_delay_s = 0.0;   ///< delay of a mode change in the status [G]
};

enum class ForceDimensionMode : std::uint8_t { kReset, kIdle, kForce, kBrake };

/// State for tests.
struct ForceDimensionState {
  double time_s = 0.0;  ///< since reset()
  bool open = false;
  bool opened_by_drd = false;
  ForceDimensionMode mode = ForceDimensionMode::kBrake;
  int force_off_cause = 0;
  Axes position_m{};
  Axes velocity_m_per_s{};
  Axes command_N{};              ///< the last set-force, limited, without gravity compensation
  Axes brought_back_N{};         ///< the command that became active at the latest enabling
  Axes motor_N{};                ///< force of the motors on the handle now
  double largest_motor_N = 0.0;  ///< without gravity compensation, since reset()
  int watchdog_ticks = 0;
  double max_force_N = -1.0;  ///< negative: none
  double effector_mass_kg = 0.0;
  bool gravity_compensation = false;
  bool expert = false;      ///< one for all devices
  bool regulation = false;  ///< libdrd's thread: ends with drdStop only [G]
  long force_calls = 0;
  long stop_calls = 0;
  long velocity_threshold_writes = 0;
  long calibrations = 0;
};

/// All calls of the vendor's functions that can fail, on any device.
struct ForceDimensionCalls {
  long made = 0;               ///< since reset()
  long failing = 0;            ///< the number of the failing call; 0: none
  int failing_code = 7;        ///< time-out
  bool failing_works = false;  ///< the call has its effect, and only its result is an error
  double cost_s = 0.0;         ///< time that passes in each call before its effect
};

inline constexpr int kMaxStandInDevices = 2;

struct ForceDimensionControl {
  /// Resets the process: `devices` devices, the second one left-handed and with the next serial number.
  void (*reset)(int devices) noexcept;
  void (*set_sdk_version)(int major, int minor, int release, int revision) noexcept;
  void (*advance)(double seconds) noexcept;
  ForceDimensionScript* (*script)(int device) noexcept;
  const ForceDimensionState* (*state)(int device) noexcept;
  ForceDimensionCalls* (*calls)() noexcept;
  /// While true, calls block without effect until false. From any thread, as held().
  void (*hold)(bool on) noexcept;
  int (*held)() noexcept;  ///< number of calls blocked by hold()
};

/// extern "C" const ForceDimensionControl* fd_stand_in_control();
inline constexpr const char* kStandInControl = "fd_stand_in_control";
using StandInControlFunction = const ForceDimensionControl*();

/// For a complete program that loads the library, in which nothing calls the functions above: the environment
/// names a file of this size, which another process writes. Time then passes in real time, and a strong hand
/// moves the first device's handle as commanded.
struct DistantHand {
  std::array<std::atomic<double>, 3> p_HD_m;
  std::atomic<std::uint32_t> buttons;
};
static_assert(std::atomic<double>::is_always_lock_free);
inline constexpr const char* kDistantHandVariable = "FD_STAND_IN_DISTANT_HAND";

}  // namespace sim::devices
