/// @file
/// One recording of one rig, in memory.
#pragma once
#include <algorithm>
#include <cstddef>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace identification {

/// Columns of equal length by name; SI, joint side, the unit at the end of each name ("position_rad").
/// runtime/recording/recording_reader.h checks file contents: all numbers finite, time_s increasing. They are
/// NaN only if the reader was asked to accept incomplete results.
///
///     for (const double torque_Nm : recording.column("torque_measured_Nm")) ...
struct Recording {
  struct Column {
    std::string name;
    std::vector<double> values;
  };

  std::string rig;
  std::string experiment;
  double sample_rate_Hz = 0;  ///< as stated; 0 if not stated
  /// All `# key: value` lines in order, including those above.
  std::vector<std::pair<std::string, std::string>> comments;
  std::vector<Column> columns;

  std::size_t rows() const noexcept { return columns.empty() ? 0 : columns.front().values.size(); }
  bool has(std::string_view name) const noexcept { return find(name) != nullptr; }
  /// Valid while the recording is neither changed nor moved.
  /// @throws std::invalid_argument naming the existing columns.
  std::span<const double> column(std::string_view name) const {
    if (const Column* found = find(name)) return found->values;
    std::string there;
    for (const Column& column : columns) (there += there.empty() ? "" : ", ") += column.name;
    throw std::invalid_argument("recording of " + (rig.empty() ? "an unnamed rig" : rig) + ": no column " +
                                std::string(name) + "; it has " + (there.empty() ? "none" : there));
  }

 private:
  const Column* find(std::string_view name) const noexcept {
    const auto found = std::find_if(columns.begin(), columns.end(),
                                    [name](const Column& column) { return column.name == name; });
    return found == columns.end() ? nullptr : &*found;
  }
};

}  // namespace identification
