#include "apps/youbotd/flight_recorder.h"

#include "apps/common/build_info.h"
#include "apps/common/recording_file.h"
#include "apps/youbotd/base_recording.h"
#include "hal/setup_error.h"

namespace youbotd {

void FlightRecorder::write(const std::filesystem::path& path, const std::string& reason) const {
  apps::RecordingFile file(path,
                           {{"rig", "base"},
                            {"experiment", "fault report"},
                            {"reason", reason},
                            {"software", apps::build_version()}},
                           cycle_columns());
  const std::size_t oldest = (next_ + ring_.size() - kept_) % ring_.size();
  for (std::size_t i = 0; i < kept_; ++i) append_cycle(file, ring_[(oldest + i) % ring_.size()]);
  file.close();
  if (const std::string problem = file.error(); !problem.empty())
    throw hal::SetupError(path.string(), "write the last cycles", problem);
}

}  // namespace youbotd
