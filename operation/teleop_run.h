/// @file
/// Teleoperation of base and arm: a TeleopCycle with recording and summary.
#pragma once
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "operation/recorded_run.h"
#include "operation/teleop_task.h"
#include "runtime/open_haptic.h"
#include "sim/mobile_manipulator.h"
#include "sim/simulated_operator.h"

namespace operation {

struct TaskReport {
  std::string name;
  sim::TaskOutcome outcome;
};

struct TeleopSummary : RunSummary {
  std::string master;
  std::vector<std::string> master_warnings;
  std::vector<std::pair<control::TeleopPhase, std::chrono::nanoseconds>> phases;  ///< start of each
  std::vector<TaskReport> tasks;
  double largest_grip_force_N = 0.0;
  double most_energy_given_J = 0.0;  ///< to the hand, net since the start
  double furthest_base_m = 0.0;
  double largest_tip_error_m = 0.0;  ///< from the set-point, while the hand moved the robot
};

/// The handle of the loopback has an omega.6's travel. With a simulated robot it tolerates pauses.
runtime::OpenedHaptic open_master(const Config& config, const hal::Clock& clock);

class TeleopRun final : public RecordedRun<TeleopCycle, TeleopRecord, TeleopSummary> {
 public:
  /// Robot, haptic device (already active) and `truth`, the simulated robot or null, must outlive the run.
  /// `after_cycle` is called in every cycle, as a part of it.
  /// @throws std::invalid_argument for an invalid configuration, or if a recording would be replaced;
  /// hal::SetupError if the record directory cannot be used.
  TeleopRun(const Config& config, const RunOptions& options, hal::Robot& robot, hal::HapticDevice& master,
            const sim::MobileManipulator* truth, std::function<void(const TeleopRecord&)> after_cycle = {});

  Progress progress() const noexcept override;
  std::span<const std::string_view> tunable() const override;
  void tune(std::string_view key, const Config& config) override;
  control::TeleopPhase phase() const noexcept { return cycle_.task().phase(); }
  const Eigen::Isometry3d& X_WT() const noexcept { return cycle_.task().X_WT(); }  ///< from the joints

 private:
  static Around around(const Config& config, const RunOptions& options, const hal::Robot& robot,
                       bool simulated, std::function<void(const TeleopRecord&)> after_cycle);
  bool sum_up(TeleopRecord& record) noexcept override;
  std::string stop_reason() override;

  Config tuned_;  // as at the start, but for what was tuned since
  hal::Robot& robot_;
  hal::HapticDevice& master_;
  const sim::MobileManipulator* truth_;
};

}  // namespace operation
