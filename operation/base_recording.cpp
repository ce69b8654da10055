#include "operation/base_recording.h"

#include <spdlog/fmt/fmt.h>

#include "hal/seconds.h"
#include "operation/workspace_comments.h"
#include "runtime/program/build_info.h"
#include "runtime/recording/started.h"

namespace operation {
BaseRecording::Description base_recording(const BaseRecordingOptions& options) {
  BaseRecording::Description description{
      .directory = options.directory,
      .config = options.config,
      .comments = {{"experiment", options.experiment},
                   {"sample_rate_Hz", fmt::format("{:g}", 1 / hal::seconds(options.period))},
                   {"friction_compensation", options.friction_compensation ? "true" : "false"},
                   runtime::started_now(),
                   {"software", runtime::build_version()}},
      .tables = {}};
  add_workspace(options.workspace, description.comments);
  const bool wheels_apart = options.config.format == runtime::RecordingFormat::kCsv;
  for (std::size_t i = 0; wheels_apart && i < kWheels; ++i)
    description.tables.push_back({.file = fmt::format("wheel-{}", i + 1),
                                  .columns = runtime::columns_of(WheelOfRecord{{}, i}),
                                  .append = [i](runtime::RecordingFile& file, const CycleRecord& record) {
                                    runtime::append_record(file, WheelOfRecord{record, i});
                                  }});
  description.tables.push_back({.file = "base"});
  return description;
}

}  // namespace operation
