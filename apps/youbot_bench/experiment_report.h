/// @file
#pragma once
#include <filesystem>
#include <string>

namespace youbot_bench {

/// What the page cannot learn from the recording.
struct ExperimentRun {
  std::string experiment;
  int finished = 0;  ///< measurements, those of earlier runs included
  int planned = 0;
  std::string fault{};  ///< why the robot was stopped; empty when it was not
};

/// Writes `directory`/report.html about every experiment recorded in `directory`, `run` the latest of them:
/// the result in the title, its table, the plots and the configuration. From the recordings as they are on
/// disk, so it serves an interrupted run as far as that was measured, and a resumed one as a whole.
/// Not for a real-time cycle: it reads the recordings again. @throws hal::SetupError when the page cannot be
/// written; for recordings that cannot be read the page says so.
void write_experiment_report(const std::filesystem::path& directory, const ExperimentRun& run);

}  // namespace youbot_bench
