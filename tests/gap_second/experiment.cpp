#include "tests/gap_second/experiment.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <iterator>
#include <numbers>
#include <random>
#include <vector>

namespace gap_second {
namespace {

constexpr double kTwoPi = 2 * std::numbers::pi;
using OfTime = std::function<double(double time_s)>;

double triangle(double phase) {  // 0 at 0, 1 at a quarter, -1 at three quarters
  const double x = phase - std::floor(phase);
  return x < 0.25 ? 4 * x : (x < 0.75 ? 2 - 4 * x : 4 * x - 4);
}

/// Speeds one after the other, each held for a time.
OfTime held(std::vector<double> speeds, std::vector<double> until_s) {
  return [speeds = std::move(speeds), until_s = std::move(until_s)](double time_s) {
    const auto next = std::upper_bound(until_s.begin(), until_s.end(), time_s);
    return next == until_s.end() ? speeds.back() : speeds[static_cast<std::size_t>(next - until_s.begin())];
  };
}

OfTime staircase(const Rig& rig, double seconds, std::mt19937_64& random) {
  const std::vector<double> parts = {0.04, 0.1, 0.2, 0.35, 0.5, 0.75, 1.0};
  std::vector<double> speeds = parts;
  std::transform(parts.rbegin(), parts.rend(), std::back_inserter(speeds), std::negate<>());
  std::vector<double> until_s;
  const double from = std::uniform_real_distribution<double>(0.85, 1.0)(random);
  for (std::size_t i = 0; i < speeds.size(); ++i) {
    speeds[i] *= from * rig.top_speed_rad_per_s;
    until_s.push_back(seconds * static_cast<double>(i + 1) / static_cast<double>(speeds.size()));
  }
  return held(std::move(speeds), std::move(until_s));
}

OfTime random_steps(const Rig& rig, double seconds, std::mt19937_64& random) {
  std::vector<double> speeds;
  std::vector<double> until_s;
  for (double end = 0.0; end < seconds;) {
    end += std::uniform_real_distribution<double>(0.3, 1.5)(random);
    until_s.push_back(end);
    speeds.push_back(rig.top_speed_rad_per_s * std::uniform_real_distribution<double>(-1.0, 1.0)(random));
  }
  return held(std::move(speeds), std::move(until_s));
}

OfTime multisine(const Rig& rig, double amplitude_Nm, std::mt19937_64& random) {
  constexpr int kTones = 16;
  std::vector<std::pair<double, double>> tones;  // frequency, phase
  for (int i = 0; i < kTones; ++i) {
    const double part = (i + std::uniform_real_distribution<double>(0.0, 0.7)(random)) / kTones;
    tones.emplace_back(0.2 * std::pow(rig.highest_tone_Hz / 0.2, part),
                       std::uniform_real_distribution<double>(0.0, kTwoPi)(random));
  }
  return [tones, amplitude_Nm](double time_s) {
    double torque = 0.0;
    for (const auto& [frequency_Hz, phase] : tones)
      torque += std::sin(kTwoPi * frequency_Hz * time_s + phase);
    return amplitude_Nm * torque * std::sqrt(2.0 / kTones);
  };
}

/// Proportional and integral, with a ramp on the set-point; its output and its set-point.
class VelocityLoop {
 public:
  VelocityLoop(const Rig& rig, const DriveTruth& truth) : period_s_(1 / rig.rate_Hz) {
    const double bandwidth = kTwoPi * std::min({3.0, rig.rate_Hz / 40, 0.03 / std::max(truth.delay_s, 1e-9)});
    proportional_ = rig.nominal_inertia_kg_m2 * bandwidth;
    integral_ = proportional_ * bandwidth / 5;
    most_Nm_ = 12 * rig.usual_torque_Nm;
    most_change_ = 3 * rig.usual_torque_Nm / rig.nominal_inertia_kg_m2 * period_s_;
    filter_ = std::exp(-period_s_ * bandwidth * 8);
  }
  double torque(double target_rad_per_s, double position_rad) {
    set_point_ += std::clamp(target_rad_per_s - set_point_, -most_change_, most_change_);
    const double velocity = (position_rad - last_position_) / period_s_;
    last_position_ = position_rad;
    velocity_ = filter_ * velocity_ + (1 - filter_) * velocity;
    const double error = set_point_ - velocity_;
    sum_ = std::clamp(sum_ + integral_ * error * period_s_, -most_Nm_, most_Nm_);
    return std::clamp(proportional_ * error + sum_, -most_Nm_, most_Nm_);
  }
  double set_point() const { return set_point_; }
  double velocity() const { return velocity_; }

 private:
  double period_s_, proportional_ = 0, integral_ = 0, most_Nm_ = 0, most_change_ = 0, filter_ = 0;
  double set_point_ = 0, last_position_ = 0, velocity_ = 0, sum_ = 0;
};

/// The motion's set-point: a velocity, or a torque where there is no loop.
OfTime set_point(Motion motion, const Rig& rig, double seconds, std::mt19937_64& random) {
  const double top = rig.top_speed_rad_per_s;
  const double usual = rig.usual_torque_Nm;
  const double scale = std::uniform_real_distribution<double>(0.8, 1.2)(random);
  switch (motion) {
    case Motion::kStaircase: return staircase(rig, seconds, random);
    case Motion::kRandomSteps: return random_steps(rig, seconds, random);
    case Motion::kMultisine: return multisine(rig, 2.5 * usual * scale, random);
    case Motion::kSlowReversals:
      return
          [=](double t) { return top * scale * (t < seconds / 2 ? 0.08 : 0.3) * triangle(t / 3.1 / scale); };
    case Motion::kTorqueTriangles: break;
  }
  return [=](double t) { return usual * (0.5 + 1.2 * t / seconds) * triangle(t / 3.7 / scale); };
}

/// Samples encoder and current sensor at the end of each period.
class Sensors {
 public:
  Sensors(const Rig& rig, std::uint64_t seed) : rig_(rig), random_(seed) {}
  double position_rad(double true_rad) const {
    const double tick = kTwoPi / rig_.ticks_per_rev;
    return tick * std::floor((true_rad + rig_.encoder_eccentricity_rad * std::sin(true_rad)) / tick);
  }
  double torque_Nm(double instant_Nm, double mean_Nm) {
    return (rig_.torque_is_mean ? mean_Nm : instant_Nm) + rig_.torque_noise_Nm * normal_(random_);
  }

 private:
  Rig rig_;
  std::mt19937_64 random_;
  std::normal_distribution<double> normal_;
};

}  // namespace

const char* name(Motion motion) {
  switch (motion) {
    case Motion::kStaircase: return "staircase";
    case Motion::kRandomSteps: return "random-steps";
    case Motion::kSlowReversals: return "slow-reversals";
    case Motion::kMultisine: return "multisine";
    case Motion::kTorqueTriangles: break;
  }
  return "torque-triangles";
}

Recording record(const DriveTruth& truth, const Rig& rig, Motion motion, double seconds, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  const OfTime target = set_point(motion, rig, seconds, random);
  const bool looped =
      motion == Motion::kStaircase || motion == Motion::kRandomSteps || motion == Motion::kSlowReversals;
  Drive drive(truth, random());
  Sensors sensors(rig, random());
  VelocityLoop loop(rig, truth);
  const double towards_rest =
      motion == Motion::kMultisine ? rig.usual_torque_Nm / rig.top_speed_rad_per_s : 0.0;

  Recording recording;
  recording.header = {{"rig", rig.name},
                      {"experiment", name(motion)},
                      {"sample_rate_Hz", std::to_string(std::lround(rig.rate_Hz))}};
  const auto rows = static_cast<std::size_t>(seconds * rig.rate_Hz);
  std::vector<double> time_s, command_Nm, measured_Nm, position_rad, velocity_command_rad_per_s;
  double mean_Nm = 0.0;
  for (std::size_t row = 0; row < rows; ++row) {
    const double now_s = static_cast<double>(row) / rig.rate_Hz;
    const double position = sensors.position_rad(drive.state().motor_rad);
    const double from_loop = loop.torque(looped ? target(now_s) : 0.0, position);
    const double command = looped ? from_loop : target(now_s) - towards_rest * loop.velocity();
    time_s.push_back(now_s);
    command_Nm.push_back(command);
    measured_Nm.push_back(sensors.torque_Nm(drive.motor_torque_Nm(), mean_Nm));
    position_rad.push_back(position);
    velocity_command_rad_per_s.push_back(loop.set_point());
    double sum = 0.0;
    int steps = 0;
    for (; drive.time_s() < now_s + 1 / rig.rate_Hz - kStepS / 2; ++steps) {
      drive.step(command);
      sum += drive.motor_torque_Nm();
    }
    mean_Nm = sum / steps;
  }
  recording.columns = {{"time_s", time_s},
                       {"torque_command_Nm", command_Nm},
                       {"torque_measured_Nm", measured_Nm},
                       {"position_rad", position_rad}};
  if (looped) recording.columns.push_back({"velocity_command_rad_per_s", velocity_command_rad_per_s});
  return recording;
}

}  // namespace gap_second
