// Drive models, and recordings of the drives cut into windows, for exported_model_test.mjs: the state in
// which a window starts, its torque, the measured velocity, and the error of our own simulation. usage:
// export_windows OUT                      the built-in cases: hidden drives and a model of each
//        export_windows OUT MODEL RECORDING...   one case
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <numeric>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "analysis/inputs.h"
#include "identification/gap/free_simulation.h"
#include "identification/gap/measured_gap.h"
#include "runtime/configuration/drive_model_file.h"
#include "tests/gap/gap_cases.h"
#include "tests/gap/hidden_experiment.h"

namespace {

namespace fs = std::filesystem;
using gap_test::HiddenEffects;
using identification::gap::Signals;
using identification::gap::Source;
using identification::gap::Window;
using model::effects::DriveModel;
using model::effects::make_effect;
using nlohmann::json;

/// What a person who knows the hidden drive would write down.
struct KnownDrive {
  const char* name;
  HiddenEffects hidden;
  std::vector<model::effects::AnyEffect> effects;
  bool commanded = false;  ///< the torque was not measured
  double gain = 1;         ///< delivered torque over recorded command
};

std::vector<KnownDrive> known_drives() {
  std::vector<KnownDrive> all;
  all.push_back({.name = "coulomb_viscous", .hidden = {}, .effects = {}});
  all.push_back(
      {.name = "stribeck",
       .hidden = {.stribeck_Nm = 0.04, .stribeck_rad_per_s = 0.5},
       .effects = {make_effect(
           "stribeck",
           {{"static_torque_Nm", 0.085}, {"velocity_rad_per_s", 0.5}, {"exponent", 2}, {"tail", 1}})}});
  all.push_back(
      {.name = "midspeed_dip",
       .hidden = {.dip_Nm = 0.02},
       .effects = {make_effect("midspeed_dip",
                               {{"depth_Nm", 0.02}, {"centre_rad_per_s", 2.5}, {"width_rad_per_s", 0.8}})}});
  all.push_back({.name = "quadratic_drag",
                 .hidden = {.drag_Nm_s2_per_rad2 = 0.001},
                 .effects = {make_effect("quadratic_drag", {{"coefficient_Nm_s2_per_rad2", 0.001}})}});
  all.push_back(
      {.name = "presliding",
       .hidden = {.contact_rad_per_Nm = 1 / 5.0},
       .effects = {make_effect(
           "presliding", {{"stiffness_Nm_per_rad", 5}, {"damping_Nm_s_per_rad", 0.02}, {"exponent", 1}})}});
  all.push_back(
      {.name = "cogging",
       .hidden = {.cogging_Nm = 0.02, .cogging_per_rev = 25.84, .cogging_phase_rad = 0.7},
       .effects = {
           make_effect("cogging", {{"amplitude_Nm", 0.02}, {"periods_per_rev", 25.84}, {"phase_rad", 0.7}}),
           make_effect("cogging",
                       {{"amplitude_Nm", 0.006}, {"periods_per_rev", 51.68}, {"phase_rad", 0.7}})}});
  all.push_back({.name = "imbalance",
                 .hidden = {.imbalance_Nm = 0.03, .imbalance_rest_rad = 0.5},
                 .effects = {make_effect("imbalance", {{"torque_Nm", 0.03}, {"rest_position_rad", 0.5}})}});
  all.push_back({.name = "torque_offset",
                 .hidden = {.offset_Nm = 0.02},
                 .effects = {make_effect("torque_offset", {{"torque_Nm", 0.02}})}});
  all.push_back({.name = "direction_asymmetry",
                 .hidden = {.asymmetry_Nm = 0.012},
                 .effects = {make_effect("direction_asymmetry", {{"coulomb_Nm", 0.012}})}});
  all.push_back({.name = "backlash",
                 .hidden = {.gap_rad = 0.05},
                 .effects = {make_effect("backlash", {{"gap_rad", 0.05}, {"load_share", 0.4}})}});
  all.push_back({.name = "elasticity",
                 .hidden = {.shaft_rad_per_Nm = 1 / 8.0},
                 .effects = {make_effect("elasticity", {{"stiffness_Nm_per_rad", 8}, {"load_share", 0.4}})}});
  all.push_back({.name = "transport_delay",
                 .hidden = {.delay_s = 0.03},
                 .effects = {make_effect("transport_delay", {{"delay_s", 0.03}})},
                 .commanded = true});
  constexpr double kLag_s = 0.04;
  all.push_back({.name = "torque_lag",
                 .hidden = {.command_lag_s = kLag_s},
                 .effects = {make_effect("torque_lag", {{"time_constant_s", kLag_s}})},
                 .commanded = true});
  all.push_back({.name = "actuator_gain",
                 .hidden = {},
                 .effects = {make_effect("actuator_gain", {{"gain", 1.3}})},
                 .commanded = true,
                 .gain = 1.3});
  return all;
}

DriveModel model_of(const KnownDrive& drive) {
  const gap_test::Plant plant;
  DriveModel model{.name = drive.name,
                   .inertia_kg_m2 = plant.inertia_kg_m2,
                   .encoder_ticks_per_rev = 104000,
                   .torque_noise_Nm = 0.0015};
  model.effects = {make_effect("coulomb", {{"torque_Nm", plant.coulomb_Nm}}),
                   make_effect("viscous", {{"coefficient_Nm_s_per_rad", plant.viscous_Nm_s_per_rad}})};
  model.effects.insert(model.effects.end(), drive.effects.begin(), drive.effects.end());
  return model;
}

std::vector<Source> recordings_of(const KnownDrive& drive) {
  using gap_test::Experiment;
  std::vector<Source> sources =
      gap_test::recordings_of({.plant = {}, .effects = drive.hidden, .sensors = {}},
                              {{.experiment = Experiment::kMultisine, .duration_s = 10, .seed = 5},
                               {.experiment = Experiment::kRandomSteps, .duration_s = 10, .seed = 6}});
  for (Source& source : sources) {
    auto& columns = source.recording.columns;
    if (drive.commanded)
      std::erase_if(columns, [](const auto& column) { return column.name == "torque_measured_Nm"; });
    for (auto& column : columns)
      if (column.name == "torque_command_Nm")
        for (double& command : column.values) command /= drive.gain;
  }
  return sources;
}

/// Slices of the columns of a window.
std::vector<double> slice(const std::vector<double>& values, const Window& window) {
  const auto begin = values.begin() + static_cast<std::ptrdiff_t>(window.first);
  return {begin, begin + static_cast<std::ptrdiff_t>(window.length)};
}

/// The half second before a window, as far as there is one.
Window before(const Window& window, const Signals& s) {
  const std::size_t length = std::min(window.first, static_cast<std::size_t>(0.5 / s.period_s));
  return {window.recording, window.first - length, length};
}

json windows_json(const DriveModel& model, const identification::gap::MeasuredGap& data) {
  std::vector<Eigen::Index> all(static_cast<std::size_t>(data.rows().count()));
  std::iota(all.begin(), all.end(), Eigen::Index{0});
  json windows = json::array();
  double squares = 0;
  std::size_t samples = 0;
  const bool two_masses = model.find<model::effects::Backlash>() != nullptr ||
                          model.find<model::effects::Elasticity>() != nullptr;
  for (const Window& window : identification::gap::windows_of(data.rows(), all)) {
    const Signals& s = data.signals()[window.recording];
    const identification::gap::FreeSimulation ours(model, s);
    const double square = identification::gap::squared_error(ours.velocity(window), s, window);
    if (!std::isfinite(square)) throw std::runtime_error("our simulation is unstable");
    squares += square;
    samples += window.length;
    json one{{"position", s.position_rad[window.first]},
             {"velocity", s.velocity_rad_per_s[window.first]},
             {"torque", slice(s.torque_Nm, window)},
             {"measured", slice(s.velocity_rad_per_s, window)}};
    // What the actuator still delivers.
    if (s.torque_is_command) one["before"] = slice(s.torque_Nm, before(window, s));
    if (two_masses) {
      const auto load = identification::gap::load_side_of(model, s);
      one["load_position"] = s.position_rad[window.first] - load.twist_rad[window.first];
      one["load_velocity"] = s.velocity_rad_per_s[window.first] - load.twist_rate_rad_per_s[window.first];
    }
    if (model.find<model::effects::Presliding>() != nullptr)
      one["deflection"] = identification::gap::bristle_deflection_rad(model, s)[window.first];
    windows.push_back(std::move(one));
  }
  if (windows.empty()) throw std::runtime_error("no recording has a second of motion");
  return {{"period_s", data.signals().front().period_s},
          {"commanded", data.signals().front().torque_is_command},
          {"ours_rad_per_s", std::sqrt(squares / static_cast<double>(samples))},
          {"gap_Nm", data.gap_Nm(model)},
          {"windows", std::move(windows)}};
}

void write_case(const fs::path& out, const std::string& name, const DriveModel& model,
                std::vector<Source> data) {
  const fs::path directory = out / name;
  fs::create_directories(directory);
  const identification::gap::MeasuredGap measured(model, std::move(data));
  std::ofstream(directory / "model.toml") << runtime::drive_model_text(model);
  std::ofstream(directory / "windows.json") << windows_json(model, measured);
}

}  // namespace

int main(int argc, char** argv) {
  try {
    const std::vector<std::string> arguments(argv + 1, argv + argc);
    if (arguments.empty() || arguments.size() == 2)
      throw std::invalid_argument("usage: export_windows OUT [MODEL RECORDING...]");
    if (arguments.size() > 2) {
      analysis::InputPaths paths{.model = arguments[1]};
      paths.data.assign(arguments.begin() + 2, arguments.end());
      analysis::Inputs inputs = analysis::read_inputs(paths);
      write_case(arguments[0], inputs.model.name.empty() ? "drive" : inputs.model.name, inputs.model,
                 std::move(inputs.data));
      return 0;
    }
    for (const KnownDrive& drive : known_drives())
      write_case(arguments[0], drive.name, model_of(drive), recordings_of(drive));
    return 0;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "export_windows: %s\n", error.what());
    return 1;
  }
}
