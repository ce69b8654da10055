/// @file
/// One emulated omega.6: modes, watchdog, limits, and a handle that moves in space.
///
/// Per axis: m a = f_motor + f_hand - m g (z only) - b v - Coulomb. Motor force: a pole of 300 Hz after a
/// transport delay of 0.25 ms. All numbers are estimates [G]; the braked motors are a damper.
#pragma once
#include <cstdint>

#include "sim/devices/force_dimension_stand_in.h"

namespace sim::devices {

class StandInDevice {
 public:
  /// Called by the host side in any state.
  ForceDimensionScript script;
  ForceDimensionState state;

  void reset(const ForceDimensionScript& fresh);
  void open();
  void close();
  void advance(double seconds);

  bool reachable() const { return state.open && script.connected; }
  /// Moves the handle, for the script's time; afterwards the force stays on, regulated.
  void calibrate();
  void enable_force(bool on);
  void brake(int cause);
  /// True if the motors saturate.
  bool set_force(const Axes& force_N);
  /// True if the time guard returns the old sample.
  bool read_guarded();
  /// Rate of force commands since the last call [G].
  double force_rate_kHz();
  void set_time_guard(int guard_us) { time_guard_us_ = guard_us; }

  /// As reported by the SDK: one transfer old, in sensor steps, constant while not calibrated.
  Axes position_m() const { return guarded_position_m_; }
  Axes wrist_rad() const { return guarded_wrist_rad_; }
  ForceDimensionMode reported_mode() const;

 private:
  struct Transfer {
    Axes position_m{};
    Axes wrist_rad{};
  };

  void change_to(ForceDimensionMode mode);
  void lose_power();
  void step(double step_s);
  void move(double step_s);
  void transfer();

  double changed_s_ = 0.0;  ///< the mode
  ForceDimensionMode previous_mode_ = ForceDimensionMode::kBrake;
  double fed_s_ = 0.0;       ///< last force command
  double transfer_s_ = 0.0;  ///< last USB transfer
  double read_s_ = -1.0;     ///< last new sample
  double asked_s_ = 0.0;     ///< force_rate_kHz()
  long asked_calls_ = 0;
  int time_guard_us_ = 0;
  Axes target_N_{};    ///< not yet at the motors
  Axes arriving_N_{};  ///< after the transport delay
  Transfer transferred_;
  Transfer transferring_;
  Axes guarded_position_m_{};
  Axes guarded_wrist_rad_{};
};

}  // namespace sim::devices
