/// @file
/// One stretch of work of the robot, from an enable to drives that are off.
#pragma once
#include <array>
#include <chrono>
#include <filesystem>
#include <limits>
#include <optional>
#include <string>

#include "control/plausibility/checks.h"
#include "drivers/ethercat/pcap_ring.h"
#include "operation/recording_state.h"
#include "operation/run_summary.h"
#include "runtime/loop.h"

namespace operation {

/// What a run says of itself while it lasts. Plain values, because they cross threads.
struct Progress {
  static constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

  const char* phase = "off";        ///< a constant text
  std::chrono::nanoseconds time{};  ///< since its first cycle
  std::array<double, 3> base_W{};   ///< odometry: x, y, yaw
  std::array<double, 3> tip_p_WT_m{kNaN, kNaN, kNaN};
  std::array<double, 3> force_H_N{kNaN, kNaN, kNaN};  ///< on the hand
  control::ChecksOff silent_checks{};                 ///< of the sensors, that do not run now
};

/// Made and wrapped up by one thread, stepped by one, as runtime::run_loop() wants it.
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
  /// After step(), when `record()` is complete: keeps and records the cycle.
  virtual void keep() noexcept = 0;
  virtual Progress progress() const noexcept = 0;

  /// Beside the cycle, by the thread that made it. None: nothing is recorded.
  virtual std::optional<RecordingState> recording() const { return std::nullopt; }

  /// After the last cycle: closes the recording and writes the report on a fault, with the bus' last `frames`
  /// (may be null). Once.
  virtual void wrap_up(const drivers::ethercat::PcapRing* frames) = 0;
  virtual RunSummary& summary() noexcept = 0;

 protected:
  runtime::CycleTimes times_;
};

/// What a run of any kind needs to know beside its configuration.
struct RunOptions {
  std::filesystem::path config_file;
  std::string settings{};  ///< TOML that replaces entries of the file; recorded beside it
  std::optional<std::filesystem::path> record_directory{};
  std::string experiment = "path";  ///< as the recordings of a base call it
  bool virtual_time = false;        ///< the recording may make the cycle wait
  bool show_progress = false;       ///< on standard error, while it lasts
};

}  // namespace operation
