/// @file
/// Recording of a base: `base.mcap` or `base.csv` (poses, wrench, wheels, timing). As CSV also `wheel-1.csv`
/// … `wheel-4.csv` (format and columns of the recording contract, with the filtered velocity); of an MCAP
/// file, a reader gets a wheel by its name.
#pragma once
#include <chrono>
#include <filesystem>
#include <string>

#include "control/workspace.h"
#include "operation/cycle_record.h"
#include "operation/run_recording.h"

namespace operation {

using BaseRecording = RunRecording<CycleRecord>;

struct BaseRecordingOptions {
  std::filesystem::path directory;
  runtime::RecordingConfig config;
  std::string experiment;
  bool friction_compensation = false;  ///< as run, whatever the configuration file says
  std::chrono::nanoseconds period;
  control::Workspace workspace{};
};
BaseRecording::Description base_recording(const BaseRecordingOptions& options);

}  // namespace operation
