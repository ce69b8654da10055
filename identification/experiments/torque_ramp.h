/// @file
/// The first encoder step under a slow torque ramp, and the breakaway (thesis 2.5.2, figure 18, table 5).
#pragma once
#include "identification/experiments/joint_experiment.h"
#include "identification/experiments/low_pass.h"
#include "identification/experiments/parameter.h"

namespace identification::experiments {

/// σ0 = τ1/x1: torque at the first observed motion, over its displacement.
double presliding_stiffness_Nm_per_rad(double torque_Nm, double displacement_rad) noexcept;
/// σ1 = 0.2·√(J·σ0), the thesis' empirical rule. N·m·s/rad.
double presliding_damping_Nm_s_per_rad(double inertia_kg_m2, double stiffness_Nm_per_rad) noexcept;

struct TorqueRampConfig {
  double rest_s = 2.0;  ///< without torque before each ramp
  double rate_Nm_per_s = 0.002;
  double highest_torque_Nm = 0.3;      ///< end of a ramp without motion
  double breakaway_travel_rad = 0.02;  ///< far beyond presliding, 4e-4 rad: it slides
  double still_speed_rad_per_s =
      0.02;                       ///< below, it has not broken away yet; one encoder tick appears as 3 mrad/s
  double inertia_kg_m2 = 0.0107;  ///< for σ1: rotor through the gear, and wheel
  double torque_cutoff_rad_per_s = 20.0;  ///< the filtered torque lags by rate/cutoff: 0.1 mN·m
  int repeats = 3;                        ///< of a ramp in each direction

  template <typename Visitor>
  void visit(Visitor&& v) {
    v(Parameter{"rest_s", "minimum time without torque before each ramp", 0, 600}, rest_s);
    v(Parameter{"rate_Nm_per_s", "slope of the ramp", 1e-5, 10}, rate_Nm_per_s);
    v(Parameter{"highest_torque_Nm", "end of a ramp that has moved nothing", 0.001, 20}, highest_torque_Nm);
    v(Parameter{"breakaway_travel_rad", "travel that counts as sliding", 1e-4, 1}, breakaway_travel_rad);
    v(Parameter{"still_speed_rad_per_s", "a slower joint does not count as sliding", 1e-4, 1},
      still_speed_rad_per_s);
    v(Parameter{"inertia_kg_m2", "of the joint, for sigma 1", 1e-6, 10}, inertia_kg_m2);
    v(Parameter{"torque_cutoff_rad_per_s", "low-pass on the measured torque", 0.1, 1000},
      torque_cutoff_rad_per_s);
    v(Parameter{"repeats", "ramps in each direction", 1, 1000}, repeats);
  }
};

/// Even measurements ramp up, odd ones down; each starts with the joint at rest. The first step is the
/// displacement shown by the encoder, a whole tick. The rest position within its tick is unknown, so single
/// σ0 values scatter between zero and their full value; with evenly distributed rest positions, their mean is
/// half of it. The slope over the next steps, stiffness_slope, is free of that.
class TorqueRamp final : public JointExperiment {
 public:
  /// `encoder_step_rad`: one tick at the joint.
  TorqueRamp(const TorqueRampConfig& config, double encoder_step_rad, double period_s);

  RecordedCommands recorded_commands() const noexcept override { return {.torque = true}; }
  int measurement_count() const noexcept override { return 2 * config_.repeats; }
  double duration_s(int measurement) const noexcept override;
  void begin(int measurement, const Reading& reading) noexcept override;
  SetPoint step(const Reading& reading) noexcept override;
  bool finished() const noexcept override { return phase_ == Phase::kDone; }
  std::span<const char* const> result_columns() const noexcept override;
  void write_result(std::span<double> values) const noexcept override;
  std::string not_measured(std::size_t column) const override;
  double settle_s() const noexcept override { return config_.rest_s; }

 private:
  enum class Phase { kRest, kRamp, kDone };
  struct Moment {
    double displacement_rad = kUnknown;  ///< in the direction of the ramp
    double command_Nm = kUnknown;
    double measured_Nm = kUnknown;
  };
  void watch(const Reading& reading) noexcept;

  TorqueRampConfig config_;
  double encoder_step_rad_;
  LowPass torque_filter_;
  Phase phase_ = Phase::kRest;
  double direction_ = 1.0;
  double origin_rad_ = 0.0;
  double ramp_begin_s_ = 0.0;
  Moment first_step_;
  Moment last_step_;  ///< before sliding, of those used for the slope
  Moment still_;      ///< the last moment before sliding
  bool slid_ = false;
};

}  // namespace identification::experiments
