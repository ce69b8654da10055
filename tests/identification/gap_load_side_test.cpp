/// A load behind a spring or a gap, driven by a motor with a given motion.
#include "identification/gap/load_side.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <numeric>
#include <vector>

namespace identification::gap {
namespace gap_load_side_test {

constexpr double kPeriod_s = 5e-3;
constexpr double kInertia = 0.01;

Signals driven(double seconds, const std::function<double(double)>& position,
               const std::function<double(double)>& velocity) {
  Signals s;
  s.period_s = kPeriod_s;
  s.filter_Hz = 50;
  s.band_Hz = 10;
  for (double t = 0; t < seconds; t += kPeriod_s) {
    s.time_s.push_back(t);
    s.running_s.push_back(t);
    s.since_reversal_s.push_back(t);
    s.position_rad.push_back(position(t));
    s.velocity_rad_per_s.push_back(velocity(t));
  }
  return s;
}

Signals sine(double amplitude_rad, double w) {
  return driven(
      20, [=](double t) { return amplitude_rad * std::sin(w * t); },
      [=](double t) { return amplitude_rad * w * std::cos(w * t); });
}

model::effects::EffectChain rubbing(double coulomb_Nm) {
  if (coulomb_Nm == 0) return {};
  const model::effects::AnyEffect coulomb =
      model::effects::make_effect("coulomb", {{"torque_Nm", coulomb_Nm}});
  return model::effects::EffectChain({&coulomb, 1});
}

std::vector<double> accelerations(const Signals& s) {
  std::vector<double> result(s.size());
  for (std::size_t i = 1; i + 1 < s.size(); ++i)
    result[i] = (s.velocity_rad_per_s[i + 1] - s.velocity_rad_per_s[i - 1]) / (2 * s.period_s);
  return result;
}

/// `drive_Nm` may be left out behind a spring, which follows the motion.
std::vector<double> torque_on_motor(const model::effects::Mechanics& mechanics,
                                    const model::effects::EffectChain& chain, Signals s,
                                    std::vector<double> drive_Nm = {}, std::vector<double> load_Nm = {}) {
  s.acceleration_rad_per_s2 = accelerations(s);
  const std::vector<double> none(s.size());
  drive_Nm.resize(s.size());
  load_Nm.resize(s.size());
  std::vector<double> friction_Nm;
  for (std::size_t i = 0; i < s.size(); ++i) {
    const double v = s.velocity_rad_per_s[i];
    const double direction = v < 0 ? -1 : 1;
    friction_Nm.push_back(direction * chain.level_Nm({.speed_rad_per_s = std::abs(v),
                                                      .direction = direction,
                                                      .running_s = s.running_s[i]}));
  }
  return torque_on_motor_Nm(load_side(mechanics, chain, s, {drive_Nm, none, load_Nm}), mechanics, s,
                            friction_Nm, load_Nm);
}

// A shaft that is rigid for the data does not change the gap before it.
TEST(LoadSide, AGapBeforeARigidShaftStaysAGap) {
  const double gap_rad = 0.05;
  const model::effects::Mechanics mechanics{
      .inertia_kg_m2 = kInertia, .backlash_rad = gap_rad, .shaft_Nm_per_rad = 1e6, .load_share = 0.3};
  Signals s = sine(1, 10);
  const std::vector<double> none(s.size());
  s.acceleration_rad_per_s2 = accelerations(s);
  const LoadSide load = load_side(mechanics, rubbing(0.02), s, {none, none, none});
  const auto [behind, ahead] = std::ranges::minmax(load.twist_rad);
  EXPECT_NEAR(ahead, 0.5 * gap_rad, 1e-6);
  EXPECT_NEAR(behind, -0.5 * gap_rad, 1e-6);
}

// J·ω²·A/(1 − (ω/ω0)²), undamped, far from resonance.
TEST(LoadSide, ASpringAsksForMoreThanARigidShaftBelowItsResonanceAndForLessAbove) {
  const double w0 = 40;
  const double share = 0.3;
  const model::effects::Mechanics mechanics{
      .inertia_kg_m2 = kInertia, .shaft_Nm_per_rad = share * kInertia * w0 * w0, .load_share = share};
  for (const double w : {10.0, 80.0}) {
    const std::vector<double> torque = torque_on_motor(mechanics, rubbing(0), sine(1, w));
    double most = 0;
    for (std::size_t i = torque.size() / 2; i < torque.size(); ++i)
      most = std::max(most, std::abs(torque[i]));
    const double rigid = share * kInertia * w * w;
    EXPECT_NEAR(most / rigid, std::abs(1 / (1 - (w / w0) * (w / w0))), 0.03) << w;
  }
}

TEST(LoadSide, AStrongDamperAndAStiffShaftStayFinite) {
  const double share = 0.3;
  for (const double stiffness : {0.1, 1e8}) {
    const model::effects::Mechanics mechanics{.inertia_kg_m2 = kInertia,
                                              .shaft_Nm_per_rad = stiffness,
                                              .shaft_Nm_s_per_rad = 1e3,
                                              .load_share = share};
    Signals s = sine(1, 10);
    const std::vector<double> torque = torque_on_motor(mechanics, rubbing(0), s);
    // Either way the load goes with the motor.
    for (std::size_t i = torque.size() / 2; i + 1 < torque.size(); ++i)
      ASSERT_NEAR(torque[i], -share * kInertia * 100 * std::sin(10 * s.time_s[i]), 0.02 * share) << stiffness;
  }
}

TEST(LoadSide, BehindNoGapToSpeakOfTheLoadIsRigid) {
  const double share = 0.3;
  const model::effects::Mechanics mechanics{
      .inertia_kg_m2 = kInertia, .backlash_rad = 1e-9, .load_share = share};
  Signals s = sine(1, 10);
  const std::vector<double> acceleration = accelerations(s);
  std::vector<double> drive_Nm;
  for (std::size_t i = 0; i < s.size(); ++i)
    drive_Nm.push_back(kInertia * acceleration[i] + std::copysign(0.05, s.velocity_rad_per_s[i]));
  const std::vector<double> torque = torque_on_motor(mechanics, rubbing(0.05), s, drive_Nm);
  for (std::size_t i = 100; i + 100 < s.size(); ++i) {
    if (std::abs(s.velocity_rad_per_s[i]) < 1) continue;  // the sign of friction turns within a step
    // But for what it rings by on flanks that lose nothing.
    EXPECT_NEAR(torque[i], share * drive_Nm[i], 0.015) << s.time_s[i];
  }
}

/// A drive whose flanks are rigid and bounce with 1 − α·v, driven by a slow sine of torque: what moves its
/// motor, and what its load asks for, mean over each period before a sample.
struct Bouncing {
  Signals motion;
  std::vector<double> drive_Nm;
  std::vector<double> torque_Nm;
};
Bouncing bouncing(const model::effects::Mechanics& mechanics, double coulomb_Nm, double seconds) {
  constexpr int kSteps = 100;
  constexpr double kSample_s = 2e-3;
  const double dt = kSample_s / kSteps;
  const double load_inertia = mechanics.load_share * mechanics.inertia_kg_m2;
  const double motor_inertia = mechanics.inertia_kg_m2 - load_inertia;
  const double load_rubs = mechanics.friction_share() * coulomb_Nm;
  const double motor_rubs = coulomb_Nm - load_rubs;
  Bouncing result;
  Signals& s = result.motion;
  s.period_s = kSample_s;
  s.filter_Hz = 150;
  s.band_Hz = 25;
  double x = 0, v = 0, motor_x = 0, motor_v = 0;
  const auto rubbed = [&](double free, double most) {
    return free > 0 ? std::max(free - most, 0.0) : std::min(free + most, 0.0);
  };
  for (double t = 0; t < seconds; t += kSample_s) {
    s.time_s.push_back(t);
    s.running_s.push_back(t);
    s.since_reversal_s.push_back(t);
    s.position_rad.push_back(motor_x);
    s.velocity_rad_per_s.push_back(motor_v);
    result.drive_Nm.push_back(3 * coulomb_Nm * std::sin(2 * std::numbers::pi * 0.7 * t));
    double impulse = 0;
    for (int n = 0; n < kSteps; ++n) {
      const double torque = 3 * coulomb_Nm * std::sin(2 * std::numbers::pi * 0.7 * (t + n * dt));
      motor_v = rubbed(motor_v + dt * torque / motor_inertia, dt * motor_rubs / motor_inertia);
      v = rubbed(v, dt * load_rubs / load_inertia);
      motor_x += dt * motor_v;
      x += dt * v;
      const double twist = motor_x - x;
      if (std::abs(twist) < 0.5 * mechanics.backlash_rad) continue;
      const double closing = twist > 0 ? motor_v - v : v - motor_v;
      if (closing > 0) {
        const double rebound = 1 - mechanics.flank_loss_s_per_rad * closing;
        const double reduced = motor_inertia * load_inertia / mechanics.inertia_kg_m2;
        const double blow = std::copysign(reduced * (1 + rebound) * closing, twist);
        motor_v -= blow / motor_inertia;
        v += blow / load_inertia;
        impulse += blow;
      }
      x = motor_x - std::copysign(0.5 * mechanics.backlash_rad, twist);
    }
    result.torque_Nm.push_back(impulse / kSample_s);
  }
  return result;
}

// Against means of a fiftieth of a second, as the gap is looked at: a load that bounces asks for what it asks
// for when it does, which is far from what a rigid one would.
TEST(LoadSide, ABouncingLoadAsksForItsBlows) {
  const model::effects::Mechanics mechanics{.inertia_kg_m2 = kInertia,
                                            .backlash_rad = 0.01,
                                            .load_share = 0.4,
                                            .friction_ratio = 0.7,
                                            .flank_loss_s_per_rad = 2};
  const double coulomb_Nm = 0.05;
  const Bouncing truth = bouncing(mechanics, coulomb_Nm, 10);
  const std::vector<double> torque =
      torque_on_motor(mechanics, rubbing(coulomb_Nm), truth.motion, truth.drive_Nm);
  const std::vector<double> acceleration = accelerations(truth.motion);
  constexpr std::size_t kMean = 10;
  double wrong = 0;
  double rigidly_wrong = 0;
  for (std::size_t first = 100; first + kMean < torque.size(); first += kMean) {
    double was = 0, is = 0, rigid = 0;
    for (std::size_t i = first; i < first + kMean; ++i) {
      was += truth.torque_Nm[i] / kMean;
      is += torque[i] / kMean;
      rigid += (mechanics.load_share * kInertia * acceleration[i] +
                std::copysign(mechanics.friction_share() * coulomb_Nm, truth.motion.velocity_rad_per_s[i])) /
               kMean;
    }
    wrong += std::pow(is - was, 2);
    rigidly_wrong += std::pow(rigid - was, 2);
  }
  EXPECT_LT(std::sqrt(wrong / rigidly_wrong), 0.8);
}

// Behind a gap that is crossed quicker than the band shows, whatever drives the motor: the noise of a torque
// sensor, which would throw a light motor about, is no torque that the load asks for.
TEST(LoadSide, TheTorqueThatDrivesTheMotorDoesNotComeBackAsAPrediction) {
  const double coulomb_Nm = 0.005;
  const model::effects::Mechanics mechanics{.inertia_kg_m2 = 2.3e-6,
                                            .backlash_rad = 0.3,
                                            .load_share = 0.97,
                                            .friction_ratio = 0.12,
                                            .flank_loss_s_per_rad = 25};
  Signals s = driven(
      20, [](double t) { return 2 * t; }, [](double) { return 2.0; });
  s.band_Hz = 1.5;
  std::vector<double> steady(s.size(), coulomb_Nm);
  std::vector<double> noisy;
  for (const double t : s.time_s)
    noisy.push_back(coulomb_Nm * (1 + 0.2 * std::sin(5 * t) + 0.1 * std::sin(13 * t + 1)));
  const auto mean = [](const std::vector<double>& of, std::size_t first, std::size_t length) {
    return std::accumulate(of.begin() + static_cast<std::ptrdiff_t>(first),
                           of.begin() + static_cast<std::ptrdiff_t>(first + length), 0.0) /
           static_cast<double>(length);
  };
  const std::vector<double> torque = torque_on_motor(mechanics, rubbing(coulomb_Nm), s, noisy);
  constexpr std::size_t kRow = 60;  // 0.3 s
  double brought = 0;
  double came_back = 0;
  for (std::size_t first = s.size() / 4; first + kRow < s.size(); first += kRow) {
    const double noise = mean(noisy, first, kRow) - coulomb_Nm;
    brought += noise * noise;
    came_back += noise * (mean(torque, first, kRow) - mechanics.friction_share() * coulomb_Nm);
  }
  EXPECT_LT(std::abs(came_back) / brought, 0.1);
}

TEST(LoadSide, NoParametersOfAGapLeaveTheNumbers) {
  Signals s = sine(0.3, 20);
  std::vector<double> strong;
  for (const double t : s.time_s) strong.push_back(std::sin(300 * t * t));
  for (const double share : {0.01, 0.99})
    for (const double gap : {1e-6, 3.0})
      for (const double loss : {0.0, 1e4})
        for (const double ratio : {0.0, 20.0}) {
          const model::effects::Mechanics mechanics{.inertia_kg_m2 = 1e-6,
                                                    .backlash_rad = gap,
                                                    .load_share = share,
                                                    .friction_ratio = ratio,
                                                    .flank_loss_s_per_rad = loss};
          for (const double torque : torque_on_motor(mechanics, rubbing(0.01), s, strong))
            ASSERT_TRUE(std::isfinite(torque)) << share << ' ' << gap << ' ' << loss << ' ' << ratio;
        }
}

// A weight keeps the load on one flank of the gap, so that it is never crossed and the motor always carries
// the whole weight; without the weight the load floats in the middle of a motion as small as this.
TEST(LoadSide, AWeightHoldsTheGapShut) {
  const double share = 0.3;
  const model::effects::Mechanics mechanics{
      .inertia_kg_m2 = kInertia, .backlash_rad = 0.1, .load_share = share, .flank_loss_s_per_rad = 5};
  Signals s = sine(0.04, 5);
  s.band_Hz = 25;
  const std::vector<double> acceleration = accelerations(s);
  const double weight_Nm = 2 * share * kInertia * 0.04 * 25;  // twice what the motion takes
  std::vector<double> carries;
  std::vector<double> alone;
  for (std::size_t i = 0; i < s.size(); ++i) {
    carries.push_back(weight_Nm + kInertia * acceleration[i]);
    alone.push_back((1 - share) *
                    (kInertia * acceleration[i] + std::copysign(0.05, s.velocity_rad_per_s[i])));
  }
  const std::vector<double> held =
      torque_on_motor(mechanics, rubbing(0), s, carries, std::vector<double>(s.size(), weight_Nm));
  const std::vector<double> loose = torque_on_motor(mechanics, rubbing(0.05), s, alone);
  for (std::size_t i = s.size() / 2; i + 100 < s.size(); ++i) {
    const double a = -0.04 * 25 * std::sin(5 * s.time_s[i]);
    ASSERT_NEAR(held[i], weight_Nm + share * kInertia * a, 0.05 * weight_Nm) << s.time_s[i];
    ASSERT_EQ(loose[i], 0) << s.time_s[i];
  }
}

}  // namespace gap_load_side_test
}  // namespace identification::gap
