#include "identification/gap/views.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <complex>
#include <functional>
#include <map>
#include <numbers>
#include <string>
#include <unsupported/Eigen/FFT>

#include "identification/gap/free_simulation.h"
#include "identification/gap/structure.h"
#include "model/effects/effect_chain.h"

namespace identification::gap {
namespace {

using Samples = std::vector<double>;
constexpr double kTwoPi = 2 * std::numbers::pi;
constexpr std::size_t kTraces = 4;

struct ViewCoordinate {
  const char* name;
  std::function<Samples(const Signals&)> value;
};

Samples turned(const Signals& s) {
  Samples result;
  for (const double position : s.position_rad)
    result.push_back(position - kTwoPi * std::floor(position / kTwoPi));
  return result;
}

std::vector<ViewCoordinate> view_coordinates() {
  return {{"velocity_rad_per_s", [](const Signals& s) { return s.velocity_rad_per_s; }},
          {"position_rad", turned},
          {"acceleration_rad_per_s2", [](const Signals& s) { return s.acceleration_rad_per_s2; }},
          {"time_since_reversal_s", [](const Signals& s) { return s.since_reversal_s; }},
          {"running_time_s", [](const Signals& s) { return s.running_s; }},
          {"torque_Nm", [](const Signals& s) { return s.torque_Nm; }}};
}

double quantile(Eigen::VectorXd values, double share) {
  if (values.size() == 0) return 0;
  std::sort(values.data(), values.data() + values.size());
  return values[static_cast<Eigen::Index>(share * static_cast<double>(values.size() - 1))];
}

/// Mean square of the residual in each of `bins` equal frequency bands, up to the limit of the rows.
std::vector<double> spectrum(const Eigen::VectorXd& residual, const Rows& rows,
                             const std::vector<Eigen::Index>& use, std::size_t bins) {
  std::vector<double> power(bins, 0);
  Eigen::FFT<double> fft;
  for (std::size_t from = 0; from < use.size();) {
    const std::size_t recording = rows.recording(use[from]);
    std::vector<double> series;
    for (; from < use.size() && rows.recording(use[from]) == recording; ++from) {
      const std::size_t slot = rows.slot(use[from]);
      if (slot >= series.size()) series.resize(std::bit_ceil(slot + 1), 0);
      series[slot] = residual[use[from]];
    }
    if (series.size() < 2) continue;
    std::vector<std::complex<double>> transform;
    fft.fwd(transform, series);
    const std::size_t half = series.size() / 2;
    for (std::size_t k = 0; k <= half; ++k) {
      const double both_sides = k == 0 || k == half ? 1 : 2;
      power[std::min(bins - 1, k * bins / half)] +=
          both_sides * std::norm(transform[k]) / static_cast<double>(series.size() * use.size());
    }
  }
  return power;
}

ResidualMap frequency_map(const Eigen::VectorXd& before, const Eigen::VectorXd& after, const Rows& rows,
                          const std::vector<Eigen::Index>& use) {
  constexpr std::size_t kBands = 40;
  ResidualMap map{.coordinate = "frequency_Hz", .at = {}, .before_Nm = {}, .after_Nm = {}};
  if (use.empty()) return map;
  const std::vector<double> power_before = spectrum(before, rows, use, kBands);
  const std::vector<double> power_after = spectrum(after, rows, use, kBands);
  const double highest_Hz = 0.5 / rows.length_s();
  for (std::size_t i = 0; i < kBands; ++i) {
    map.at.push_back(highest_Hz * (static_cast<double>(i) + 0.5) / kBands);
    map.before_Nm.push_back(std::sqrt(power_before[i]));
    map.after_Nm.push_back(std::sqrt(power_after[i]));
  }
  return map;
}

}  // namespace

std::vector<ResidualMap> residual_maps(const FittedModel& before, const FittedModel& after, const Rows& rows,
                                       const std::vector<Eigen::Index>& use) {
  constexpr int kBins = 60;
  const Eigen::VectorXd left_before = rows.torque_Nm() - predicted_rows(before, rows);
  const Eigen::VectorXd left_after = rows.torque_Nm() - predicted_rows(after, rows);
  std::vector<ResidualMap> maps;
  for (const ViewCoordinate& coordinate : view_coordinates()) {
    const Eigen::VectorXd x = rows.means(coordinate.value)(use);
    const double low = quantile(x, 0.005);
    const double high = quantile(x, 0.995);
    ResidualMap map{.coordinate = coordinate.name, .at = {}, .before_Nm = {}, .after_Nm = {}};
    std::array<double, kBins> count{};
    std::array<double, kBins> sum_before{};
    std::array<double, kBins> sum_after{};
    for (std::size_t i = 0; i < use.size() && high > low; ++i) {
      const double at = (x[static_cast<Eigen::Index>(i)] - low) / (high - low);
      if (!(at >= 0 && at <= 1)) continue;
      const auto bin = std::min<std::size_t>(kBins - 1, static_cast<std::size_t>(at * kBins));
      count[bin] += 1;
      sum_before[bin] += left_before[use[i]];
      sum_after[bin] += left_after[use[i]];
    }
    for (std::size_t bin = 0; bin < kBins; ++bin) {
      if (count[bin] < 3) continue;
      map.at.push_back(low + (high - low) * (static_cast<double>(bin) + 0.5) / kBins);
      map.before_Nm.push_back(sum_before[bin] / count[bin]);
      map.after_Nm.push_back(sum_after[bin] / count[bin]);
    }
    maps.push_back(std::move(map));
  }
  maps.push_back(frequency_map(left_before, left_after, rows, use));
  return maps;
}

FrictionCurve friction_curve(const FittedModel& before, const FittedModel& after, const Rows& rows) {
  constexpr int kPoints = 121;
  constexpr int kMeasured = 41;
  FrictionCurve curve;
  const Eigen::VectorXd velocity = rows.means([](const Signals& s) { return s.velocity_rad_per_s; });
  const double fastest = quantile(velocity.cwiseAbs(), 0.995);
  const model::effects::EffectChain chain_before(before.model.effects);
  const model::effects::EffectChain chain_after(after.model.effects);
  const auto offset = [](const model::effects::DriveModel& model) {
    const auto* found = model.find<model::effects::TorqueOffset>();
    return found ? found->parameters().torque_Nm : 0.0;
  };
  for (int i = 0; i < kPoints; ++i) {
    const double v = fastest * (2.0 * i / (kPoints - 1) - 1);
    const auto level = [&](const model::effects::EffectChain& chain,
                           const model::effects::DriveModel& model) {
      return std::copysign(chain.level_Nm({.speed_rad_per_s = std::abs(v), .direction = v < 0 ? -1.0 : 1.0}),
                           v) +
             offset(model);
    };
    curve.velocity_rad_per_s.push_back(v);
    curve.before_Nm.push_back(level(chain_before, before.model));
    curve.after_Nm.push_back(level(chain_after, after.model));
  }
  // Measured: torque minus everything in the model except friction.
  FittedModel frictionless = after;
  std::erase_if(frictionless.model.effects, [](const model::effects::AnyEffect& any) {
    return std::visit(
               []<class E>(const E&) {
                 return model::effects::ActsOnFriction<E> || model::effects::ActsOnGear<E>;
               },
               any) ||
           std::holds_alternative<model::effects::Presliding>(any) ||
           std::holds_alternative<model::effects::TorqueOffset>(any);
  });
  const Eigen::VectorXd friction = rows.torque_Nm() - predicted_rows(frictionless, rows);
  std::array<double, kMeasured> count{};
  std::array<double, kMeasured> sum_v{};
  std::array<double, kMeasured> sum_f{};
  for (Eigen::Index i = 0; i < velocity.size() && fastest > 0; ++i) {
    const double at = 0.5 * (velocity[i] / fastest + 1);
    if (!(at >= 0 && at <= 1)) continue;
    const auto bin = std::min<std::size_t>(kMeasured - 1, static_cast<std::size_t>(at * kMeasured));
    count[bin] += 1;
    sum_v[bin] += velocity[i];
    sum_f[bin] += friction[i];
  }
  for (std::size_t bin = 0; bin < kMeasured; ++bin) {
    if (count[bin] < 5) continue;
    curve.measured_velocity_rad_per_s.push_back(sum_v[bin] / count[bin]);
    curve.measured_Nm.push_back(sum_f[bin] / count[bin]);
  }
  return curve;
}

Simulated simulate(const model::effects::DriveModel& before, const model::effects::DriveModel& after,
                   const std::vector<Signals>& signals, const Rows& rows,
                   const std::vector<Eigen::Index>& use) {
  const std::vector<Window> windows = windows_of(rows, use);
  Simulated result;
  double square_before = 0;
  double square_after = 0;
  double count = 0;
  std::vector<std::pair<double, Trace>> candidates;
  std::map<std::size_t, std::pair<FreeSimulation, FreeSimulation>> drives;
  for (const Window& window : windows) {
    const Signals& s = signals[window.recording];
    auto drive = drives.find(window.recording);
    if (drive == drives.end())
      drive = drives.emplace(window.recording, std::pair(FreeSimulation(before, s), FreeSimulation(after, s)))
                  .first;
    Trace trace{.recording = s.name,
                .time_s = {},
                .measured_rad_per_s = {},
                .before_rad_per_s = drive->second.first.velocity(window),
                .after_rad_per_s = drive->second.second.velocity(window)};
    for (std::size_t i = 0; i < window.length; ++i) {
      trace.time_s.push_back(s.time_s[window.first + i]);
      trace.measured_rad_per_s.push_back(s.velocity_rad_per_s[window.first + i]);
    }
    const double error_before = squared_error(trace.before_rad_per_s, s, window);
    const double error_after = squared_error(trace.after_rad_per_s, s, window);
    square_before += error_before;
    square_after += error_after;
    count += static_cast<double>(window.length);
    const double difference = error_before - error_after;
    candidates.emplace_back(difference, std::move(trace));
  }
  if (count > 0) {
    result.before_rad_per_s = std::sqrt(square_before / count);
    result.after_rad_per_s = std::sqrt(square_after / count);
  }
  std::ranges::stable_sort(candidates, std::greater{}, &std::pair<double, Trace>::first);
  for (std::size_t i = 0; i < std::min(kTraces, candidates.size()); ++i)
    result.traces.push_back(std::move(candidates[i].second));
  return result;
}

Where where_of(std::string_view effect, const Eigen::VectorXd& contribution, const Rows& rows,
               const std::vector<Eigen::Index>& use) {
  const auto suits = [&]() -> ViewCoordinate {
    if (effect == "spring") return {"position_rad", [](const Signals& s) { return s.position_rad; }};
    if (effect == "cogging" || effect == "imbalance" || effect == "load_friction")
      return {"position_rad", turned};
    if (effect == "inertia" || effect == "elasticity")
      return {"acceleration_rad_per_s2", [](const Signals& s) { return s.acceleration_rad_per_s2; }};
    if (effect == "presliding" || effect == "backlash")
      return {"time_since_reversal_s", [](const Signals& s) { return s.since_reversal_s; }};
    if (effect == "thermal_drift") return {"running_time_s", [](const Signals& s) { return s.running_s; }};
    if (effect == "torque_deadband" || effect == "transport_delay" || effect == "torque_lag")
      return {"torque_command_Nm", [](const Signals& s) { return s.torque_Nm; }};
    return {"velocity_rad_per_s", [](const Signals& s) { return s.velocity_rad_per_s; }};
  }();
  const Eigen::VectorXd x = rows.means(suits.value);
  const double most = quantile(contribution(use).cwiseAbs(), 0.98);
  std::vector<double> there;
  for (const Eigen::Index i : use)
    if (std::abs(contribution[i]) >= 0.5 * most) there.push_back(x[i]);
  std::ranges::sort(there);
  Where where{.coordinate = suits.name};
  if (there.empty()) return where;
  where.from = there[there.size() / 50];
  where.to = there[there.size() - 1 - there.size() / 50];
  return where;
}

}  // namespace identification::gap
