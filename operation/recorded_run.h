/// @file
/// Common part of runs around their cycle: recording with its page, summary, and the last second for a fault
/// report.
#pragma once
#include <chrono>
#include <cstddef>
#include <exception>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "operation/config.h"
#include "operation/live_feed.h"
#include "operation/run.h"
#include "operation/run_recording.h"
#include "operation/run_report.h"
#include "runtime/configuration/plausibility_config.h"
#include "runtime/recording/flight_recorder.h"
#include "runtime/recording/started.h"
#include "runtime/robot_session.h"

namespace operation {

inline runtime::RecordingConfig recording_config(const Config& config, const RunOptions& options) {
  return {options.config_file, options.settings, config.models, options.record_format};
}

/// `Cycle` has step(), request_stop(), switch_off(), finished(), record(), silent_checks() and
/// once_silent_checks(); `Record` has a schema (runtime/recording/record_rows.h), `limited`, `wake_up` and
/// `step`.
template <typename Cycle, typename Record, typename Summary>
class RecordedRun : public Run {
 public:
  void step(std::chrono::nanoseconds now) noexcept final { cycle_.step(now); }
  void request_stop() noexcept final { cycle_.request_stop(); }
  void switch_off() noexcept final { cycle_.switch_off(); }
  bool finished() const noexcept final { return cycle_.finished(); }
  void keep() noexcept final {
    Record& record = cycle_.record();
    record.wake_up = times_.wake_up;
    record.step = times_.step;
    const bool leads_to_the_end = sum_up(record);
    count_limiters(record.limited, summary_);
    if (leads_to_the_end) flight_recorder_.add(record);
    if (options_.live != nullptr) options_.live->add(record);
    if (after_cycle_) after_cycle_(record);
    if (!recording_) return;
    if (options_.virtual_time) recording_->wait_for_room();
    recording_->add(record);
  }
  std::optional<RecordingState> recording() const final {
    return recording_ ? std::optional(recording_->state()) : std::nullopt;
  }
  void wrap_up(const drivers::ethercat::PcapRing* frames) final {
    if (recording_) finish(*recording_, summary_);
    summary_.once_silent_checks = cycle_.once_silent_checks();
    summary_.stop_reason = stop_reason();
    if (!summary_.stop_reason.empty()) {
      summary_.stop_time = cycle_.stop_reason().time;
      summary_.fault_report = runtime::write_fault_report(
          options_.record_directory,
          [&](const std::filesystem::path& path) {
            flight_recorder_.write(path, rig_, started_, summary_.stop_reason);
          },
          frames, summary_.stop_reason, summary_.recording_problems);
    }
    write_page();
  }
  Summary& summary() noexcept final { return summary_; }

 protected:
  /// Parts around the cycle.
  struct Around {
    std::string rig;                                     ///< name in the fault report
    std::unique_ptr<RunReport<Record, Summary>> report;  ///< null without a recording
    std::unique_ptr<RunRecording<Record>> recording;     ///< likewise; adds to the report
    std::function<void(const Record&)> after_cycle;      ///< may be empty
  };
  template <typename... CycleArguments>
  RecordedRun(const Config& config, const RunOptions& options, Around around, CycleArguments&&... of_cycle)
      : cycle_(std::forward<CycleArguments>(of_cycle)...),
        options_(options),
        rig_(std::move(around.rig)),
        flight_recorder_(static_cast<std::size_t>(kFlightRecorderSpan / config.cycle.period)),
        report_(std::move(around.report)),
        recording_(std::move(around.recording)),
        after_cycle_(std::move(around.after_cycle)) {
    summary_.robot = config.robot.name;
    summary_.virtual_time = options.virtual_time;
    summary_.record_directory = options.record_directory.value_or("");
    runtime::warn_of(config.cycle.checks_off);
  }

  /// Cycle: adds it to the summary. False for a cycle that the fault report leaves out.
  virtual bool sum_up(Record& record) noexcept = 0;
  /// After the last cycle: text of the fault; empty if there was none.
  virtual std::string stop_reason() = 0;

  Cycle cycle_;
  Summary summary_;

 private:
  static constexpr std::chrono::seconds kFlightRecorderSpan{1};

  /// A run that ended before its first cycle leaves nothing.
  void write_page() {
    if (!report_ || summary_.cycles_recorded + summary_.cycles_lost == 0) return;
    try {
      report_->page(summary_).write(*options_.record_directory / "report.html");
    } catch (const std::exception& failure) {
      summary_.recording_problems.emplace_back(failure.what());
    }
  }

  RunOptions options_;
  std::string rig_;
  runtime::RecordingFile::Comment started_ = runtime::started_now();
  runtime::FlightRecorder<Record> flight_recorder_;
  std::unique_ptr<RunReport<Record, Summary>> report_;
  std::unique_ptr<RunRecording<Record>> recording_;  // its thread uses the report
  std::function<void(const Record&)> after_cycle_;
};

}  // namespace operation
