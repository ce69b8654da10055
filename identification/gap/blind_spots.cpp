#include "identification/gap/blind_spots.h"

#include <algorithm>
#include <cmath>

namespace identification::gap {
namespace {

/// Of the fastest speed: what is slower than this is where friction falls or rises when it begins to slide.
constexpr double kSlow = 0.1;
constexpr double kLeastShare = 0.02;
constexpr double kLeastAngle_rad = 1;
constexpr double kLeastRunning_s = 15;
constexpr std::size_t kLeastReversals = 4;
/// Change from sample to sample over the torque itself, rms: of a sine with twelve samples a period.
constexpr double kMostChange = 0.5;

struct Coverage {
  double samples = 0;
  double forward = 0;
  double backward = 0;
  double slow = 0;
  std::size_t reversals = 0;
  double angle_rad = 0;
  double longest_s = 0;
  bool torque_commanded = false;
  bool speed_commanded = false;
  double change = 0;  ///< largest of all recordings
};

/// How much the commanded torque, which has less noise than a measured one, changes from one sample to the
/// next, over its own rms.
double change_of(const Signals& s) {
  const std::vector<double>& torque = s.raw_command_Nm;
  double square = 0;
  double step_square = 0;
  for (std::size_t i = 1; i < torque.size(); ++i) {
    square += torque[i] * torque[i];
    step_square += std::pow(torque[i] - torque[i - 1], 2);
  }
  return square > 0 ? std::sqrt(step_square / square) : 0;
}

Coverage coverage_of(std::span<const Signals> signals) {
  double fastest = 0;
  for (const Signals& s : signals)
    for (const double v : s.velocity_rad_per_s) fastest = std::max(fastest, std::abs(v));
  Coverage c;
  c.angle_rad = widest_span_rad(signals);
  for (const Signals& s : signals) {
    c.longest_s = std::max(c.longest_s, s.running_s.back());
    c.torque_commanded = c.torque_commanded || !s.raw_command_Nm.empty();
    c.speed_commanded = c.speed_commanded || !s.raw_velocity_command_rad_per_s.empty();
    c.change = std::max(c.change, change_of(s));
    double direction = 0;
    for (std::size_t i = 0; i < s.size(); ++i) {
      if (s.moving[i] == 0) continue;
      const double v = s.velocity_rad_per_s[i];
      c.samples += 1;
      (v > 0 ? c.forward : c.backward) += 1;
      c.slow += std::abs(v) < kSlow * fastest ? 1 : 0;
      if (v * direction < 0) ++c.reversals;
      direction = v;
    }
  }
  return c;
}

}  // namespace

std::vector<std::string> blind_spots(std::span<const Signals> signals, bool rests) {
  std::vector<std::string> notes;
  const Coverage c = coverage_of(signals);
  if (c.change > kMostChange)
    notes.emplace_back(
        "the torque changes by half of itself or more from one sample to the next: what happens in between "
        "looks like a gap; record at a higher rate");
  if (std::min(c.forward, c.backward) < kLeastShare * c.samples)
    notes.emplace_back(
        "the joint moves one way only: a torque offset, friction that differs by direction and Coulomb "
        "friction look the same; record a staircase both ways");
  if (c.reversals < kLeastReversals)
    notes.emplace_back(
        "the joint hardly ever reverses: backlash, elasticity and presliding do not show; record reversals");
  else if (!rests)
    notes.emplace_back(
        "the joint never rests while the torque changes: a friction contact that gives less than it travels "
        "in a few samples does not show; record presliding");
  if (c.slow < kLeastShare * c.samples)
    notes.emplace_back(
        "the joint is hardly ever slow: Stribeck friction does not show; record slow torque ramps or the "
        "lower steps of a staircase");
  if (c.angle_rad < kLeastAngle_rad)
    notes.emplace_back(
        "the joint turns less than a radian: imbalance and load friction do not show; record a staircase");
  if (c.longest_s < kLeastRunning_s)
    notes.emplace_back(
        "no recording is longer than fifteen seconds: thermal drift does not show; record a minute or more");
  if (!c.torque_commanded)
    notes.emplace_back(std::string("no torque command was recorded: dead-band ") +
                       (c.speed_commanded ? "" : "and delay ") +
                       "of the actuator do not show; record torque_command_Nm");
  return notes;
}

}  // namespace identification::gap
