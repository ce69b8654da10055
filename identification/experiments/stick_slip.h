/// @file
/// A joint pulled by a soft spring sticks and slips where friction falls with speed.
#pragma once
#include <cstdint>

#include "identification/experiments/joint_experiment.h"
#include "identification/experiments/parameter.h"

namespace identification::experiments {

struct StickSlipConfig {
  double speed_rad_per_s = 0.05;      ///< v, of the spring's far end
  double stiffness_Nm_per_rad = 0.3;  ///< K
  double torque_limit_Nm = 0.5;
  double slip_speed_rad_per_s = 0.15;  ///< a slip is faster; it ends below half of this speed
  double duration_s = 60.0;
  double rest_s = 2.0;
  int repeats = 1;  ///< in each direction

  template <typename Visitor>
  void visit(Visitor&& v) {
    v(Parameter{"speed_rad_per_s", "of the spring's far end", 1e-4, 5}, speed_rad_per_s);
    v(Parameter{"stiffness_Nm_per_rad", "of the spring", 1e-3, 100}, stiffness_Nm_per_rad);
    v(Parameter{"torque_limit_Nm", "maximum torque of the spring", 1e-3, 20}, torque_limit_Nm);
    v(Parameter{"slip_speed_rad_per_s", "a faster joint counts as slipping", 1e-3, 20}, slip_speed_rad_per_s);
    v(Parameter{"duration_s", "duration of a pull", 1, 3600}, duration_s);
    v(Parameter{"rest_s", "time without torque beforehand", 0, 600}, rest_s);
    v(Parameter{"repeats", "pulls in each direction", 1, 1000}, repeats);
  }
};

/// u = K·(v·t − x), in software. Even measurements pull forward, odd ones back. Results: number of slips,
/// their mean distance, and the torque at which they begin; zero slips means steady sliding.
class StickSlip final : public JointExperiment {
 public:
  explicit StickSlip(const StickSlipConfig& config) : config_(checked(config)) {}

  RecordedCommands recorded_commands() const noexcept override { return {.torque = true, .position = true}; }
  int measurement_count() const noexcept override { return 2 * config_.repeats; }
  double duration_s(int measurement) const noexcept override;
  void begin(int measurement, const Reading& reading) noexcept override;
  SetPoint step(const Reading& reading) noexcept override;
  bool finished() const noexcept override { return finished_; }
  std::span<const char* const> result_columns() const noexcept override;
  void write_result(std::span<double> values) const noexcept override;
  std::string not_measured(std::size_t column) const override;
  double settle_s() const noexcept override { return config_.rest_s; }

 private:
  void watch(const Reading& reading) noexcept;

  StickSlipConfig config_;
  double direction_ = 1.0;
  double origin_rad_ = 0.0;
  bool slipping_ = false;
  std::int64_t slips_ = 0;  // finished ones
  double slip_begin_rad_ = 0.0;
  double slid_rad_ = 0.0;
  double held_Nm_ = 0.0;  // largest since the last slip
  double released_Nm_ = 0.0;
  bool finished_ = false;
};

}  // namespace identification::experiments
