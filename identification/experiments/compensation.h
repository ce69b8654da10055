/// @file
/// Number of swings of a joint on a spring after a push, without and with friction compensation (thesis
/// 2.7.2).
#pragma once
#include <string>

#include "control/friction_compensator.h"
#include "control/friction_observer.h"
#include "identification/experiments/joint_experiment.h"
#include "identification/experiments/parameter.h"
#include "model/friction/sliding_table.h"

namespace identification::experiments {

struct CompensationConfig {
  double stiffness_Nm_per_rad = 1.0;  ///< Kp
  double reference_rad = 0;           ///< x_r, from the position at rest; 2 in the thesis
  double extra_torque_Nm = 0;         ///< constant; 0.01 in the thesis
  double push_Nm = 0.3;
  double push_duration_s = 0.2;
  double torque_limit_Nm = 2.0;
  double smallest_swing_rad = 0.02;  ///< ends the count
  double duration_s = 30.0;          ///< of one measurement, push and rest included
  double rest_s = 2.0;
  double margin = 0.95;
  double full_command_Nm = 0.01;
  double blend_speed_rad_per_s = 0.05;
  int repeats = 1;
  std::string compensator{};  ///< origin of the friction, for the code that creates it

  template <typename Visitor>
  void visit(Visitor&& v) {
    v(Parameter{"stiffness_Nm_per_rad", "of the spring, Kp", 1e-3, 100}, stiffness_Nm_per_rad);
    v(Parameter{"reference_rad", "where the spring is relaxed, from the position at rest", -100, 100},
      reference_rad);
    v(Parameter{"extra_torque_Nm", "constant torque beside the spring", -20, 20}, extra_torque_Nm);
    v(Parameter{"push_Nm", "torque of the push", 0, 20}, push_Nm);
    v(Parameter{"push_duration_s", "length of the push", 0.001, 10}, push_duration_s);
    v(Parameter{"torque_limit_Nm", "maximum of command and compensation together", 1e-3, 20},
      torque_limit_Nm);
    v(Parameter{"smallest_swing_rad", "smaller swings are not counted", 1e-4, 10}, smallest_swing_rad);
    v(Parameter{"duration_s", "duration of a measurement", 1, 3600}, duration_s);
    v(Parameter{"rest_s", "time without torque beforehand", 0, 600}, rest_s);
    v(Parameter{"margin", "share of friction that is compensated", 0, 1}, margin);
    v(Parameter{"full_command_Nm", "full compensation from this command on", 1e-4, 1}, full_command_Nm);
    v(Parameter{"blend_speed_rad_per_s", "below this speed its sign is uncertain", 0.005, 0.2},
      blend_speed_rad_per_s);
    v(Parameter{"repeats", "measurements without and with compensation", 1, 1000}, repeats);
    v(Parameter{"compensator",
                "friction that is compensated: a drive model file or a law such as kfm; none: the joint's "
                "measured curve"},
      compensator);
  }
};

/// u = −Kp·(x − x_r) + F̂ + u₀, one push, then free motion. Even measurements leave F̂ out, odd ones use
/// control::FrictionCompensator with the joint's friction curve. A swing is a half period: a turning point at
/// least `smallest_swing` from x_r. Without friction it would oscillate forever; friction F reduces each
/// swing by 2F/Kp.
class Compensation final : public JointExperiment {
 public:
  /// `passive_gain`: gain of the compensation relative to the assumed true friction, from
  /// model::friction::max_passive_gain(); recorded as a result.
  Compensation(const CompensationConfig& config, model::friction::SlidingTable friction, double passive_gain,
               double period_s);

  RecordedCommands recorded_commands() const noexcept override { return {.torque = true, .position = true}; }
  int measurement_count() const noexcept override { return 2 * config_.repeats; }
  double duration_s(int measurement) const noexcept override;
  void begin(int measurement, const Reading& reading) noexcept override;
  SetPoint step(const Reading& reading) noexcept override;
  bool finished() const noexcept override { return finished_; }
  std::span<const char* const> result_columns() const noexcept override;
  void write_result(std::span<double> values) const noexcept override;

 private:
  void count(double off_rad) noexcept;

  CompensationConfig config_;
  control::FrictionObserver observer_;
  control::FrictionCompensator compensator_;
  double passive_gain_;
  bool compensate_ = false;
  double reference_rad_ = 0.0;  // x_r
  double extreme_rad_ = 0.0;    // of the current swing
  double first_swing_rad_ = 0.0;
  double last_off_rad_ = 0.0;
  int swings_ = 0;
  bool finished_ = false;
};

}  // namespace identification::experiments
