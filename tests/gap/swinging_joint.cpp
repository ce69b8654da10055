#include "tests/gap/swinging_joint.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include "model/effects/any_effect.h"

namespace gap_test {
namespace {

constexpr double kTwoPi = 2 * std::numbers::pi;
constexpr double kPeriod_s = 2e-3;
constexpr double kSimulationStep_s = 2e-5;
constexpr double kServo_rad_per_s = kTwoPi * 6;
constexpr double kSlowest_Hz = 0.15;
constexpr std::size_t kSines = 5;

struct Sine {
  double amplitude_rad;
  double rad_per_s;
  double phase_rad;
};

std::vector<Sine> sines(const Swing& motion, std::mt19937_64& random) {
  std::uniform_real_distribution<double> uniform(0, 1);
  std::vector<Sine> result;
  double sum = 0;
  for (std::size_t i = 0; i < kSines; ++i) {
    const double share = (static_cast<double>(i) + 0.8 * uniform(random)) / kSines;
    const double frequency_Hz = kSlowest_Hz * std::pow(motion.fastest_Hz / kSlowest_Hz, share);
    result.push_back({1 / frequency_Hz, kTwoPi * frequency_Hz, kTwoPi * uniform(random)});
    sum += result.back().amplitude_rad;
  }
  for (Sine& sine : result) sine.amplitude_rad *= motion.half_stroke_rad / sum;
  return result;
}

}  // namespace

identification::gap::Source swing(const SwingingJoint& joint, const Swing& motion, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  const std::vector<Sine> wanted = sines(motion, random);
  const double tick_rad = kTwoPi / joint.ticks_per_rev;

  identification::gap::Source source{.name = "swing-" + std::to_string(seed) + ".csv", .recording = {}};
  source.recording.rig = "swinging joint";
  source.recording.columns = {{"time_s", {}}, {"torque_measured_Nm", {}}, {"position_rad", {}}};
  double position = motion.centre_rad;
  double velocity = 0;
  double before_Nm = 0;
  for (int k = 0; k * kPeriod_s < motion.seconds; ++k) {
    const double now_s = k * kPeriod_s;
    double goal_rad = motion.centre_rad;
    double goal_rad_per_s = 0;
    for (const Sine& sine : wanted) {
      const double angle = sine.rad_per_s * now_s + sine.phase_rad;
      goal_rad += sine.amplitude_rad * std::sin(angle);
      goal_rad_per_s += sine.amplitude_rad * sine.rad_per_s * std::cos(angle);
    }
    const double reported_rad = tick_rad * std::floor(position / tick_rad);
    const double torque_Nm = joint.inertia_kg_m2 * kServo_rad_per_s *
                             (kServo_rad_per_s * (goal_rad - position) + 1.4 * (goal_rad_per_s - velocity));
    const double sensed_Nm = before_Nm + joint.torque_noise_Nm * normal(random);
    const double values[] = {now_s, joint.unsigned_torque ? std::abs(sensed_Nm) : sensed_Nm, reported_rad};
    for (std::size_t c = 0; c < 3; ++c) source.recording.columns[c].values.push_back(values[c]);
    for (int i = 0; i < static_cast<int>(kPeriod_s / kSimulationStep_s + 0.5); ++i) {
      const double load_Nm = joint.spring_Nm_per_rad * (position - joint.spring_rest_rad) +
                             joint.weight_Nm * std::sin(position - joint.weight_rest_rad) + joint.offset_Nm;
      const double free = velocity + kSimulationStep_s / joint.inertia_kg_m2 *
                                         (torque_Nm - joint.viscous_Nm_s_per_rad * velocity - load_Nm);
      const double stops = kSimulationStep_s * joint.coulomb_Nm / joint.inertia_kg_m2;
      velocity = std::copysign(std::max(std::abs(free) - stops, 0.0), free);
      position += kSimulationStep_s * velocity;
    }
    before_Nm = torque_Nm;
  }
  return source;
}

model::effects::DriveModel known_of(const SwingingJoint& joint) {
  using model::effects::make_effect;
  return {.name = "swinging joint",
          .inertia_kg_m2 = joint.inertia_kg_m2,
          .encoder_ticks_per_rev = joint.ticks_per_rev,
          .effects = {make_effect("coulomb", {{"torque_Nm", joint.coulomb_Nm}}),
                      make_effect("viscous", {{"coefficient_Nm_s_per_rad", joint.viscous_Nm_s_per_rad}})}};
}

identification::gap::Result analysed(const SwingingJoint& joint, const Swing& motion, std::uint64_t seed) {
  const auto pair = [&](std::uint64_t first) {
    return std::vector{swing(joint, motion, first), swing(joint, motion, first + 1)};
  };
  return identification::gap::analyse(known_of(joint), pair(10 * seed), pair(10 * seed + 2));
}

std::string words(const identification::gap::Result& result) {
  std::string text(identification::gap::verdict_name(result.verdict));
  for (const identification::gap::FoundEffect& found : result.effects) {
    text += "; " + std::string(model::effects::name_of(found.effect));
    for (std::size_t i = 0; i < found.equivalent.size(); ++i)
      text += " or " + found.equivalent[i] + " " + std::to_string(found.wins[i + 1]);
    for (const auto& p : found.parameters)
      text += ", " + std::string(p.name) + " " + std::to_string(p.value) + " [" + std::to_string(p.lower) +
              " " + std::to_string(p.upper) + "]";
  }
  return text;
}

std::string names(const identification::gap::Result& result) {
  std::vector<std::string> all;
  for (const identification::gap::FoundEffect& found : result.effects) {
    std::string name(model::effects::name_of(found.effect));
    for (const std::string& rival : found.equivalent) name += "/" + rival;
    all.push_back(name);
  }
  std::ranges::sort(all);
  std::string text;
  for (const std::string& name : all) text += (text.empty() ? "" : " ") + name;
  return text;
}

}  // namespace gap_test
