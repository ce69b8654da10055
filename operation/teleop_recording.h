/// @file
/// The recording of a teleoperation: `teleoperation.mcap` or `teleoperation.csv`.
#pragma once
#include <chrono>
#include <filesystem>

#include "control/workspace.h"
#include "operation/run_recording.h"
#include "operation/teleop_record.h"

namespace operation {

using TeleopRecording = RunRecording<TeleopRecord>;

struct TeleopRecordingOptions {
  std::filesystem::path directory;
  runtime::RecordingConfig config;
  std::chrono::nanoseconds period;
  bool simulated = false;  ///< the truth is known
  control::Workspace workspace{};
};
TeleopRecording::Description teleop_recording(const TeleopRecordingOptions& options);

}  // namespace operation
