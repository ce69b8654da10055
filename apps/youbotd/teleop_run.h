/// @file
/// Base and arm by hand: a TeleopCycle with what records it and sums it up.
#pragma once
#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "apps/common/flight_recorder.h"
#include "apps/common/open_haptic.h"
#include "apps/youbotd/config.h"
#include "apps/youbotd/run.h"
#include "apps/youbotd/teleop_cycle.h"
#include "apps/youbotd/teleop_recording.h"
#include "sim/mobile_manipulator.h"
#include "sim/simulated_operator.h"

namespace youbotd {

struct TaskReport {
  std::string name;
  sim::TaskOutcome outcome;
};

struct TeleopSummary : RunSummary {
  std::string master;
  std::vector<std::string> master_warnings;
  std::vector<std::pair<control::TeleopPhase, std::chrono::nanoseconds>> phases;  ///< when each began
  std::vector<TaskReport> tasks;
  double largest_grip_force_N = 0.0;
  double most_energy_given_J = 0.0;  ///< to the hand, net since the start
  double furthest_base_m = 0.0;
  double largest_tip_error_m = 0.0;  ///< from the set-point, while the hand moved the robot
};

/// The pen of the loopback has an omega.6's travel. Beside a simulated robot it bears pauses.
apps::OpenedHaptic open_master(const Config& config, const hal::Clock& clock);

/// @throws std::invalid_argument when recording there would replace something.
void check_teleop_record_directory(const std::filesystem::path& directory);

class TeleopRun final : public Run {
 public:
  /// Robot, master, which is active, and `truth`, the simulated robot or null, outlive the run. `after_cycle`
  /// sees every cycle, as a part of it.
  /// @throws std::invalid_argument for a configuration that no part accepts, or a recording that would be
  ///         replaced.
  TeleopRun(const Config& config, const RunOptions& options, hal::Robot& robot, hal::HapticDevice& master,
            const sim::MobileManipulator* truth, std::function<void(const TeleopRecord&)> after_cycle = {});

  void step(std::chrono::nanoseconds now) noexcept override { cycle_.step(now); }
  void request_stop() noexcept override { cycle_.request_stop(); }
  void switch_off() noexcept override { cycle_.switch_off(); }
  bool finished() const noexcept override { return cycle_.finished(); }
  void keep() noexcept override;
  Progress progress() const noexcept override;
  std::optional<RecordingState> recording() const override {
    return recording_ ? std::optional(recording_->state()) : std::nullopt;
  }
  void wrap_up(const drivers::ethercat::PcapRing* frames) override;
  TeleopSummary& summary() noexcept override { return summary_; }

  control::TeleopPhase phase() const noexcept { return cycle_.phase(); }
  const Eigen::Isometry3d& X_WT() const noexcept { return cycle_.X_WT(); }  ///< from the joints

 private:
  void sum_up(const TeleopRecord& record) noexcept;

  RunOptions options_;
  hal::Robot& robot_;
  hal::HapticDevice& master_;
  const sim::MobileManipulator* truth_;
  TeleopSummary summary_;
  TeleopCycle cycle_;
  apps::FlightRecorder<TeleopRecord> flight_recorder_;
  std::unique_ptr<TeleopRecording> recording_;  // null when nothing is recorded
  std::function<void(const TeleopRecord&)> after_cycle_;
};

}  // namespace youbotd
