#include "tests/gap/real/converted_drive.h"

#include <fstream>
#include <stdexcept>

#include "runtime/configuration/drive_model_file.h"
#include "runtime/recording/output_directory.h"
#include "runtime/recording/recording_file.h"

namespace real_recordings {
namespace {

namespace fs = std::filesystem;

void write_recording(const identification::Recording& recording, const fs::path& path) {
  std::vector<runtime::RecordingFile::Comment> comments{{"rig", recording.rig},
                                                        {"experiment", recording.experiment}};
  for (const auto& [key, value] : recording.comments) comments.push_back({key, value});
  std::vector<runtime::RecordingFile::Column> columns;
  for (const auto& column : recording.columns) columns.push_back({column.name});
  runtime::RecordingFile file(path, comments, columns);
  std::vector<double> row(recording.columns.size());
  for (std::size_t i = 0; i < recording.rows(); ++i) {
    for (std::size_t c = 0; c < row.size(); ++c) row[c] = recording.columns[c].values[i];
    file.append_row(row);
  }
  file.close();
  if (!file.error().empty()) throw std::runtime_error(file.error());
}

}  // namespace

std::vector<ConvertedDrive> converted_drives(const fs::path& data) {
  std::vector<ConvertedDrive> drives;
  for (const int drive : {1, 2}) drives.push_back(screw_drive(data / "tro2021_screw_drives", drive));
  for (const int motor : {1, 2, 3}) drives.push_back(omni_wheel(data / "robotino_wheel", motor));
  drives.push_back(outrunner(data / "odrive_cogging"));
  drives.push_back(pendulum_servo(data / "bam_xl330"));
  return drives;
}

void write_drive(const ConvertedDrive& drive, const fs::path& directory) {
  runtime::make_output_directory(directory / "data");
  std::ofstream model(directory / "base.toml", std::ios::binary);
  model << runtime::drive_model_text(drive.base, drive.remarks);
  if (!model.flush()) throw std::runtime_error((directory / "base.toml").string() + ": cannot be written");
  for (const ConvertedRecording& converted : drive.data)
    write_recording(converted.recording, directory / "data" / converted.file);
  if (!drive.held_out.empty()) runtime::make_output_directory(directory / "held_out");
  for (const ConvertedRecording& converted : drive.held_out)
    write_recording(converted.recording, directory / "held_out" / converted.file);
}

}  // namespace real_recordings
