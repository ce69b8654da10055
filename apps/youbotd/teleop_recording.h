/// @file
/// The recording of a teleoperation: `teleoperation.csv`.
#pragma once
#include <chrono>
#include <filesystem>

#include "apps/youbotd/run_recording.h"
#include "apps/youbotd/teleop_record.h"
#include "control/workspace.h"

namespace youbotd {

using TeleopRecording = RunRecording<TeleopRecord>;

struct TeleopRecordingOptions {
  std::filesystem::path directory;
  runtime::RecordingConfig config;
  std::chrono::nanoseconds period;
  bool simulated = false;  ///< the truth is known
  control::Workspace workspace{};
};
TeleopRecording::Description teleop_recording(const TeleopRecordingOptions& options);

}  // namespace youbotd
