#include "tests/gap/hidden_experiment.h"

#include <algorithm>
#include <cmath>
#include <string>

namespace gap_test {
namespace {

constexpr double kSample_s = HiddenPlant::kSample_s;

struct Tone {
  double amplitude;
  double rad_per_s;
  double phase_rad;
};
double sum_of(const std::vector<Tone>& tones, double time_s) {
  double sum = 0;
  for (const Tone& tone : tones) sum += tone.amplitude * std::sin(tone.rad_per_s * time_s + tone.phase_rad);
  return sum;
}

/// -1 to 1 and back, from 0.
double triangle(double periods) {
  const double place = periods + 0.25 - std::floor(periods + 0.25);
  return 1 - 4 * std::abs(place - 0.5);
}

/// PI control of the velocity that the encoder gives.
class VelocityLoop {
 public:
  explicit VelocityLoop(const Plant& plant)
      : proportional_(plant.inertia_kg_m2 * 2 * kPi * 4.5),
        integral_(proportional_ * 2 * kPi * 0.8),
        limit_Nm_(4 * plant.coulomb_Nm + 20 * plant.viscous_Nm_s_per_rad) {}

  double torque_Nm(double wanted_rad_per_s, double position_rad) {
    const double raw = started_ ? (position_rad - position_rad_) / kSample_s : 0;
    started_ = true;
    position_rad_ = position_rad;
    velocity_rad_per_s_ += kFilter * (raw - velocity_rad_per_s_);
    const double error = wanted_rad_per_s - velocity_rad_per_s_;
    sum_Nm_ = std::clamp(sum_Nm_ + integral_ * error * kSample_s, -limit_Nm_, limit_Nm_);
    return proportional_ * error + sum_Nm_;
  }

 private:
  static constexpr double kFilter = 0.22;  // 40 Hz
  double proportional_;
  double integral_;
  double limit_Nm_;
  bool started_ = false;
  double position_rad_ = 0;
  double velocity_rad_per_s_ = 0;
  double sum_Nm_ = 0;
};

/// What an experiment wants at a time; the motion is asked for by velocity, by torque or by both.
class Plan {
 public:
  Plan(const Drive& drive, const Run& run)
      : plant_(drive.plant),
        run_(run),
        chance_(run.seed ^ 0xE8Cu),
        breakaway_Nm_(run.breakaway_Nm > 0 ? run.breakaway_Nm : breakaway_Nm(drive)) {
    const Plant& plant = plant_;
    for (double hz = 0.13; hz < 5; hz *= 1.55 * chance_.uniform(0.95, 1.05))
      motion_.push_back({0.4 * run.top_rad_per_s * std::pow(hz / 0.13, -0.6), 2 * kPi * hz, angle()});
    for (double hz = 6; hz < 60; hz *= 1.5 * chance_.uniform(0.95, 1.05))
      shaking_.push_back({0.12 * plant.coulomb_Nm, 2 * kPi * hz, angle()});
    for (const double share : {1.0, 0.75, 0.55, 0.4, 0.28, 0.18, 0.1, 0.05, 0.025})
      stairs_.push_back(share * run.top_rad_per_s * chance_.uniform(0.95, 1.05));
    period_s_ = run.duration_s / std::max(2.0, std::round(run.duration_s / chance_.uniform(7, 10)));
  }

  /// False for experiments that command torque alone at that time.
  bool by_velocity(double time_s) const {
    return run_.experiment != Experiment::kTorqueRamp &&
           (run_.experiment != Experiment::kPresliding || time_s < kSlide_s ||
            time_s > run_.duration_s - kSlide_s);
  }

  double velocity_rad_per_s(double time_s) {
    switch (run_.experiment) {
      case Experiment::kStaircase: return towards(stair(time_s), 25);
      case Experiment::kMultisine: return sum_of(motion_, time_s);
      case Experiment::kReversals: {
        // Large and slow, then small and quick.
        const bool late = time_s > 0.6 * run_.duration_s;
        return (late ? 0.12 : 0.4) * run_.top_rad_per_s * triangle(time_s / (late ? 1.6 : 4));
      }
      case Experiment::kRandomSteps: return towards(random_step(time_s), acceleration_);
      case Experiment::kPresliding:
        return time_s < kSlide_s - 0.6 || time_s > run_.duration_s - kSlide_s ? towards(1.5, 5)
                                                                              : towards(0, 5);
      case Experiment::kTorqueRamp: break;
    }
    return 0;
  }

  double torque_Nm(double time_s) {
    if (run_.experiment == Experiment::kMultisine) return sum_of(shaking_, time_s);
    if (run_.experiment == Experiment::kTorqueRamp)
      return (1.1 * breakaway_Nm_ + 0.4 * run_.top_rad_per_s * plant_.viscous_Nm_s_per_rad) *
             triangle(time_s / period_s_);
    if (run_.experiment == Experiment::kPresliding && !by_velocity(time_s)) {
      const double progress = (time_s - kSlide_s) / (run_.duration_s - 2 * kSlide_s);
      const double share = 0.25 + 0.2 * std::floor(4 * progress);  // of break-away: 0.25 to 0.85
      return share * plant_.coulomb_Nm * std::sin(2 * kPi * (time_s - kSlide_s));
    }
    return 0;
  }

 private:
  static constexpr double kSlide_s = 2;

  double angle() { return chance_.uniform(-kPi, kPi); }
  double stair(double time_s) const {
    // Fast to slow one way, slow to fast the other, and the other way round.
    const std::size_t half = 2 * stairs_.size();
    const auto at = std::min(
        static_cast<std::size_t>(time_s / run_.duration_s * static_cast<double>(2 * half)), 2 * half - 1);
    const std::size_t step = at % half;
    const bool second = step >= stairs_.size();
    const double speed = second ? stairs_[half - 1 - step] : stairs_[step];
    return (at < half ? 1 : -1) * (second ? -1 : 1) * speed;
  }
  double random_step(double time_s) {
    if (time_s >= next_s_) {
      next_s_ = time_s + chance_.uniform(0.4, 1.5);
      goal_rad_per_s_ = chance_.sign() * run_.top_rad_per_s * std::pow(chance_.uniform(0.1, 1), 2);
      acceleration_ = chance_.uniform(10, 40);
    }
    return goal_rad_per_s_;
  }
  double towards(double goal, double rad_per_s2) {
    const double most = rad_per_s2 * kSample_s;
    return wanted_rad_per_s_ += std::clamp(goal - wanted_rad_per_s_, -most, most);
  }

  Plant plant_;
  Run run_;
  Chance chance_;
  double breakaway_Nm_;
  double period_s_ = 8;
  std::vector<Tone> motion_;
  std::vector<Tone> shaking_;
  std::vector<double> stairs_;
  double wanted_rad_per_s_ = 0;
  double next_s_ = 0;
  double goal_rad_per_s_ = 0;
  double acceleration_ = 20;
};

/// A drive on a test bench, which commands it run after run.
class Bench {
 public:
  Bench(const Drive& drive, const Run& first)
      : drive_(drive), plant_(drive.plant, drive.effects, drive.sensors, first.seed, first.running_s) {}

  /// take(time since its begin, command) after each sample.
  template <class Take>
  void perform(const Run& run, const Take& take) {
    Plan plan(drive_, run);
    VelocityLoop loop(drive_.plant);
    const auto rows = std::llround(run.duration_s / kSample_s);
    bool was_by_velocity = true;
    for (long long k = 0; k < rows; ++k) {
      const double now_s = static_cast<double>(k) * kSample_s;
      double command = plan.torque_Nm(now_s);
      const bool by_velocity = plan.by_velocity(now_s);
      if (by_velocity && !was_by_velocity) loop = VelocityLoop(drive_.plant);
      was_by_velocity = by_velocity;
      if (by_velocity)
        command += loop.torque_Nm(plan.velocity_rad_per_s(now_s), plant_.measured_position_rad());
      plant_.step(command);
      take(now_s, command);
    }
  }
  const HiddenPlant& plant() const { return plant_; }

 private:
  const Drive& drive_;
  HiddenPlant plant_;
};

}  // namespace

double breakaway_Nm(const Drive& drive) { return drive.plant.coulomb_Nm + drive.effects.stribeck_Nm; }

std::string_view name_of(Experiment experiment) {
  switch (experiment) {
    case Experiment::kStaircase: return "staircase";
    case Experiment::kMultisine: return "multisine";
    case Experiment::kTorqueRamp: return "torque-ramp";
    case Experiment::kReversals: return "reversals";
    case Experiment::kPresliding: return "presliding";
    case Experiment::kRandomSteps: return "random-steps";
  }
  return "";
}

Simulated simulate(const Drive& drive, const Run& run) {
  Bench bench(drive, run);
  const HiddenPlant& plant = bench.plant();
  std::vector<double> time_s;
  std::vector<double> command_Nm;
  std::vector<double> torque_Nm;
  std::vector<double> position_rad;
  Simulated result;
  std::array<double, kHiddenKinds> squares{};
  bench.perform(run, [&](double now_s, double command) {
    time_s.push_back(now_s);
    command_Nm.push_back(command);
    torque_Nm.push_back(plant.measured_torque_Nm());
    position_rad.push_back(plant.measured_position_rad());
    result.torque_Nm.push_back(plant.torque_Nm());
    for (std::size_t kind = 0; kind < kHiddenKinds; ++kind)
      squares[kind] += plant.contributions_Nm()[kind] * plant.contributions_Nm()[kind];
  });
  for (std::size_t kind = 0; kind < kHiddenKinds; ++kind)
    result.contribution_Nm[kind] = std::sqrt(squares[kind] / static_cast<double>(time_s.size()));
  result.motor_work_J = plant.motor_work_J();
  result.friction_heat_J = plant.friction_heat_J();
  result.kinetic_J = plant.kinetic_J();

  identification::Recording& recording = result.recording;
  recording.rig = "hidden";
  recording.experiment = name_of(run.experiment);
  recording.sample_rate_Hz = 1 / kSample_s;
  recording.comments = {
      {"rig", recording.rig}, {"experiment", recording.experiment}, {"sample_rate_Hz", "1000"}};
  recording.columns = {{"time_s", std::move(time_s)},
                       {"torque_command_Nm", std::move(command_Nm)},
                       {"torque_measured_Nm", std::move(torque_Nm)},
                       {"position_rad", std::move(position_rad)}};
  return result;
}

void simulate(const Drive& drive, std::span<const Run> runs, const std::function<void(const Row&)>& take) {
  Bench bench(drive, runs.front());
  double begin_s = 0;
  for (const Run& run : runs) {
    bench.perform(run, [&](double now_s, double command) {
      take({begin_s + now_s, command, bench.plant().measured_torque_Nm(),
            bench.plant().measured_position_rad()});
    });
    begin_s += run.duration_s;
  }
}

identification::Recording carry_out(const Drive& drive,
                                    identification::experiments::JointExperiment& experiment,
                                    std::uint64_t seed) {
  HiddenPlant plant(drive.plant, drive.effects, drive.sensors, seed);
  VelocityLoop loop(drive.plant);
  std::vector<double> time_s;
  std::vector<double> command_Nm;
  std::vector<double> torque_Nm;
  std::vector<double> position_rad;
  identification::experiments::Reading reading{.position_rad = plant.measured_position_rad(),
                                               .command_Nm = 0};
  for (int measurement = 0; measurement < experiment.measurement_count(); ++measurement) {
    reading.time_s = 0;
    experiment.begin(measurement, reading);
    while (!experiment.finished()) {
      const hal::JointCommand wanted = experiment.step(reading).command;
      const double torque = loop.torque_Nm(wanted.target, plant.measured_position_rad());
      const double command = wanted.mode == hal::CommandMode::kTorque ? wanted.target : torque;
      plant.step(command);
      time_s.push_back(static_cast<double>(time_s.size()) * kSample_s);
      command_Nm.push_back(command);
      torque_Nm.push_back(plant.measured_torque_Nm());
      position_rad.push_back(plant.measured_position_rad());
      reading = {.time_s = reading.time_s + kSample_s,
                 .position_rad = position_rad.back(),
                 .velocity_rad_per_s = plant.velocity_rad_per_s(),
                 .torque_Nm = torque_Nm.back(),
                 .command_Nm = command};
    }
  }
  identification::Recording recording;
  recording.rig = "hidden";
  recording.experiment = "deciding";
  recording.sample_rate_Hz = 1 / kSample_s;
  recording.columns = {{"time_s", std::move(time_s)},
                       {"torque_command_Nm", std::move(command_Nm)},
                       {"torque_measured_Nm", std::move(torque_Nm)},
                       {"position_rad", std::move(position_rad)}};
  return recording;
}

double contribution_Nm(const std::vector<Simulated>& runs, Hidden kind) {
  double squares = 0;
  double rows = 0;
  for (const Simulated& run : runs) {
    const double rms = run.contribution_Nm[static_cast<std::size_t>(kind)];
    squares += rms * rms * static_cast<double>(run.torque_Nm.size());
    rows += static_cast<double>(run.torque_Nm.size());
  }
  return rows > 0 ? std::sqrt(squares / rows) : 0;
}

}  // namespace gap_test
