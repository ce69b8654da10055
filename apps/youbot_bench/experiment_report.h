/// @file
#pragma once
#include <filesystem>
#include <string>

namespace youbot_bench {

/// Data for the page that the recording does not contain.
struct ExperimentRun {
  std::string experiment;
  int finished = 0;  ///< measurements, including those of earlier runs
  int planned = 0;
  std::string fault{};  ///< why the robot was stopped; empty if it was not
};

/// Writes `directory`/report.html about every experiment recorded in `directory`, `run` being the latest of
/// them: the result in the title, its table, the plots and the configuration. Uses the recordings on disk, so
/// it covers the measured part of an interrupted run, and all of a resumed one. Not for a real-time cycle: it
/// reads the recordings again. @throws hal::SetupError if the page cannot be written; for unreadable
/// recordings the page says so.
void write_experiment_report(const std::filesystem::path& directory, const ExperimentRun& run);

}  // namespace youbot_bench
