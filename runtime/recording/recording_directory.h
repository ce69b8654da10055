/// @file
/// Directory of a recorded run, with a copy of its configuration.
#pragma once
#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "runtime/recording/made_paths.h"
#include "runtime/recording/recording_file.h"

namespace runtime {

enum class RecordingFormat : std::uint8_t { kMcap, kCsv };

/// Configuration of a recording, stored with it.
struct RecordingConfig {
  std::filesystem::path file;
  std::string settings = {};  ///< TOML that replaced entries of the file; empty: none
  std::vector<RecordingFile::Attachment> models = {};  ///< that the configuration names
  RecordingFormat format = RecordingFormat::kMcap;
};

/// The directory of a recording until its first row: if the start fails before that, because of a file that
/// cannot be opened or later a device, nothing is left of it.
///
///     NewRecording recording(directory, {config_file, settings}, problems);
///     auto file = recording.open("base", comments, columns);
///     recording.keep();  // with the first row
class NewRecording {
 public:
  /// Creates the directory if it is missing, copies the configuration into it as `config.toml` and writes
  /// settings, if any, to `settings.toml`, and for CSV the models, under the names by which the configuration
  /// finds them; never overwrites. Failures are added to `problems`, as are, in one line, the models outside
  /// the folder of the configuration, which are not written.
  /// @throws hal::SetupError if files cannot be created in the directory.
  NewRecording(const std::filesystem::path& directory, const RecordingConfig& config,
               std::vector<std::string>& problems);
  NewRecording(const NewRecording&) = delete;
  NewRecording& operator=(const NewRecording&) = delete;

  /// `name`.mcap, with configuration, settings and models inside, or `name`.csv; never overwrites. @throws
  /// hal::SetupError as RecordingFile, for example for a full disk.
  std::unique_ptr<RecordingFile> open(const std::string& name,
                                      const std::vector<RecordingFile::Comment>& comments,
                                      const std::vector<RecordingFile::Column>& columns);
  void keep() noexcept { made_.keep(); }

 private:
  /// Into the directory and the recordings. @throws std::runtime_error if it exists or cannot be written.
  void add(const std::string& name, const std::string& text);
  /// @throws std::runtime_error as add().
  void write(const std::string& name, const std::string& text);

  std::filesystem::path directory_;
  RecordingFormat format_;
  std::vector<RecordingFile::Attachment> attachments_;
  MadePaths made_;
};

}  // namespace runtime
