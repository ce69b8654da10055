#include "apps/youbot_bench/arm_motion_recording.h"

#include <memory>

#include "runtime/program/build_info.h"
#include "runtime/recording/started.h"

namespace youbot_bench {
namespace {

std::vector<runtime::Recording<ArmMotionRecord>::Table> open_motions(const std::filesystem::path& directory,
                                                                     int motions, runtime::MadePaths& made) {
  std::vector<runtime::Recording<ArmMotionRecord>::Table> tables;
  for (int motion = 0; motion < motions; ++motion) {
    const std::filesystem::path path = directory / ArmMotionRecording::file_name(motion);
    tables.push_back({std::make_unique<runtime::RecordingFile>(path,
                                                               std::vector<runtime::RecordingFile::Comment>{
                                                                   {"rig", "arm"},
                                                                   {"experiment", "arm-excitation"},
                                                                   runtime::started_now(),
                                                                   {"software", runtime::build_version()}},
                                                               runtime::columns_of(ArmMotionRecord{})),
                      [motion](runtime::RecordingFile& file, const ArmMotionRecord& record) {
                        if (record.motion == motion) runtime::append_record(file, record);
                      }});
    made.add(path);
  }
  return tables;
}

}  // namespace

ArmMotionRecording::ArmMotionRecording(const std::filesystem::path& directory, int motions,
                                       runtime::MadePaths& made)
    : recording_(open_motions(directory, motions, made), [&made](const ArmMotionRecord&) { made.keep(); }) {}

}  // namespace youbot_bench
