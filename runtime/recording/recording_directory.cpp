#include "runtime/recording/recording_directory.h"

#include <algorithm>
#include <stdexcept>
#include <system_error>

#include "runtime/configuration/regular_file.h"
#include "runtime/configuration/toml_reader.h"
#include "runtime/configuration/whole_file.h"
#include "runtime/recording/output_directory.h"

namespace runtime {
namespace {

/// Whether a file of the configuration is outside its folder.
bool leads_out(const std::string& name) {
  const std::filesystem::path normal = std::filesystem::path(name).lexically_normal();
  return normal.is_absolute() || *normal.begin() == "..";
}

}  // namespace

NewRecording::NewRecording(const std::filesystem::path& directory, const RecordingConfig& config,
                           std::vector<std::string>& problems)
    : directory_(directory),
      format_(config.format),
      attachments_(config.models),
      made_(make_output_directory(directory)) {
  try {
    add("config.toml", read_regular_file(config.file, kMaxToml_bytes));
  } catch (const std::runtime_error& why) {
    problems.push_back("copy of " + config.file.string() + ": " + why.what());
  }
  try {
    if (!config.settings.empty()) add("settings.toml", config.settings);
  } catch (const std::runtime_error& why) {
    problems.push_back(std::string("settings.toml: ") + why.what());
  }
  const bool copies = format_ == RecordingFormat::kCsv;
  std::string outside;
  for (const RecordingFile::Attachment& model : config.models) {
    const auto& [name, text] = model;
    if (leads_out(name)) {
      (outside += outside.empty() ? "" : ", ") += name;
    } else if (copies) {
      try {
        write(name, text);
      } catch (const std::runtime_error& why) {
        problems.push_back("copy of " + name + ": " + why.what());
      }
    } else if (&*std::ranges::find(config.models, name, &RecordingFile::Attachment::name) != &model) {
      problems.push_back("attachment " + name + ": another file of the configuration has the same name");
    }
  }
  if (!outside.empty())
    problems.push_back(copies
                           ? "files outside the configuration's folder are not copied: " + outside +
                                 "; keep them with the recording"
                           : "attachments outside the configuration's folder: " + outside +
                                 "; to repeat the run, extract them to these paths relative to config.toml");
}

void NewRecording::add(const std::string& name, const std::string& text) {
  attachments_.push_back({name, text});
  write(name, text);
}

void NewRecording::write(const std::string& name, const std::string& text) {
  const std::filesystem::path path = directory_ / std::filesystem::path(name).lexically_normal();
  made_.add(make_output_directory(path.parent_path()));
  std::error_code error;
  if (std::filesystem::exists(path, error)) throw std::runtime_error("is there already");
  write_whole_file(path, text);
  made_.add(path);
}

std::unique_ptr<RecordingFile> NewRecording::open(const std::string& name,
                                                  const std::vector<RecordingFile::Comment>& comments,
                                                  const std::vector<RecordingFile::Column>& columns) {
  const std::filesystem::path path =
      directory_ / (name + (format_ == RecordingFormat::kMcap ? ".mcap" : ".csv"));
  auto file = std::make_unique<RecordingFile>(path, comments, columns, RecordingFile::Existing::kRefuse,
                                              attachments_);
  made_.add(path);
  return file;
}

}  // namespace runtime
