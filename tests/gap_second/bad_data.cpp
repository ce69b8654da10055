#include "tests/gap_second/bad_data.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <stdexcept>

namespace gap_second {
namespace {

using Random = std::mt19937_64;

const std::vector<std::string> kTorques = {"torque_command_Nm", "torque_measured_Nm"};

double uniform(Random& random, double low, double high) {
  return std::uniform_real_distribution<double>(low, high)(random);
}

std::size_t some_row(const Recording& recording, Random& random) {
  return std::uniform_int_distribution<std::size_t>(10, recording.rows() - 10)(random);
}

void scale(Recording& recording, const std::string& column, double factor) {
  for (double& value : recording.at(column)) value *= factor;
}

void spikes(Recording& recording, Random& random) {
  std::vector<double>& torque = recording.at("torque_measured_Nm");
  double sum = 0.0;
  for (double value : torque) sum += value * value;
  const double usual = std::sqrt(sum / static_cast<double>(torque.size()));
  for (int i = 0; i < 4; ++i)
    torque[some_row(recording, random)] = 20 * usual * (uniform(random, 0, 1) < 0.5 ? -1.0 : 1.0);
}

void position_jumps(Recording& recording, Random& random) {
  std::vector<double>& position = recording.at("position_rad");
  for (int i = 0; i < 2; ++i) {
    const double jump = uniform(random, 0.3, 1.0);
    for (std::size_t row = some_row(recording, random); row < position.size(); ++row) position[row] += jump;
  }
}

void gaps(Recording& recording, Random& random) {
  std::vector<bool> gone(recording.rows(), false);
  const std::vector<double>& time_s = recording.at("time_s");
  for (int i = 0; i < 4; ++i) {
    const std::size_t from = some_row(recording, random);
    const double until_s = time_s[from] + uniform(random, 0.05, 0.3);
    for (std::size_t row = from; row + 2 < gone.size() && time_s[row] < until_s; ++row) gone[row] = true;
  }
  recording.remove_rows(gone);
}

/// The cycle came one to three periods late now and then, and measured then.
void late_samples(Recording& recording, Random& random) {
  std::vector<bool> gone(recording.rows(), false);
  for (std::size_t row = 2; row + 4 < gone.size(); ++row) {
    if (uniform(random, 0, 1) > 0.015) continue;
    const int periods = std::uniform_int_distribution<int>(1, 3)(random);
    for (int i = 0; i < periods; ++i) gone[row++] = true;
  }
  recording.remove_rows(gone);
}

/// The sensor answers at its own, slower rate: 77 % of the rows repeat the one before.
void held_sensor(Recording& recording, Random&) {
  std::vector<double>& position = recording.at("position_rad");
  std::vector<double>& torque = recording.at("torque_measured_Nm");
  double next = 0.0;
  std::size_t fresh = 0;
  for (std::size_t row = 0; row < position.size(); ++row) {
    if (static_cast<double>(row) >= next) {
      fresh = row;
      next += 1 / 0.23;
    }
    position[row] = position[fresh];
    torque[row] = torque[fresh];
  }
}

void coarse_position(Recording& recording, Random&) {
  const double tick = 2 * std::numbers::pi / 360;
  for (double& value : recording.at("position_rad")) value = tick * std::floor(value / tick);
}

void saturated_torque(Recording& recording, Random&) {
  std::vector<double>& torque = recording.at("torque_measured_Nm");
  std::vector<double> sizes;
  for (double value : torque) sizes.push_back(std::abs(value));
  const auto place = sizes.begin() + static_cast<std::ptrdiff_t>(sizes.size() * 85 / 100);
  std::nth_element(sizes.begin(), place, sizes.end());
  for (double& value : torque) value = std::clamp(value, -*place, *place);
}

void fill(Recording& recording, const std::string& column, double value) {
  std::vector<double>& values = recording.at(column);
  std::fill(values.begin(), values.end(), value);
}

void only_constant_torque(Recording& recording, Random&) {
  fill(recording, "torque_measured_Nm", recording.at("torque_measured_Nm").front() + 0.01);
  recording.remove_column("torque_command_Nm");
}

void wrong_rate_in_header(Recording& recording, Random&) {
  for (auto& [key, value] : recording.header)
    if (key == "sample_rate_Hz") value = std::to_string(std::stol(value) * 2);
}

void scale_torques(Recording& recording, double factor) {
  for (const std::string& column : kTorques)
    if (recording.has(column)) scale(recording, column, factor);
}

/// A velocity by naive differentiation, in rpm.
void velocity_in_rpm(Recording& recording, Random&) {
  const std::vector<double>& time_s = recording.at("time_s");
  const std::vector<double>& position = recording.at("position_rad");
  std::vector<double> rpm(position.size(), 0.0);
  for (std::size_t row = 1; row + 1 < rpm.size(); ++row)
    rpm[row] =
        (position[row + 1] - position[row - 1]) / (time_s[row + 1] - time_s[row - 1]) * 30 / std::numbers::pi;
  recording.columns.push_back({"velocity_rad_per_s", rpm});
}

struct Spoiling {
  BadData kind;
  std::function<void(Recording&, Random&)> apply;
};

const std::vector<Spoiling>& spoilings() {
  static const std::vector<Spoiling> table = {
      {{"torque spikes", {"spike", "outlier"}}, spikes},
      {{"position jumps", {"jump", "slip"}}, position_jumps},
      {{"gaps", {"gap of", "gaps", "missing row", "without rows", "interrupt", "samples are missing"}}, gaps},
      {{"late samples", {"late", "samples are missing"}}, late_samples},
      {{"held sensor", {"held", "repeat", "hold"}}, held_sensor},
      {{"coarse position", {"coarse", "quanti", "resolution", "tick", "finer encoder"}}, coarse_position},
      {{"saturated torque", {"saturat", "clip", "limit"}}, saturated_torque},
      {{"zero measured torque", {"constant", "zero", "never changes"}},
       [](Recording& recording, Random&) { fill(recording, "torque_measured_Nm", 0.0); }},
      {{"only a constant torque", {"constant", "never changes"}}, only_constant_torque},
      {{"constant position", {"constant", "never moves", "does not move", "moves", "rest"}},
       [](Recording& recording, Random&) { fill(recording, "position_rad", 1.0); }},
      {{"torque of wrong sign", {"sign", "direction"}},
       [](Recording& recording, Random&) { scale_torques(recording, -1); }},
      {{"measured torque of wrong sign", {"sign", "direction"}},
       [](Recording& recording, Random&) { scale(recording, "torque_measured_Nm", -1); }},
      {{"wrong rate in header", {"sample_rate", "rate"}}, wrong_rate_in_header},
      {{"position in degrees", {"degree"}},
       [](Recording& recording, Random&) { scale(recording, "position_rad", 180 / std::numbers::pi); }},
      {{"velocity in rpm", {"rpm", "per minute"}}, velocity_in_rpm},
      {{"time in milliseconds", {"millisecond", " ms", "time_s in seconds"}},
       [](Recording& recording, Random&) { scale(recording, "time_s", 1000); }},
      {{"torque in mN m", {"milli", "mn"}},
       [](Recording& recording, Random&) { scale_torques(recording, 1000); }},
      {{"torque on motor side", {"gear", "motor side", "ratio"}},
       [](Recording& recording, Random&) { scale_torques(recording, 1.0 / 26); }}};
  return table;
}

}  // namespace

const std::vector<BadData>& kinds_of_bad_data() {
  static const std::vector<BadData> kinds = [] {
    std::vector<BadData> all;
    for (const Spoiling& spoiling : spoilings()) all.push_back(spoiling.kind);
    return all;
  }();
  return kinds;
}

void spoil(const std::string& kind, Recording& recording, std::mt19937_64& random) {
  for (const Spoiling& spoiling : spoilings()) {
    if (spoiling.kind.name != kind) continue;
    spoiling.apply(recording, random);
    return;
  }
  throw std::invalid_argument("unknown kind of bad data: " + kind);
}

}  // namespace gap_second
