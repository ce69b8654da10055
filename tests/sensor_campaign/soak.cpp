#include "tests/sensor_campaign/soak.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <functional>
#include <random>
#include <stdexcept>

#include "hal/seconds.h"
#include "identification/gap/parallel.h"
#include "tests/operation/sensor_rigs.h"

namespace sensor_campaign {
namespace {

using namespace std::chrono_literals;
using sensor_rigs::ArmRig;
using sensor_rigs::BaseRig;

/// What one thread does at a time. A run that ends early is followed by another within it.
constexpr double kPiece_s = 120.0;
constexpr double kShortestPiece_s = 5.0;

class Random {
 public:
  explicit Random(std::seed_seq& seed) : engine_(seed) {}
  double between(double low, double high) { return std::uniform_real_distribution(low, high)(engine_); }
  bool chance(double share) { return between(0, 1) < share; }
  std::mt19937& engine() { return engine_; }

 private:
  std::mt19937 engine_;
};

std::chrono::milliseconds milliseconds(double seconds) {
  return std::chrono::milliseconds(std::lround(1000 * seconds));
}

// ---- the base ----

using PrepareBase = std::function<void(sim::BaseParameters&, Random&)>;

/// Of the loads that the safety issue names.
double load(Random& random) { return random.between(0.6, 3.0); }
void load_evenly(sim::BaseParameters& base, double load) {
  for (double& scale : base.loaded_friction_scale) scale *= load;
}
void load_unevenly(sim::BaseParameters& base, Random& random) {
  for (double& scale : base.loaded_friction_scale) scale = load(random);
}

/// Velocities as a person at a joystick asks for them, until the time is over or the run ends.
void drive(BaseRig& rig, Random& random, double until_s, double push_N) {
  while (!rig.over() && hal::seconds(rig.clock.now()) < until_s) {
    const double speed = random.chance(0.2) ? 0.2 : 1.0;
    control::PlanarVector twist(random.between(-0.25, 0.25), random.between(-0.2, 0.2),
                                random.between(-0.25, 0.25));
    for (double& component : twist)
      if (random.chance(0.4)) component = 0.0;
    if (random.chance(0.2)) twist.setZero();
    rig.motion.tell(speed * twist);
    if (push_N > 0) {
      rig.base.push({random.between(-push_N, push_N), random.between(-push_N, push_N),
                     0.25 * random.between(-push_N, push_N)});
      rig.run(milliseconds(random.between(0.05, 0.5)));
      rig.base.push(control::PlanarVector::Zero());
    }
    rig.run(milliseconds(random.between(0.1, 2.1)));
  }
}

// ---- base and arm ----

using PrepareScene = std::function<void(teleop_rig::Scene&, Random&)>;

void put_wall(teleop_rig::Scene& scene, Random& random) {
  scene.environment.walls.push_back(
      {{random.between(0.36, 0.42), 0, 0}, {-1, 0, 0}, {.stiffness_N_per_m = random.between(500, 20'000)}});
}
void load_robot(teleop_rig::Scene& scene, Random& random) {
  const double factor = load(random);
  for (double& scale : scene.robot.wheels.loaded_friction_scale) scale *= factor;
  for (sim::bus::ArmJointData& joint : scene.robot.arm) {
    joint.coulomb_Nm *= factor;
    joint.viscous_Nm_s_per_rad *= factor;
  }
}

/// A hand that leads the arm about, fast and slowly, far and near.
void lead(ArmRig& rig, Random& random, double until_s) {
  while (!rig.over() && hal::seconds(rig.clock.now()) < until_s) {
    const auto duration = milliseconds(random.between(0.4, 1.6));
    const double reach_m = random.chance(0.3) ? 0.055 : 0.035;
    const auto offset = [&](double most) { return random.between(-most, most); };
    const double x = offset(reach_m);
    const double y = offset(0.04);
    const double z = offset(0.04);
    rig.hand.move_to({x, y, z}, duration);
    if (random.chance(0.5)) {
      const double angle = offset(0.4);
      Eigen::Vector3d axis(offset(1), 0, 0);
      axis.y() = offset(1);
      axis.z() = offset(1);
      rig.hand.turn_to(Eigen::Quaterniond(Eigen::AngleAxisd(angle, axis.normalized())), duration);
    }
    rig.run(duration + milliseconds(random.between(0.0, 1.0)));
  }
}

// ---- scenarios ----

struct Scenario {
  std::string name;
  PrepareBase base;    ///< either this
  PrepareScene scene;  ///< or that
  double push_N = 0.0;
  double run_s = 60.0;  ///< a run takes no longer
};

std::vector<Scenario> scenarios() {
  const auto slippery = [](double low, double high) {
    return [=](sim::BaseParameters& base, Random& random) { base.roller_grip = random.between(low, high); };
  };
  const auto nothing = [](auto&, Random&) {};
  return {
      {"driving", nothing, {}},
      {"driving, load 0.6", [](auto& base, Random&) { load_evenly(base, 0.6); }, {}},
      {"driving, load 3", [](auto& base, Random&) { load_evenly(base, 3.0); }, {}},
      {"driving, each wheel another load", load_unevenly, {}},
      {"wet floor", slippery(0.1, 0.3), {}},
      {"black ice", slippery(0.02, 0.1), {}},
      {"black ice, each wheel another load",
       [](auto& base, Random& random) {
         base.roller_grip = random.between(0.02, 0.12);
         load_unevenly(base, random);
       },
       {}},
      {"ice below some wheels",
       [](auto& base, Random& random) {
         for (double& scale : base.grip_scale)
           if (random.chance(0.4)) scale = random.between(0.0, 0.3);
         load_unevenly(base, random);
       },
       {}},
      {"a wheel over a hollow",
       [](auto& base, Random& random) {
         base.grip_scale[static_cast<std::size_t>(random.between(0, 3.999))] = 0.0;
         load_evenly(base, load(random));
       },
       {}},
      {"pushed", [](auto& base, Random& random) { load_evenly(base, load(random)); }, {}, 25.0},
      {"held",
       [](auto& base, Random& random) {
         // As by a wall, in every direction; the wheels carry no more than before.
         const double heavier = 100;
         base.mass_kg *= heavier;
         base.yaw_inertia_kg_m2 *= heavier;
         base.roller_grip /= heavier;
         base.roller_resistance /= heavier;
         load_evenly(base, load(random));
       },
       {}},
      {"teleoperation", {}, nothing},
      {"teleoperation, wall", {}, put_wall},
      {"teleoperation, wet floor",
       {},
       [](auto& scene, Random& random) { scene.robot.wheels.roller_grip = random.between(0.05, 0.2); }},
      {"teleoperation, load", {}, load_robot},
      {"teleoperation, load, wall",
       {},
       [](auto& scene, Random& random) {
         load_robot(scene, random);
         put_wall(scene, random);
       }},
      {"pushed at each start",
       [](auto& base, Random& random) { load_evenly(base, load(random)); },
       {},
       35.0,
       3.0},
      // Checks that judge a robot only until it has been seen to obey.
      {"unfolding, load",
       {},
       [](auto& scene, Random& random) {
         scene.robot.start_rad = sim::MobileManipulatorParameters{}.start_rad;
         load_robot(scene, random);
       },
       0.0,
       1.0},
  };
}

/// What all runs share.
struct Machine {
  bool busy;
  control::ChecksOff off;
};

/// Record of one run.
void count(SoakResult& result, bool false_alarm, bool other_end, const std::string& words) {
  ++result.runs;
  result.false_alarms += false_alarm ? 1 : 0;
  result.other_ends += other_end ? 1 : 0;
  if (false_alarm) result.alarms.push_back(words);
}

void run_base(const Scenario& scenario, double duration_s, const Machine& machine, Random& random,
              SoakResult& result) {
  sim::BaseParameters parameters;
  parameters.noise_seed = random.engine()();
  scenario.base(parameters, random);
  BaseRig rig(parameters, machine.off);
  if (machine.busy) rig.bus.hold_up(support::BusyMachine(random.engine()()));
  rig.motion.tell(control::PlanarVector::Zero());
  rig.run(200ms);
  drive(rig, random, duration_s, scenario.push_N);
  const runtime::StopReason& reason = rig.cycle.stop_reason();
  const bool alarm = reason.kind == runtime::StopReason::Kind::kRobotFault;
  count(result, alarm, rig.over() && !alarm, describe(reason, rig.robot));
  result.hours += hal::seconds(rig.clock.now()) / 3600;
}

void run_robot(const Scenario& scenario, double duration_s, const Machine& machine, Random& random,
               SoakResult& result) {
  teleop_rig::Scene scene = teleop_rig::unfolded_scene();
  scene.robot.wheels.noise_seed = random.engine()();
  scenario.scene(scene, random);
  ArmRig rig(scene, machine.off);
  if (machine.busy) rig.bus.hold_up(support::BusyMachine(random.engine()()));
  if (rig.reach(control::TeleopPhase::kOperating)) lead(rig, random, duration_s);
  if (!rig.over()) {
    rig.cycle.request_stop();
    for (int k = 0; k < 10'000 && !rig.cycle.finished(); ++k) rig.step();
  }
  const runtime::StopReason& reason = rig.cycle.stop_reason();
  const bool alarm = reason.kind == runtime::StopReason::Kind::kRobotFault;
  count(result, alarm, reason && !alarm, describe(reason, rig.robot, &rig.master));
  result.hours += hal::seconds(rig.clock.now()) / 3600;
}

SoakResult run_piece(const Scenario& scenario, double duration_s, const Machine& machine,
                     std::array<std::uint32_t, 3> seed) {
  std::seed_seq sequence(seed.begin(), seed.end());
  Random random(sequence);
  SoakResult result;
  while (duration_s - 3600 * result.hours > kShortestPiece_s) {
    const double left_s = std::min(duration_s - 3600 * result.hours, scenario.run_s);
    (scenario.base ? run_base : run_robot)(scenario, left_s, machine, random, result);
  }
  return result;
}

void add(SoakResult& total, const SoakResult& piece) {
  total.hours += piece.hours;
  total.runs += piece.runs;
  total.false_alarms += piece.false_alarms;
  total.other_ends += piece.other_ends;
  total.alarms.insert(total.alarms.end(), piece.alarms.begin(), piece.alarms.end());
}

}  // namespace

std::vector<SoakResult> soak(double hours, std::uint32_t seed, const std::string& only, bool busy,
                             const control::ChecksOff& off) {
  const std::vector<Scenario> all = scenarios();
  std::vector<std::uint32_t> chosen;
  for (std::uint32_t i = 0; i < all.size(); ++i)
    if (only.empty() || all[i].name == only) chosen.push_back(i);
  if (chosen.empty()) throw std::invalid_argument("no scenario \"" + only + "\"");
  const double each_s = 3600 * hours / static_cast<double>(chosen.size());
  const auto pieces = static_cast<std::size_t>(std::ceil(each_s / kPiece_s));
  const double piece_s = std::max(each_s / static_cast<double>(pieces), 2 * kShortestPiece_s);
  std::vector<SoakResult> each(chosen.size() * pieces);
  identification::gap::in_parallel(each.size(), [&](std::size_t i) {
    const std::uint32_t scenario = chosen[i % chosen.size()];
    const auto piece = static_cast<std::uint32_t>(i / chosen.size());
    each[i] = run_piece(all[scenario], piece_s, {busy, off}, {seed, scenario, piece});
  });
  std::vector<SoakResult> results(chosen.size());
  for (std::size_t s = 0; s < chosen.size(); ++s) {
    results[s].scenario = all[chosen[s]].name;
    for (std::size_t p = 0; p < pieces; ++p) add(results[s], each[p * chosen.size() + s]);
  }
  return results;
}

}  // namespace sensor_campaign
