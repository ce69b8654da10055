// Logs of bam, as user input.
#include <cmath>
#include <string>
#include <string_view>

#include "runtime/recording/bam_log.h"
#include "tests/fuzz/fuzz_target.h"
#include "tests/fuzz/memory_file.h"

using fuzz::require;

std::vector<fuzz::Bytes> fuzz::seeds() {
  return {
      bytes_of(
          "{\"mass\":0.49,\"kp\":200,\"vin\":7.4,\"motor\":\"xl330\",\"trajectory\":\"sin_sin\",\"entries\":["
          "{\"position\":0.1,\"speed\":0.2,\"temp\":29,\"timestamp\":0.003,\"goal_position\":0.2,"
          "\"torque_enable\":true},"
          "{\"position\":0.2,\"speed\":0.2,\"temp\":29,\"timestamp\":0.008,\"goal_position\":0.2,"
          "\"torque_enable\":true},"
          "{\"position\":0.2,\"speed\":0.2,\"temp\":29,\"timestamp\":0.011,\"goal_position\":0.2,"
          "\"torque_enable\":false}]}"),
      bytes_of("{\"arm-mass\":0.02,\"entries\":[{\"timestamp\":1e-3,\"position\":1},{\"timestamp\":null,"
               "\"position\":[]},{\"timestamp\":\"\\u00e4\",\"position\":{}}]}")};
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  try {
    const runtime::ReadRecording read = runtime::parse_bam_log(text, "f.json", nullptr);
    require(read.recording.rows() > 0);
    for (const auto& column : read.recording.columns) {
      require(column.values.size() == read.recording.rows());
      for (const double value : column.values) require(std::isfinite(value));
    }
    const auto time = read.recording.column("time_s");
    for (std::size_t i = 1; i < time.size(); ++i) require(time[i] > time[i - 1]);
  } catch (const runtime::RecordingError& error) {
    require(!error.problems().empty());
    for (const std::string& problem : error.problems()) require(problem.starts_with("f.json:"));
  }
  return 0;
}
