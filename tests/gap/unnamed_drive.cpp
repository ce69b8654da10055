#include "tests/gap/unnamed_drive.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <random>
#include <string>

namespace gap_test {
namespace {

constexpr double kOddSample_s = 1e-3;
constexpr int kSubsteps = 20;
constexpr double kOddStep_s = kOddSample_s / kSubsteps;
constexpr double kTicks = 104000;
constexpr double kTop_rad_per_s = 8;

struct Shape {
  double speed_rad_per_s;
  double phase_rad;
  double time_s;
};

/// Friction beyond Coulomb and viscous, at a speed, and a torque against positive motion.
struct Extra {
  double level_Nm = 0;
  double torque_Nm = 0;
};

Extra extra(const OddDrive& drive, const Shape& shape, double position, double speed, double since_s) {
  const double a = drive.amount_Nm;
  const auto wave = [&] { return a * std::sin(2 * std::numbers::pi * speed / shape.speed_rad_per_s); };
  const auto relaxation = [&] { return 1.5 * a * std::exp(-since_s / shape.time_s); };
  const double around = std::cos(position - shape.phase_rad);
  switch (drive.oddity) {
    case Oddity::kNone: return {};
    case Oddity::kSpeedWave: return {wave(), 0};
    case Oddity::kSpeedStep: return {speed > shape.speed_rad_per_s ? 2 * a : 0, 0};
    case Oddity::kDetent: {
      const double off = std::remainder(position - shape.phase_rad, 2 * std::numbers::pi) / 0.25;
      return {0, 6 * a * off * std::exp(-off * off)};
    }
    case Oddity::kRelaxation: return {relaxation(), 0};
    case Oddity::kEccentricViscous: return {0.4 * a * (1 + around) * speed, 0};
    case Oddity::kTwisted:
      return {a * (around + 0.7 * std::cos(3 * position)) + a * std::sin(1.1 * speed), 0};
    case Oddity::kLoadTimesSpeed: return {std::abs(drive.weight_Nm * std::sin(position)) * 2 * a * speed, 0};
    case Oddity::kWaveAndRelaxation: return {wave() + relaxation(), 0};
  }
  return {};
}

}  // namespace

std::string_view name_of(Oddity oddity) {
  constexpr std::array<std::string_view, kOddities> kNames{
      "none",    "speed wave",       "speed step",         "detent", "relaxation", "eccentric viscous",
      "twisted", "load times speed", "wave and relaxation"};
  return kNames[static_cast<std::size_t>(oddity)];
}

identification::gap::Source recording_of(const OddDrive& drive, bool staircase, std::uint64_t seed,
                                         double duration_s) {
  std::mt19937_64 of_shape(drive.seed);
  std::uniform_real_distribution<double> share(0, 1);
  const Shape shape{2 + 2 * share(of_shape), 2 * std::numbers::pi * share(of_shape),
                    0.1 + 0.2 * share(of_shape)};

  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  std::vector<double> steps;
  for (int i = 0; i < 200; ++i) steps.push_back(kTop_rad_per_s * (2 * share(random) - 1));
  std::vector<double> phases;
  for (int i = 0; i < 12; ++i) phases.push_back(2 * std::numbers::pi * share(random));
  const double length_s = 0.8 + 0.4 * share(random);
  const auto wanted = [&](double t) {
    if (staircase) return steps[static_cast<std::size_t>(t / length_s)];
    double v = 0;
    for (std::size_t n = 0; n < phases.size(); ++n)
      v += 0.25 * kTop_rad_per_s / (1 + 0.1 * static_cast<double>(n)) *
           std::sin(2 * std::numbers::pi * (0.05 + 0.11 * static_cast<double>(n)) * t + phases[n]);
    return v;
  };

  identification::gap::Source source{
      .name = std::string(staircase ? "steps-" : "sines-") + std::to_string(seed) + ".csv", .recording = {}};
  source.recording.rig = "odd";
  source.recording.columns = {
      {"time_s", {}}, {"torque_command_Nm", {}}, {"torque_measured_Nm", {}}, {"position_rad", {}}};
  double position = 0.3 * normal(random);
  double velocity = 0;
  double since_s = 0;
  double integral_Nm = 0;
  double delivered_Nm = 0;
  for (int k = 0; k * kOddSample_s < duration_s; ++k) {
    const double now_s = k * kOddSample_s;
    const double error = wanted(now_s) - velocity;
    integral_Nm = std::clamp(integral_Nm + 1.0 * error * kOddSample_s, -0.3, 0.3);
    const double command = std::clamp(0.25 * error + integral_Nm, -1.0, 1.0);
    const std::array<double, 4> row{
        now_s, command, delivered_Nm + drive.noise_Nm * normal(random),
        std::floor(position * kTicks / (2 * std::numbers::pi)) * 2 * std::numbers::pi / kTicks};
    for (std::size_t c = 0; c < row.size(); ++c) source.recording.columns[c].values.push_back(row[c]);
    for (int i = 0; i < kSubsteps; ++i) {
      const double speed = std::abs(velocity);
      const Extra more = extra(drive, shape, position, speed, since_s);
      const double friction_Nm =
          std::max(drive.coulomb_Nm + drive.viscous_Nm_s_per_rad * speed + more.level_Nm, 1e-3);
      const double free = velocity + kOddStep_s *
                                         (command - more.torque_Nm - drive.weight_Nm * std::sin(position)) /
                                         drive.inertia_kg_m2;
      const double stops = kOddStep_s * friction_Nm / drive.inertia_kg_m2;  // as much as friction can take
      const double after = std::copysign(std::max(std::abs(free) - stops, 0.0), free);
      since_s = after * velocity <= 0 ? 0 : since_s + kOddStep_s;
      velocity = after;
      position += kOddStep_s * velocity;
    }
    delivered_Nm = command;
  }
  return source;
}

}  // namespace gap_test
