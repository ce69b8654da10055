#include "analysis/robot_tables.h"

#include <algorithm>
#include <memory>
#include <utility>

#include "analysis/inputs.h"

namespace analysis {
namespace {

namespace fs = std::filesystem;

/// Whether the table calls its time otherwise.
bool lacks_time(const runtime::RecordingError& error, const std::string& time) {
  return std::ranges::any_of(error.problems(), [&](const std::string& problem) {
    return problem.find("there is no column '" + time + "'") != std::string::npos;
  });
}

runtime::ReadRecording read_table(const runtime::ColumnMap& map, const std::string& time_column,
                                  const fs::path& path) {
  const auto read = [&](const std::string& time) {
    auto whole = std::make_shared<runtime::ColumnMap>(map);
    whole->columns.insert(whole->columns.begin(), {"time_s", time});
    return runtime::read_recording(path, runtime::ReadOptions{.columns = std::move(whole)});
  };
  if (!time_column.empty()) return read(time_column);
  try {
    return read("t_s");
  } catch (const runtime::RecordingError& error) {
    if (!lacks_time(error, "t_s")) throw;
  }
  return read("time_s");
}

}  // namespace

std::vector<std::string> read_robot_tables(const RobotGapOptions& options, const runtime::ColumnMap& map,
                                           const std::string& time_column,
                                           const std::function<void(const RobotTable& table)>& take) {
  const RecordingFiles files = recording_files(options.data, options.held_out);
  std::vector<std::string> problems;
  std::vector<std::string> warnings;
  for (std::size_t i = 0; i < files.names.size(); ++i) {
    const bool is_searched = i < files.data.size();
    const fs::path& path = is_searched ? files.data[i] : files.held_out[i - files.data.size()];
    try {
      runtime::ReadRecording read = read_table(map, time_column, path);
      // Columns that a robot file does not name are no mistake.
      std::erase_if(read.warnings, [](const std::string& text) {
        return text.find("were left out") != std::string::npos && text.find("columns") != std::string::npos;
      });
      warnings.insert(warnings.end(), read.warnings.begin(), read.warnings.end());
      take({files.names[i], path, is_searched, std::move(read.recording)});
    } catch (const runtime::ConfigError& error) {
      problems.insert(problems.end(), error.problems().begin(), error.problems().end());
    }
  }
  if (!problems.empty()) throw runtime::ConfigError(std::move(problems));
  return warnings;
}

}  // namespace analysis
