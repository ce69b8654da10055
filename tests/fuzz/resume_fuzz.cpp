// Files of an experiment for --resume: its progress, results and rows, separated by zero bytes.
#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>
#include <string>
#include <string_view>

#include "apps/youbot_bench/experiment_recording.h"
#include "hal/setup_error.h"
#include "tests/fuzz/fuzz_target.h"
#include "tests/support/temporary_directory.h"

namespace {

using fuzz::require;
using youbot_bench::ExperimentRecording;

constexpr std::string_view kProgress =
    "# youbot recording v1\n# experiment: breakaway\ntime_s,measurement\n0.002000,0\n0.004000,1\n";
constexpr std::string_view kResults =
    "# youbot recording v1\n# rig: wheel-1\ntime_s,breakaway_Nm\n0.002000,0.1\n0.004000,nan\n";
constexpr std::string_view kRows =
    "# youbot recording v1\n# rig: wheel-1\ntime_s,torque_command_Nm,torque_measured_Nm,position_rad,"
    "velocity_rad_per_s\n0.001000,0.1,0.1,0.0,0.0\n0.002000,0.1,0.1,0.1,0.0\n0.003000,0.1,0.1,0.2,0.0\n"
    "0.004000,0,0,0.3,0\n0.005000,0.1,0.1,0.4,0.0\n";

std::string seed(std::string_view progress, std::string_view results, std::string_view rows) {
  std::string text;
  for (const std::string_view part : {progress, results, rows}) (text += part) += '\0';
  return text;
}

struct Resumed {
  int finished = 0;
  double until_s = 0;
  std::uint64_t rows = 0;
};

Resumed resume(const std::filesystem::path& directory) {
  const ExperimentRecording::Description description{.directory = directory,
                                                     .experiment = "breakaway",
                                                     .result = "breakaway-map",
                                                     .joints = {"wheel-1"},
                                                     .commands = {.torque = true},
                                                     .result_columns = {"breakaway_Nm"},
                                                     .not_measured = {"never moved"}};
  ExperimentRecording recording(description, true);
  recording.keep();
  const Resumed resumed{.finished = recording.finished_measurements(),
                        .until_s = recording.finished_until_s()};
  recording.close();
  require(recording.problems().empty());
  require(recording.measurements_on_disk() == resumed.finished);
  return {resumed.finished, resumed.until_s, recording.rows_on_disk()};
}

std::size_t lines(std::string_view text) {
  return static_cast<std::size_t>(std::ranges::count(text, '\n')) + 1;
}

}  // namespace

std::vector<fuzz::Bytes> fuzz::seeds() {
  std::vector<Bytes> seeds;
  for (const std::string& text :
       {seed(kProgress, kResults, kRows), seed(kProgress.substr(0, kProgress.size() - 4), kResults, kRows),
        seed(kProgress, kResults.substr(0, kResults.size() - 20), kRows)})
    seeds.emplace_back(text.begin(), text.end());
  return seeds;
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  std::array<std::string, 3> parts;
  std::string_view left(reinterpret_cast<const char*>(data), size);
  for (std::string& part : parts) {
    part = left.substr(0, left.find('\0'));
    left.remove_prefix(std::min(left.size(), part.size() + 1));
  }
  static const support::TemporaryDirectory folder;
  folder.write("breakaway/progress", parts[0]);
  folder.write("breakaway-map/wheel-1.csv", parts[1]);
  folder.write("breakaway/wheel-1.csv", parts[2]);
  try {
    const Resumed first = resume(folder.path());
    require(first.finished >= 0 && static_cast<std::size_t>(first.finished) < lines(parts[0]) &&
            static_cast<std::size_t>(first.finished) < lines(parts[1]));
    require(first.rows < lines(parts[2]));
    require(first.finished == 0 ? first.until_s == -1 : std::isfinite(first.until_s) && first.until_s >= 0);
    // The kept data are complete: resuming again keeps the same.
    const Resumed again = resume(folder.path());
    require(again.finished == first.finished && again.until_s == first.until_s && again.rows == first.rows);
  } catch (const std::invalid_argument& error) {
    require(std::string_view(error.what()).starts_with("--resume: " + folder.path().string()));
  }
  return 0;
}
