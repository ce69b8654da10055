/// @file
/// An experiment on disk: the rows of every joint, the results of every measurement, and the progress for
/// resuming.
#pragma once
#include <array>
#include <atomic>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "hal/joint.h"
#include "identification/experiments/joint_experiment.h"
#include "runtime/recording/made_paths.h"
#include "runtime/recording/recorder.h"
#include "runtime/recording/recording_file.h"

namespace youbot_bench {

/// Recorded times are rounded to 1 µs; times closer than this are equal.
inline constexpr double kTimeGrain_s = 0.6e-6;

/// Output of the cycle: a row of every joint, or the results of a measurement that all joints have finished.
/// Joints in the chosen order.
struct ExperimentRecord {
  enum class Kind : std::uint8_t { kRow, kResult };
  /// `values` of a row; in a result, those of JointExperiment::write_result().
  enum Value : std::uint8_t {
    kTorqueMeasured,
    kPosition,
    kVelocity,
    kTorqueCommand,
    kVelocityCommand,
    kPositionCommand,
  };
  Kind kind = Kind::kRow;
  int measurement = 0;
  double time_s = 0.0;
  std::array<std::array<double, identification::experiments::kMaxResults>, hal::kMaxJoints> values{};
};

/// `DIR/EXPERIMENT/JOINT.csv` (rows), `DIR/RESULT/JOINT.csv` (results, if the experiment has some),
/// `DIR/EXPERIMENT/progress` (a line for each finished measurement) and `DIR/EXPERIMENT/experiment.toml`.
///
/// A measurement counts once its line is in `progress`, which is written after its rows and results have been
/// passed to the operating system. Resuming keeps finished measurements and drops the rest, so that the files
/// read as if there had been no interruption. Files are replaced by renaming: a crash while resuming loses
/// nothing.
///
/// A result that could not be measured is `nan`; the header gives the reason
/// (runtime/recording/recording_reader.h).
///
/// Until keep() is called, the destructor removes what the constructor created, so that a failed set-up
/// leaves nothing behind.
class ExperimentRecording {
 public:
  struct Description {
    std::filesystem::path directory;  ///< DIR
    std::string experiment;
    std::string result;  ///< as "steady-state-map"
    std::vector<std::string> joints{};
    identification::experiments::RecordedCommands commands{};
    std::vector<std::string> result_columns{};
    std::vector<std::string> not_measured{};  ///< for each of them, JointExperiment::not_measured()
    double rate_Hz = 1000.0;
    std::string configuration{};                       ///< TOML text
    std::function<void()> about_every_100_ms = [] {};  ///< on the writer's thread
  };
  /// A recording there would replace or extend an existing one.
  static bool holds_recording(const Description& description);

  /// Setup: starts a new recording or continues an existing one. @throws hal::SetupError naming path and
  /// cause; std::invalid_argument when there is a recording already, or, to resume, none or one that does not
  /// fit.
  ExperimentRecording(const Description& description, bool resume);

  /// Setup: from now on the files contain results.
  void keep() noexcept { made_.keep(); }

  int finished_measurements() const noexcept { return finished_; }  ///< of the resumed recording
  double finished_until_s() const noexcept { return finished_until_s_; }

  /// Cycle: wait-free. False if the record was lost.
  bool add(const ExperimentRecord& record) noexcept { return recorder_->push(record); }
  /// Not for a real-time cycle.
  void wait_for_room() const noexcept { recorder_->wait_for_room(); }
  /// Cycle: a write failed. Nothing is written from then on.
  bool failed() const noexcept { return failed_.load(std::memory_order_relaxed); }

  /// Writes what is pending and closes the files.
  void close() noexcept;
  /// Texts on what went wrong; empty if everything is on disk. After close().
  std::vector<std::string> problems() const;
  /// Texts on results on disk that could not be measured: "wheel-3, measurement 1: never moved up to 0.3
  /// N·m". After close().
  const std::vector<std::string>& not_measured() const noexcept { return not_measured_; }
  /// Finished measurements on disk, including the resumed ones. After close().
  int measurements_on_disk() const noexcept { return static_cast<int>(progress_->rows_written()); }
  std::uint64_t rows_on_disk() const noexcept;  ///< of the joint with the fewest. After close().

 private:
  using File = std::unique_ptr<runtime::RecordingFile>;
  File open(const std::filesystem::path& path, const std::vector<runtime::RecordingFile::Comment>& comments,
            const std::vector<runtime::RecordingFile::Column>& columns,
            const std::function<bool(std::span<const double>, int)>& keep);
  std::vector<runtime::RecordingFile::Column> choose_columns(
      const identification::experiments::RecordedCommands& commands);
  /// Limits the finished measurements to the rows of `path`, whose times must match.
  void count_finished(const std::filesystem::path& path,
                      const std::vector<runtime::RecordingFile::Column>& columns);
  void write(const ExperimentRecord& record);
  bool flush_all(std::vector<File>& files);
  void note_missing(std::size_t joint, int measurement, std::span<const double> values);

  runtime::MadePaths made_;  // first: outlives the files
  bool resume_;
  int finished_;  // -1: unknown so far
  std::vector<double> finished_times_s_;
  double finished_until_s_ = -1.0;
  std::vector<ExperimentRecord::Value> row_values_;  // of the columns after time_s
  std::size_t result_values_ = 0;
  std::vector<std::string> joints_;
  std::vector<std::string> result_names_;
  std::vector<std::string> reasons_;       // why results are missing, by column
  std::vector<std::string> not_measured_;  // the writer's, until close()
  std::vector<File> rows_;                 // by joint
  std::vector<File> results_;              // by joint, or none
  File progress_;
  std::atomic<bool> failed_{false};
  std::vector<double> line_;                                     // the writer's
  std::optional<runtime::Recorder<ExperimentRecord>> recorder_;  // last: its thread uses the files
};

}  // namespace youbot_bench
