// Input of youbot-gap: a model, a recording to fit and one held out, separated by zero bytes.
#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>
#include <string>
#include <string_view>

#include "analysis/inputs.h"
#include "runtime/configuration/toml_reader.h"
#include "tests/fuzz/fuzz_target.h"
#include "tests/fuzz/memory_file.h"

namespace {

using fuzz::require;

constexpr std::string_view kModel =
    "format = \"youbot-drive-model/1\"\nname = \"wheel-1\"\ninertia_kg_m2 = 0.0112\n[sensor]\n"
    "encoder_ticks_per_rev = 104000\ntorque_noise_Nm = 0.0015\n[[effect]]\ntype = \"coulomb\"\n"
    "torque_Nm = 0.045\n";

fuzz::Bytes joined(std::string_view model, std::string_view data, std::string_view held_out) {
  std::string text(model);
  text += '\0';
  text += data;
  text += '\0';
  text += held_out;
  return fuzz::bytes_of(text);
}

std::string recording(const std::string& rig, double period_s) {
  std::string text = "# youbot recording v1\n# rig: " + rig +
                     "\n# sample_rate_Hz: 1000\ntime_s,torque_command_Nm,position_rad\n";
  for (int i = 0; i < 5; ++i)
    text += std::to_string(i * period_s) + "," + std::to_string(0.01 * i) + "," + std::to_string(i) + "\n";
  return text;
}

/// Rows that can be worked on in a bounded time.
void check(const identification::gap::Source& source) {
  constexpr double kLongestStep_s = 1;
  require(source.recording.rows() > 0);
  const auto time_s = source.recording.column("time_s");
  for (std::size_t i = 1; i < time_s.size(); ++i)
    require(time_s[i] > time_s[i - 1] && time_s[i] - time_s[i - 1] <= kLongestStep_s);
  for (const auto& column : source.recording.columns)
    require(std::ranges::all_of(column.values, [](double value) { return std::isfinite(value); }));
}

}  // namespace

std::vector<fuzz::Bytes> fuzz::seeds() {
  return {joined(kModel, recording("wheel-1", 0.001), recording("wheel-1", 0.004)),
          joined(kModel, recording("wheel-1", 1000), recording("wheel-1", 0.004)),
          joined(kModel, recording("wheel-1", 0.001), recording("wheel-2", 0.001)),
          joined(kModel, "time_s,torque_measured_Nm,velocity_rad_per_s\r\n1,2,3\r\n1.5,2,3\r\n", "")};
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const std::array<fuzz::MemoryFile, 3> files;  // model, data, held out
  std::string_view left(reinterpret_cast<const char*>(data), size);
  for (const fuzz::MemoryFile& file : files) {
    const std::string_view part = left.substr(0, left.find('\0'));
    file.hold(part);
    left.remove_prefix(std::min(left.size(), part.size() + 1));
  }
  const auto names_one = [](std::string_view problem) {
    return std::ranges::any_of(
        files, [&](const fuzz::MemoryFile& file) { return problem.starts_with(file.path() + ":"); });
  };
  try {
    const analysis::Inputs inputs = analysis::read_inputs(
        {.model = files[0].path(), .data = {files[1].path()}, .held_out = {files[2].path()}});
    require(inputs.data.size() == 1 && inputs.held_out.size() == 1);
    for (const auto& sources : {inputs.data, inputs.held_out}) check(sources.front());
  } catch (const runtime::ConfigError& error) {
    require(!error.problems().empty() && std::ranges::all_of(error.problems(), names_one));
  } catch (const std::invalid_argument& error) {
    require(names_one(error.what()));  // two rigs
  }
  return 0;
}
