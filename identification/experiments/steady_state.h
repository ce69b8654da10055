/// @file
/// Friction against velocity, one point at a time (thesis 2.5.1, figure 14, table 3).
#pragma once
#include <cstdint>
#include <string>
#include <vector>

#include "identification/experiments/block_mean.h"
#include "identification/experiments/joint_experiment.h"
#include "identification/experiments/low_pass.h"
#include "identification/experiments/parameter.h"

namespace identification::experiments {

struct SteadyStateConfig {
  double settle_s = 50.0;   ///< T1
  double measure_s = 30.0;  ///< T2
  double extra_s = 10.0;
  std::string sets = "1-9";
  double torque_cutoff_rad_per_s = 60.0;
  int blocks = 20;  ///< of the measuring time: 1.5 s each, far longer than the velocity loop's memory

  template <typename Visitor>
  void visit(Visitor&& v) {
    v(Parameter{"settle_s", "time at constant velocity before measuring (T1)", 0, 3600}, settle_s);
    v(Parameter{"measure_s", "time of measuring (T2)", 0.1, 3600}, measure_s);
    v(Parameter{"extra_s", "continue after measuring", 0, 3600}, extra_s);
    v(Parameter{"sets", "rows of the thesis' table 3, as 1,2,7-9"}, sets);
    v(Parameter{"torque_cutoff_rad_per_s", "low-pass on the measured torque", 0.1, 1000},
      torque_cutoff_rad_per_s);
    v(Parameter{"blocks", "blocks for the confidence interval", BlockMean::kFewestBlocks, 1000}, blocks);
  }
};

/// Velocity control; without acceleration the torque that holds the velocity equals the friction. One result
/// per measurement: mean velocity, mean torque with its confidence interval, velocity command. A joint that
/// turns at less than a tenth of the command is blocked: then there is neither a velocity nor a friction
/// result.
class SteadyState final : public JointExperiment {
 public:
  SteadyState(const SteadyStateConfig& config, double period_s);
  /// Other velocities than those of table 3; `config.sets` is not used.
  SteadyState(const SteadyStateConfig& config, std::vector<double> velocities_rad_per_s, double period_s);

  RecordedCommands recorded_commands() const noexcept override { return {.velocity = true}; }
  int measurement_count() const noexcept override { return static_cast<int>(velocities_.size()); }
  double duration_s(int measurement) const noexcept override;
  void begin(int measurement, const Reading& reading) noexcept override;
  SetPoint step(const Reading& reading) noexcept override;
  bool finished() const noexcept override { return finished_; }
  std::span<const char* const> result_columns() const noexcept override;
  void write_result(std::span<double> values) const noexcept override;
  std::string not_measured(std::size_t column) const override;
  double settle_s() const noexcept override { return config_.settle_s; }

 private:
  SteadyStateConfig config_;
  std::vector<double> velocities_;
  std::int64_t samples_per_block_;
  double velocity_command_ = 0.0;
  LowPass torque_filter_;
  BlockMean torque_;
  BlockMean velocity_;
  bool finished_ = false;
};

}  // namespace identification::experiments
