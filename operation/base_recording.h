/// @file
/// Recording of a base: `wheel-1.csv` … `wheel-4.csv` (format and columns of the recording contract, with the
/// filtered velocity) and `base.csv` (poses, wrench, timing).
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
