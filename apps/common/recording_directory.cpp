#include "apps/common/recording_directory.h"

#include <system_error>

#include "apps/common/file_size_signal.h"
#include "apps/common/output_directory.h"

namespace apps {

NewRecording::NewRecording(const std::filesystem::path& directory, const std::filesystem::path& config_file,
                           std::vector<std::string>& problems)
    : directory_(directory), made_(make_output_directory(directory)) {
  const std::filesystem::path copy = directory / "config.toml";
  std::error_code error;
  const bool was_there = std::filesystem::exists(copy, error);
  {
    const FileSizeSignalHeldBack held_back;
    std::filesystem::copy_file(config_file, copy, error);
  }
  if (error) problems.push_back(copy.string() + ": " + error.message());
  if (!was_there) made_.push_back(copy);
}

std::unique_ptr<RecordingFile> NewRecording::open(const std::string& rig,
                                                  const std::vector<RecordingFile::Comment>& comments,
                                                  const std::vector<RecordingFile::Column>& columns) {
  const std::filesystem::path path = directory_ / (rig + ".csv");
  auto file = std::make_unique<RecordingFile>(path, comments, columns, RecordingFile::Existing::kRefuse);
  made_.push_back(path);
  return file;
}

NewRecording::~NewRecording() {
  std::error_code unknown;
  for (; !made_.empty(); made_.pop_back()) std::filesystem::remove(made_.back(), unknown);
}

}  // namespace apps
