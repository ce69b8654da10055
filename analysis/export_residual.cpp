#include "analysis/export_residual.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <array>
#include <map>
#include <stdexcept>

#include "hal/setup_error.h"
#include "runtime/program/build_info.h"
#include "runtime/recording/recording_file.h"

namespace analysis {
namespace {

using identification::gap::Signals;

/// "data/kp100.csv" → "data-kp100", and a number if that is taken.
std::string file_name(const std::string& recording, std::map<std::string, int>& taken) {
  std::string name = std::filesystem::path(recording).replace_extension().string();
  std::ranges::replace(name, '/', '-');
  const int before = taken[name]++;
  return name + (before > 0 ? fmt::format("-{}", before + 1) : "") + ".csv";
}

}  // namespace

std::vector<std::string> write_residuals(const model::effects::DriveModel& model,
                                         const identification::gap::MeasuredGap& data,
                                         const std::filesystem::path& directory) {
  std::map<std::string, int> taken;
  std::vector<std::string> names;
  for (const Signals& s : data.signals()) {
    const std::vector<double> predicted_Nm = identification::gap::predicted_torque_Nm(model, s);
    const std::filesystem::path path = directory / file_name(s.name, taken);
    runtime::RecordingFile file(path,
                                {{"rig", model.name.empty() ? "drive" : model.name},
                                 {"experiment", "residual"},
                                 {"sample_rate_Hz", fmt::format("{:.9g}", 1 / s.period_s)},
                                 {"band_Hz", fmt::format("{:.4g}", s.band_Hz)},
                                 {"torque", s.torque_is_command ? "commanded" : "measured"},
                                 {"software", runtime::build_version()}},
                                {{"time_s", 6},
                                 {"position_rad"},
                                 {"velocity_rad_per_s"},
                                 {"acceleration_rad_per_s2"},
                                 {s.torque_is_command ? "torque_command_Nm" : "torque_measured_Nm"},
                                 {"torque_predicted_Nm"},
                                 {"torque_residual_Nm"},
                                 {"moving", 0}});
    for (std::size_t i = 0; i < s.size(); ++i)
      file.append_row(std::array{s.time_s[i], s.position_rad[i], s.velocity_rad_per_s[i],
                                 s.acceleration_rad_per_s2[i], s.torque_Nm[i], predicted_Nm[i],
                                 s.torque_Nm[i] - predicted_Nm[i], s.moving[i]});
    file.close();
    if (const std::string problem = file.error(); !problem.empty())
      throw hal::SetupError(path.string(), "write the residual: " + problem, "free some space");
    names.push_back(path.filename().string());
  }
  return names;
}

}  // namespace analysis
