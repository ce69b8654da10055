#include "identification/gap/free_simulation.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <span>
#include <utility>

#include "identification/gap/between_flanks.h"
#include "identification/gap/parallel.h"
#include "model/effects/effect_chain.h"
#include "sim/model_drive.h"

namespace identification::gap {
namespace {

constexpr double kWindow_s = 1.0;
constexpr std::size_t kMaxWindows = 60;
constexpr std::size_t kMinWindowSamples = 4;
/// Commands before a window that its actuator may still deliver: the longest delay, and the slow part of
/// lags.
constexpr double kActuatorMemory_s = 2.0;
/// Simulation steps per sample: as many as friction needs.
constexpr int kMinSubsteps = 20;
/// Share of the squared motion that a simulation may leave and still follow it. No window leaves more than a
/// model that stands still: a drive with little inertia against its friction runs away after the smallest
/// error of torque, and how far says nothing about its model.
constexpr double kMaxUnfollowed = 0.5;

int substeps_for(const model::effects::DriveModel& model, double period_s) {
  if (model.find<model::effects::Backlash>() == nullptr) return kMinSubsteps;
  const model::effects::EffectChain chain(model.effects);
  const double step_s = BetweenFlanks::longest_step_s(chain.arranged({.inertia_kg_m2 = model.inertia_kg_m2}));
  return std::max(kMinSubsteps, static_cast<int>(std::ceil(period_s / step_s)));
}

model::effects::DriveModel without_actuator(model::effects::DriveModel model) {
  std::erase_if(model.effects, [](const model::effects::AnyEffect& effect) {
    return std::visit([]<class E>(const E&) { return model::effects::ActsOnActuator<E>; }, effect);
  });
  return model;
}

/// For each window, its share of the squared velocities in all windows of its recording.
std::vector<double> squares_of_motion(const Rows& rows, const std::vector<Window>& windows) {
  struct Sum {
    double square = 0;
    std::size_t samples = 0;
  };
  std::map<std::size_t, Sum> of_recording;
  for (const Window& window : windows) {
    Sum& sum = of_recording[window.recording];
    sum.square +=
        squared_error(std::vector<double>(window.length, 0.0), rows.signals()[window.recording], window);
    sum.samples += window.length;
  }
  std::vector<double> squares;
  for (const Window& window : windows) {
    const Sum& sum = of_recording[window.recording];
    squares.push_back(sum.square * static_cast<double>(window.length) / static_cast<double>(sum.samples));
  }
  return squares;
}

}  // namespace

std::vector<Window> windows_of(const Rows& rows, const std::vector<Eigen::Index>& use) {
  std::vector<Window> windows;
  for (const Eigen::Index row : use) {
    const std::size_t recording = rows.recording(row);
    const Signals& s = rows.signals()[recording];
    const auto length = static_cast<std::size_t>(kWindow_s / s.period_s);
    const auto first =
        static_cast<std::size_t>(std::llround((rows.time_s(row) - s.time_s.front()) / s.period_s));
    if (length < kMinWindowSamples || first + length > s.size()) continue;
    if (!windows.empty() && windows.back().recording == recording &&
        first < windows.back().first + windows.back().length)
      continue;
    windows.push_back({recording, first, length});
  }
  if (windows.size() <= kMaxWindows) return windows;
  std::vector<Window> spread;
  for (std::size_t i = 0; i < kMaxWindows; ++i) spread.push_back(windows[i * windows.size() / kMaxWindows]);
  return spread;
}

FreeSimulation::FreeSimulation(const model::effects::DriveModel& model, const Signals& signals)
    : model_(signals.torque_is_command ? model : without_actuator(model)), signals_(signals) {
  if (model.find<model::effects::Backlash>() != nullptr ||
      model.find<model::effects::Elasticity>() != nullptr)
    load_ = load_side_of(model, signals);
  if (model.find<model::effects::Presliding>() != nullptr)
    deflection_rad_ = bristle_deflection_rad(model, signals);
}

std::vector<double> FreeSimulation::velocity(const Window& window) const {
  const Signals& s = signals_;
  sim::ModelDrive drive(model_, s.period_s, substeps_for(model_, s.period_s));
  const model::effects::EffectChain::Motion start =
      model::effects::EffectChain(model_.effects)
          .motion_behind({.position_rad = s.position_rad[window.first],
                          .velocity_rad_per_s = s.velocity_rad_per_s[window.first]});
  drive.set_position(start.position_rad);
  drive.set_velocity(start.velocity_rad_per_s);
  if (load_)
    drive.set_load(start.position_rad - load_->twist_rad[window.first],
                   start.velocity_rad_per_s - load_->twist_rate_rad_per_s[window.first]);
  if (!deflection_rad_.empty()) drive.set_deflection(deflection_rad_[window.first]);
  drive.set_laws(law_states(model_, s, window.first));
  drive.set_running(s.running_s[window.first]);
  drive.set_since_reversal(s.since_reversal_s[window.first]);
  if (s.torque_is_command) {
    const auto remembered =
        std::min(window.first, static_cast<std::size_t>(std::llround(kActuatorMemory_s / s.period_s)));
    drive.set_commanded(std::span(s.torque_Nm).subspan(window.first - remembered, remembered));
  }
  std::vector<double> velocity;
  for (std::size_t i = window.first; i < window.first + window.length; ++i) {
    velocity.push_back(drive.velocity_rad_per_s());
    drive.step(s.torque_Nm[i]);
  }
  return velocity;
}

double squared_error(const std::vector<double>& simulated_rad_per_s, const Signals& s, const Window& window) {
  double square = 0;
  for (std::size_t i = 0; i < window.length; ++i)
    square += std::pow(simulated_rad_per_s[i] - s.velocity_rad_per_s[window.first + i], 2);
  return square;
}

SimulatedMotion simulated_motion(const model::effects::DriveModel& model, const Rows& rows,
                                 const std::vector<Window>& windows) {
  std::map<std::size_t, FreeSimulation> drives;
  for (const Window& window : windows)
    drives.try_emplace(window.recording, model, rows.signals()[window.recording]);
  const std::vector<double> standing = squares_of_motion(rows, windows);
  SimulatedMotion motion{.squares = std::vector<double>(windows.size())};
  in_parallel(windows.size(), [&](std::size_t i) {
    const Window& window = windows[i];
    const double square =
        squared_error(drives.at(window.recording).velocity(window), rows.signals()[window.recording], window);
    motion.squares[i] = std::isfinite(square) ? square : std::numeric_limits<double>::infinity();
  });
  double left = 0;
  for (std::size_t i = 0; i < windows.size(); ++i) left += std::min(motion.squares[i], standing[i]);
  motion.follows = left < kMaxUnfollowed * std::accumulate(standing.begin(), standing.end(), 0.0);
  return motion;
}

}  // namespace identification::gap
