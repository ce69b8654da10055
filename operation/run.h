/// @file
/// One run of the robot, from enable to drives off.
#pragma once
#include <array>
#include <chrono>
#include <filesystem>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "control/plausibility/checks.h"
#include "drivers/ethercat/pcap_ring.h"
#include "operation/recording_state.h"
#include "operation/run_summary.h"
#include "runtime/loop.h"
#include "runtime/recording/recording_directory.h"

namespace operation {

class LiveFeed;
struct Config;

/// State of a run in progress. Plain values, because they cross threads.
struct Progress {
  static constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

  const char* phase = "off";        ///< a constant text
  std::chrono::nanoseconds time{};  ///< since its first cycle
  std::array<double, 3> base_W{};   ///< odometry: x, y, yaw
  std::array<double, 3> tip_p_WT_m{kNaN, kNaN, kNaN};
  std::array<double, 3> force_H_N{kNaN, kNaN, kNaN};  ///< on the hand
  control::ChecksOff silent_checks{};                 ///< of the sensors: those that do not run now
};

/// Created and finished by one thread, stepped by one, for runtime::run_loop().
class Run {
 public:
  Run() = default;
  Run(const Run&) = delete;
  Run& operator=(const Run&) = delete;
  virtual ~Run() = default;

  // Cycle.
  virtual void step(std::chrono::nanoseconds now) noexcept = 0;
  /// Comes to rest, then switches off.
  virtual void request_stop() noexcept = 0;
  /// Drives off with the next step. An arm falls.
  virtual void switch_off() noexcept = 0;
  virtual bool finished() const noexcept = 0;
  runtime::CycleTimes& record() noexcept { return times_; }
  /// After step(), once `record()` is complete: keeps and records the cycle.
  virtual void keep() noexcept = 0;
  virtual Progress progress() const noexcept = 0;

  /// Concurrently with the cycle, by the thread that created it. Empty: nothing is recorded.
  virtual std::optional<RecordingState> recording() const { return std::nullopt; }

  /// Concurrently with the cycle, by the thread that created it: keys of the settings that act during the
  /// run.
  virtual std::span<const std::string_view> tunable() const { return {}; }
  /// Likewise: takes the value of one of these keys from `config`.
  /// @throws std::invalid_argument if it contradicts another setting of the run
  virtual void tune(std::string_view /*key*/, const Config& /*config*/) {}

  /// After the last cycle: closes the recording and writes the fault report, with the last `frames` of the
  /// bus (may be null). Call once.
  virtual void wrap_up(const drivers::ethercat::PcapRing* frames) = 0;
  virtual RunSummary& summary() noexcept = 0;

 protected:
  runtime::CycleTimes times_;
};

/// Options common to all runs, in addition to the configuration.
struct RunOptions {
  std::filesystem::path config_file;
  std::string settings{};  ///< TOML that overrides entries of the file; recorded with it
  std::optional<std::filesystem::path> record_directory{};
  runtime::RecordingFormat record_format{};
  std::string experiment = "path";  ///< name in the recordings of a base
  bool virtual_time = false;        ///< the recording may delay the cycle
  LiveFeed* live = nullptr;         ///< of a page; null: none. Must outlive the run
  bool show_progress = false;       ///< on standard error, during the run
};

}  // namespace operation
