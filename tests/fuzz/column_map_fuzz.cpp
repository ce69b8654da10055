// Column maps and the tables that they describe, as user input: the map, a line "---", the table.
#include <cmath>
#include <string>
#include <string_view>

#include "runtime/recording/column_map.h"
#include "runtime/recording/recording_reader.h"
#include "tests/fuzz/fuzz_target.h"
#include "tests/fuzz/memory_file.h"

namespace {

using fuzz::require;

constexpr std::string_view kBetween = "\n---\n";

void check(const runtime::ReadRecording& read) {
  require(read.recording.rows() > 0);
  for (const auto& column : read.recording.columns) {
    require(column.values.size() == read.recording.rows());
    require(runtime::is_known_column(column.name));
    for (const double value : column.values) require(std::isfinite(value));
  }
  const auto time = read.recording.column("time_s");
  for (std::size_t i = 1; i < time.size(); ++i) require(time[i] > time[i - 1]);
}

}  // namespace

std::vector<fuzz::Bytes> fuzz::seeds() {
  return {
      bytes_of("format = \"youbot-column-map/1\"\nrig = \"a\"\ngear_ratio = 16\ndecimal = \",\"\n"
               "[time_s]\ncolumn = \"t\"\nunit = \"ms\"\n[position_rad]\ncolumn = \"q\"\nunit = \"counts\"\n"
               "counts_per_rev = 4096\nside = \"motor\"\nsign = -1\n[only]\ncolumn = \"r\"\nvalue = \"3\"\n"
               "---\nr;t;q\n3;0,5;1\n3;1,5;2\n4;0;0\n"),
      bytes_of("format = \"youbot-column-map/1\"\n[time_s]\ncolumn = \"t\"\nunit = \"s\"\n"
               "[position_rad]\ncolumn = \"q\"\nunit = \"rad\"\n"
               "[position_command_rad]\ncolumn = \"g\"\nunit = \"deg\"\n"
               "[torque_command_Nm.servo]\nerror_gain_per_rad = 0.003\nkp = 200\nsupply_V = 7.4\n"
               "torque_constant_Nm_per_A = 0.35\nresistance_ohm = 3.4\n"
               "---\n\xEF\xBB\xBF\"t\",q,g\r\n0,1,2\r\n+1,1e3,-2\r\n\r\n")};
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const fuzz::MemoryFile file;
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  const std::size_t end = text.find(kBetween);
  const std::string_view map = text.substr(0, end);
  file.hold(map);
  try {
    const runtime::ColumnMap columns = runtime::read_column_map(file.path());
    if (end != text.npos)
      check(runtime::parse_recording(text.substr(end + kBetween.size()), "f.csv", columns));
  } catch (const runtime::RecordingError& error) {
    require(!error.problems().empty());
    require(error.problems().size() <= runtime::RecordingError::kMaxProblems + 1);
    for (const std::string& problem : error.problems()) require(problem.starts_with("f.csv:"));
  } catch (const runtime::ConfigError& error) {
    require(!error.problems().empty());
    for (const std::string& problem : error.problems()) require(problem.starts_with(file.path() + ":"));
  }
  return 0;
}
