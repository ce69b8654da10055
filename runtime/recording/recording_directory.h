/// @file
/// Where a run is recorded, and the configuration that made it beside it.
#pragma once
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "runtime/recording/made_paths.h"
#include "runtime/recording/recording_file.h"

namespace runtime {

/// What made a recording, kept beside it.
struct RecordingConfig {
  std::filesystem::path file;
  std::string settings = {};  ///< TOML that replaced entries of the file; empty: none
};

/// The directory of a recording until its first row: when the start is refused before that, by a file that
/// cannot be opened or later by a device, nothing is left of it.
///
///     NewRecording recording(directory, {config_file, settings}, problems);
///     auto file = recording.open("base", comments, columns);
///     recording.keep();  // with the first row
class NewRecording {
 public:
  /// Makes the directory where it is missing, copies the configuration into it as `config.toml` and writes
  /// settings, if any, to `settings.toml`, never over another; what could not be written is added to
  /// `problems`.
  /// @throws hal::SetupError when files cannot be made in the directory.
  NewRecording(const std::filesystem::path& directory, const RecordingConfig& config,
               std::vector<std::string>& problems);
  NewRecording(const NewRecording&) = delete;
  NewRecording& operator=(const NewRecording&) = delete;

  /// `name`.csv, never over another. @throws hal::SetupError as RecordingFile, with a full disk among others.
  std::unique_ptr<RecordingFile> open(const std::string& name,
                                      const std::vector<RecordingFile::Comment>& comments,
                                      const std::vector<RecordingFile::Column>& columns);
  void keep() noexcept { made_.keep(); }

 private:
  /// @throws std::runtime_error when it is there already or cannot be written.
  void write_new(const std::filesystem::path& path, const std::string& text);

  std::filesystem::path directory_;
  MadePaths made_;
};

}  // namespace runtime
