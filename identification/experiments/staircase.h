/// @file
/// Steps up, down through zero and back, in torque or velocity: excitation to find what a model lacks.
#pragma once
#include <string>
#include <vector>

#include "identification/experiments/joint_experiment.h"
#include "identification/experiments/parameter.h"

namespace identification::experiments {

struct StaircaseConfig {
  std::string quantity = "torque";  ///< or "velocity"
  double step = 0.02;               ///< N·m or rad/s
  double highest = 0.14;            ///< N·m or rad/s
  double hold_s = 3.0;
  int repeats = 1;

  template <typename Visitor>
  void visit(Visitor&& v) {
    v(Parameter{"quantity", "what is stepped: torque or velocity"}, quantity);
    v(Parameter{"step", "height of a step, N·m or rad/s", 1e-4, 20}, step);
    v(Parameter{"highest", "last level, N·m or rad/s", 1e-4, 20}, highest);
    v(Parameter{"hold_s", "time on each level", 0.01, 600}, hold_s);
    v(Parameter{"repeats", "repetitions of the whole staircase", 1, 1000}, repeats);
  }
};

/// A measurement is one whole staircase: 0 → highest → 0 → −highest → 0. The recording is the result.
class Staircase final : public JointExperiment {
 public:
  explicit Staircase(const StaircaseConfig& config);

  const std::vector<double>& levels() const noexcept { return levels_; }

  RecordedCommands recorded_commands() const noexcept override {
    return {.torque = mode_ == hal::CommandMode::kTorque, .velocity = mode_ == hal::CommandMode::kVelocity};
  }
  int measurement_count() const noexcept override { return config_.repeats; }
  double duration_s(int measurement) const noexcept override;
  void begin(int measurement, const Reading& reading) noexcept override;
  SetPoint step(const Reading& reading) noexcept override;
  bool finished() const noexcept override { return finished_; }

 private:
  StaircaseConfig config_;
  hal::CommandMode mode_;
  std::vector<double> levels_;
  bool finished_ = false;
};

}  // namespace identification::experiments
