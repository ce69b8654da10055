#include "runtime/mcap/convert.h"

#include <memory>
#include <optional>
#include <stdexcept>

#include "hal/setup_error.h"
#include "runtime/configuration/regular_file.h"
#include "runtime/configuration/toml_reader.h"
#include "runtime/mcap/mcap_file.h"
#include "runtime/mcap/mcap_writer.h"
#include "runtime/mcap/new_file.h"
#include "runtime/mcap/recording_rows.h"
#include "runtime/mcap/recording_writer.h"
#include "runtime/recording/recording_file.h"

namespace runtime::mcap {
namespace {

namespace fs = std::filesystem;

std::uint64_t size_of(const fs::path& path) {
  std::error_code error;
  const std::uintmax_t size = fs::file_size(path, error);
  return error ? 0 : size;
}

void attach_configuration(McapWriter& writer, const fs::path& folder, std::uint64_t time_ns) {
  for (const char* name : {"config.toml", "settings.toml", "experiment.toml"}) {
    std::error_code error;
    const fs::path path = folder / name;
    if (!fs::is_regular_file(path, error)) continue;
    try {
      writer.add_attachment(toml_attachment(name, read_regular_file(path, kMaxToml_bytes), time_ns));
    } catch (const hal::SetupError&) {
      throw;  // of the file that is written
    } catch (const std::runtime_error& why) {
      throw ConfigError({path.string() + ": " + why.what()});
    }
  }
}

std::uint64_t csv_to_mcap(const fs::path& in, const fs::path& out, std::vector<std::string>& warnings) {
  NewFile file(out);
  McapWriter writer([&file](std::string_view bytes) { file.write(bytes); }, recording_options());
  std::optional<RecordingWriter> recording;
  std::uint64_t rows = 0;
  read_csv_rows(in, {.head =
                         [&](const RecordingHead& head) {
                           recording.emplace(writer, head);
                           attach_configuration(writer, in.parent_path(), head.start_ns());
                         },
                     .row =
                         [&](std::span<const double> row) {
                           if (recording->full()) recording->end_block();
                           recording->append_row(row);
                           ++rows;
                         },
                     .warning = [&](const std::string& text) { warnings.push_back(text); }});
  recording->end_block();
  writer.finish();
  file.finish();
  return rows;
}

std::uint64_t mcap_to_csv(const fs::path& in, const fs::path& out, const std::string& joint,
                          std::vector<std::string>& warnings) {
  std::unique_ptr<RecordingFile> file;
  std::uint64_t rows = 0;
  try {
    read_mcap_rows([&in] { return read_file(in); }, in.string(), {.joint = joint, .all = true},
                   {.head =
                        [&](const RecordingHead& head) {
                          try {
                            file = std::make_unique<RecordingFile>(out, head.comments, head.columns);
                          } catch (const std::invalid_argument& error) {  // what CSV cannot hold
                            throw ConfigError({in.string() + ": " + error.what()});
                          }
                        },
                    .row =
                        [&](std::span<const double> row) {
                          file->append_row(row);
                          ++rows;
                        },
                    .warning = [&](const std::string& text) { warnings.push_back(text); }});
    file->close();
    if (const std::string problem = file->error(); !problem.empty())
      throw hal::SetupError(out.string(), "write the recording", problem);
  } catch (...) {
    if (file) {
      std::error_code stays;
      fs::remove(out, stays);
    }
    throw;
  }
  return rows;
}

}  // namespace

Converted convert(const fs::path& in, const fs::path& out, const std::string& joint) {
  const std::string from = in.extension();
  const std::string to = out.extension();
  if (!(from == ".csv" && to == ".mcap") && !(from == ".mcap" && to == ".csv"))
    throw std::invalid_argument("convert: expected a .csv and a .mcap file, not '" + from + "' and '" + to +
                                "'");
  if (!joint.empty() && from != ".mcap")
    throw std::invalid_argument("--joint: a joint is chosen from an .mcap file, not from '" + from + "'");
  require_absent(out);
  fs::path part = out;
  part += ".part";
  Converted result;
  result.rows =
      to == ".mcap" ? csv_to_mcap(in, part, result.warnings) : mcap_to_csv(in, part, joint, result.warnings);
  publish(part, out);
  result.bytes_in = size_of(in);
  result.bytes_out = size_of(out);
  return result;
}

}  // namespace runtime::mcap
