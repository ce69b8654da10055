#include "model/friction/bristle.h"

#include <algorithm>
#include <cmath>
#include <cstdint>

namespace model::friction {
namespace {

/// 2³¹ − 1: products fit an integer, and every state of the generator is exact in a double.
constexpr std::uint64_t kModulus = 2147483647;
constexpr std::uint64_t kFirstSeed = 20120704;
constexpr double kReachesFollowed = 2;
constexpr std::size_t kLastDirection = Bristle::kBristles + 1;
constexpr std::size_t kSlidingBonds = Bristle::kBristles + 2;
constexpr int kMaxBreaks = 20;  // per step usually two or three; twenty have a probability of 1/19!

/// Uniformly distributed in (0, 1). Park and Miller's generator with the multiplier 48271.
double draw(double& generator) noexcept {
  std::uint64_t number = generator >= 1 && generator < static_cast<double>(kModulus)
                             ? static_cast<std::uint64_t>(generator)
                             : kFirstSeed;
  number = number * 48271 % kModulus;
  generator = static_cast<double>(number);
  return generator / static_cast<double>(kModulus);
}

}  // namespace

double Bristle::step(State& state, const Contact& contact, double dt_s) const noexcept {
  if (!usable(contact, dt_s)) return 0.0;
  const double direction = std::copysign(1.0, contact.velocity_rad_per_s);
  const double way = std::abs(contact.velocity_rad_per_s) * dt_s;
  const double reach = parameters_.reach_rad;
  auto sliding = static_cast<std::uint32_t>(state.x[kSlidingBonds]);
  if (way > 0 && direction != state.x[kLastDirection]) {
    state.x[kLastDirection] = direction;
    sliding = 0;
  }
  double sum = 0.0;  // of deflections along the motion
  for (std::size_t i = 0; i < kBristles; ++i) {
    const std::uint32_t bit = std::uint32_t{1} << i;
    double deflection = direction * state.x[i];
    if (way > kReachesFollowed * reach) {
      sliding |= bit;
      sum += reach / 3;
      deflection = reach * (2 * std::sqrt(draw(state.x[kBristles])) - 1);
    } else {
      double left = way;
      double work = 0.0;  // per stiffness
      for (int breaks = 0; deflection + left >= reach && breaks < kMaxBreaks; ++breaks) {
        sliding |= bit;
        work += 0.5 * (reach * reach - deflection * deflection);
        left -= reach - deflection;
        deflection = reach * (2 * draw(state.x[kBristles]) - 1);
      }
      left = std::min(left, reach - deflection);
      work += left * (deflection + 0.5 * left);
      deflection += left;
      sum += (sliding & bit) != 0 && way > 0 ? work / way : deflection;
    }
    state.x[i] = direction * deflection;
  }
  state.x[kSlidingBonds] = static_cast<double>(sliding);
  return direction * parameters_.stiffness_Nm_per_rad / static_cast<double>(kBristles) * sum;
}

double Bristle::steady_Nm(double velocity_rad_per_s) const noexcept {
  return std::copysign(parameters_.stiffness_Nm_per_rad * parameters_.reach_rad / 3, velocity_rad_per_s);
}

double Bristle::stored_energy_J(const State& state) const noexcept {
  double sum = 0.0;
  for (std::size_t i = 0; i < kBristles; ++i) sum += state.x[i] * state.x[i];
  return 0.5 * parameters_.stiffness_Nm_per_rad / static_cast<double>(kBristles) * sum;
}

}  // namespace model::friction
