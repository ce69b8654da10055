// Recordings as user input.
#include <cmath>
#include <string>
#include <string_view>

#include "runtime/recording/recording_reader.h"
#include "tests/fuzz/fuzz_target.h"

using fuzz::require;

std::vector<fuzz::Bytes> fuzz::seeds() {
  std::vector<Bytes> result;
  for (const std::string_view text :
       {"# youbot recording v1\n# rig: wheel-1\n# sample_rate_Hz: 1000\n"
        "time_s,torque_command_Nm,position_rad\n0.000,0.01,1.5\n0.001,-0.02,1.25e-1\n",
        "# youbot recording v1\r\n# experiment: steady-state-map\r\n"
        "velocity_rad_per_s, time_s, torque_ci95_Nm\r\n-0.5,1,2e-4\r\n0.5,2,3e-4\r\n\r\n",
        "time_ms;position_deg\n0,001;5\n", "# youbot recording v1\ntime_s,x,x,\n1,nan,inf,\n0,#,1\n"})
    result.emplace_back(text.begin(), text.end());
  return result;
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const fuzz::Bytes copy(data, data + size);
  const std::string_view text(reinterpret_cast<const char*>(copy.data()), copy.size());
  try {
    const runtime::ReadRecording read = runtime::parse_recording(text, "f.csv");
    require(read.recording.rows() > 0);
    for (const auto& column : read.recording.columns) {
      require(column.values.size() == read.recording.rows());
      for (const double value : column.values) require(std::isfinite(value));
    }
    const auto time = read.recording.column("time_s");
    for (std::size_t i = 1; i < time.size(); ++i) require(time[i] > time[i - 1]);
  } catch (const runtime::RecordingError& error) {
    require(!error.problems().empty());
    require(error.problems().size() <= runtime::RecordingError::kMaxProblems + 1);
  }
  return 0;
}
