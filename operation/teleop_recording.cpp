#include "operation/teleop_recording.h"

#include <spdlog/fmt/fmt.h>

#include "hal/seconds.h"
#include "operation/workspace_comments.h"
#include "runtime/program/build_info.h"
#include "runtime/recording/started.h"

namespace operation {
namespace {

/// Columns that may contain `nan`, and why.
constexpr const char* kNoTruth =
    "true_tip_x_m,true_tip_y_m,true_tip_z_m,contact_force_x_N,contact_force_y_N,contact_force_z_N: only "
    "known in simulation";
constexpr const char* kNoOpening = "gripper_opening_m: no gripper command was sent";

}  // namespace

TeleopRecording::Description teleop_recording(const TeleopRecordingOptions& options) {
  TeleopRecording::Description description{
      .directory = options.directory,
      .config = options.config,
      .comments = {{"experiment", "teleoperation"},
                   {"sample_rate_Hz", fmt::format("{:g}", 1 / hal::seconds(options.period))},
                   {"not_measured", kNoOpening},
                   runtime::started_now(),
                   {"software", runtime::build_version()}},
      .tables = {}};
  add_workspace(options.workspace, description.comments);
  if (!options.simulated) description.comments.push_back({"not_measured", kNoTruth});
  description.tables.push_back({.file = "teleoperation", .rig = "base+arm"});
  return description;
}

}  // namespace operation
