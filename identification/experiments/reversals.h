/// @file
/// Alternating velocity in shrinking triangles: friction at and after a reversal.
#pragma once
#include <vector>

#include "identification/experiments/joint_experiment.h"
#include "identification/experiments/parameter.h"

namespace identification::experiments {

struct ReversalsConfig {
  double highest_rad_per_s = 8.0;  ///< of the first triangles
  double lowest_rad_per_s = 0.25;  ///< minimum height
  double shrink = 3.0;             ///< ratio of one height to the next
  double period_s = 4.0;
  int periods = 2;  ///< of each height
  int repeats = 1;

  template <typename Visitor>
  void visit(Visitor&& v) {
    v(Parameter{"highest_rad_per_s", "height of the first triangles", 0.01, 30}, highest_rad_per_s);
    v(Parameter{"lowest_rad_per_s", "minimum height of a triangle", 0.001, 30}, lowest_rad_per_s);
    v(Parameter{"shrink", "ratio of one height to the next", 1.1, 1000}, shrink);
    v(Parameter{"period_s", "duration of a triangle and its mirror image", 0.1, 600}, period_s);
    v(Parameter{"periods", "periods of each height", 1, 1000}, periods);
    v(Parameter{"repeats", "repetitions of the whole experiment", 1, 1000}, repeats);
  }
};

/// A measurement is one run through all heights; each period goes 0 → height → −height → 0. The recording is
/// the result.
class Reversals final : public JointExperiment {
 public:
  /// @throws std::invalid_argument naming the value out of range, or if lowest is above highest.
  explicit Reversals(const ReversalsConfig& config);

  const std::vector<double>& heights_rad_per_s() const noexcept { return heights_rad_per_s_; }

  RecordedCommands recorded_commands() const noexcept override { return {.velocity = true}; }
  int measurement_count() const noexcept override { return config_.repeats; }
  double duration_s(int measurement) const noexcept override;
  void begin(int measurement, const Reading& reading) noexcept override;
  SetPoint step(const Reading& reading) noexcept override;
  bool finished() const noexcept override { return finished_; }

 private:
  ReversalsConfig config_;
  std::vector<double> heights_rad_per_s_;
  bool finished_ = false;
};

}  // namespace identification::experiments
