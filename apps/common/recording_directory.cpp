#include "apps/common/recording_directory.h"

#include <stdexcept>
#include <system_error>

#include "apps/common/output_directory.h"
#include "apps/common/regular_file.h"
#include "apps/common/toml_reader.h"
#include "apps/common/whole_file.h"

namespace apps {

NewRecording::NewRecording(const std::filesystem::path& directory, const std::filesystem::path& config_file,
                           std::vector<std::string>& problems)
    : directory_(directory), made_(make_output_directory(directory)) {
  const std::filesystem::path copy = directory / "config.toml";
  std::error_code error;
  try {
    if (std::filesystem::exists(copy, error)) throw std::runtime_error("is there already");
    write_whole_file(copy, read_regular_file(config_file, kMaxToml_bytes));
    made_.add(copy);
  } catch (const std::runtime_error& why) {
    problems.push_back("copy of " + config_file.string() + ": " + why.what());
  }
}

std::unique_ptr<RecordingFile> NewRecording::open(const std::string& rig,
                                                  const std::vector<RecordingFile::Comment>& comments,
                                                  const std::vector<RecordingFile::Column>& columns) {
  const std::filesystem::path path = directory_ / (rig + ".csv");
  auto file = std::make_unique<RecordingFile>(path, comments, columns);
  made_.add(path);
  return file;
}

}  // namespace apps
