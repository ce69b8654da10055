/// @file
/// Reads the recording of an experiment (ExperimentRecording) for its report.
#pragma once
#include <cstddef>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "identification/recording.h"

namespace youbot_bench {

struct MeasuredJoint {
  std::string name;
  identification::Recording rows;  ///< empty if nothing was recorded or requested
  identification::Recording
      results;  ///< a row for each finished measurement; NaN if a value could not be measured
};

/// One line of experiment.toml.
struct Setting {
  std::string key;  ///< with its unit
  std::string value;
  std::string help;
};

struct MeasuredExperiment {
  std::string name;
  std::vector<MeasuredJoint> joints;     ///< in the order of their names
  std::vector<double> finished_until_s;  ///< end of each measurement, on the clock of the rows
  std::vector<Setting> settings;
  std::vector<std::string> not_measured;  ///< reasons, "wheel-3 never moved up to 0.3 N·m"
  std::vector<std::string> problems;      ///< files that could not be used, with reasons

  double setting(std::string_view key, double otherwise) const;
};

/// Whether `directory` holds a recording of `experiment`.
bool holds_experiment(const std::filesystem::path& directory, const std::string& experiment);

/// Never throws because of file contents: that becomes a problem, and the rest is read. `result` is the
/// directory of the results, as in ExperimentPlan; `with_rows` = false skips the rows to save time.
MeasuredExperiment read_experiment(const std::filesystem::path& directory, const std::string& experiment,
                                   const std::string& result, bool with_rows);

/// Rows of one measurement after its rest, downsampled by means over several rows.
class Trace {
 public:
  /// Rows from `first` to before `last`, at least one; at most about `points` values.
  Trace(const identification::Recording& rows, std::size_t measurement, std::size_t first, std::size_t last,
        std::size_t points);

  std::size_t measurement() const noexcept { return measurement_; }  ///< counted from 0

  std::vector<double> time_s() const;            ///< since the rest
  std::vector<double> displacement_rad() const;  ///< from the rest position
  std::vector<double> column(std::string_view name) const;
  /// Averaging time of a value.
  double mean_over_s() const noexcept { return mean_over_s_; }

 private:
  std::vector<double> means(std::span<const double> values, double less) const;

  const identification::Recording& rows_;
  std::size_t measurement_;
  std::size_t first_;
  std::size_t last_;
  std::size_t block_;
  double mean_over_s_ = 0.0;
};

/// One for each measurement of the joint that got beyond its rest, including an unfinished last one; at most
/// about `points` values together. Valid while the experiment is neither changed nor moved.
std::vector<Trace> traces(const MeasuredExperiment& experiment, const MeasuredJoint& joint,
                          std::size_t points);

}  // namespace youbot_bench
