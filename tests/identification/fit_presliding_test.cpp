// Stiffness and damping below break-away: hidden truth from a Runge-Kutta integrator written here.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <functional>
#include <numbers>
#include <stdexcept>
#include <string>

#include "identification/fit/presliding_fit.h"
#include "identification/recording.h"

namespace identify_presliding_test {

using identification::fit::estimate_of;
using identification::fit::fit_presliding;
using identification::fit::PreslidingFit;
using identification::fit::PreslidingFitOptions;

constexpr double kInertia = 0.0112;
constexpr double kWheelTick_rad = 2 * std::numbers::pi / 104000;

struct Truth {  // wheel 1, thesis table 4 and 2.5.2
  double s0 = 250;
  double s1 = 0.127;
  double Fg = 0.002;
  double y0 = 0.2677;
};

/// d/dt (x, v, z) of a joint with LuGre friction, as the 1995 paper writes it.
std::array<double, 3> slope(const Truth& truth, const std::array<double, 3>& state, double torque) {
  const double v = state[1];
  const double z = state[2];
  const double g =
      (0.03718 + (0.08976 - 0.03718) * std::exp(-std::pow(std::abs(v) / 0.1516, 1.047))) / truth.s0;
  const double dz = v - std::abs(v) * z / g;
  const double F = truth.s0 * z + truth.s1 * dz + 0.01898 * v;
  return {v, (torque - F - truth.Fg) / kInertia, dz};
}

using Torque = std::function<double(double)>;

/// Two frequencies, below the static friction, growing from zero.
double two_sines(double t) {
  return std::min(1.0, t) *
         (0.05 * std::sin(2 * std::numbers::pi * 1.1 * t) + 0.02 * std::sin(2 * std::numbers::pi * 17 * t));
}

/// 1 kHz; the torque holds over each period, in which the state takes 20 steps.
identification::Recording recorded(
    const Truth& truth, double tick_rad, const Torque& commanded = two_sines,
    const std::function<double(double)>& delivered = [](double torque) { return torque; }, int rows = 3000) {
  identification::Recording recording;
  recording.rig = "wheel-1";
  recording.experiment = "presliding";
  recording.columns = {
      {"time_s", {}}, {"torque_command_Nm", {}}, {"torque_measured_Nm", {}}, {"position_rad", {}}};
  std::array<double, 3> state{truth.y0, 0, 0};
  constexpr double h = 5e-5;
  for (int i = 0; i < rows; ++i) {
    const double t = i * 1e-3;
    const double torque = delivered(commanded(t));
    recording.columns[0].values.push_back(t);
    recording.columns[1].values.push_back(commanded(t));
    recording.columns[2].values.push_back(torque);
    recording.columns[3].values.push_back(tick_rad * std::round(state[0] / tick_rad));
    for (int step = 0; step < 20; ++step) {
      const auto moved = [&state](const std::array<double, 3>& k, double by) {
        return std::array{state[0] + by * k[0], state[1] + by * k[1], state[2] + by * k[2]};
      };
      const auto k1 = slope(truth, state, torque);
      const auto k2 = slope(truth, moved(k1, h / 2), torque);
      const auto k3 = slope(truth, moved(k2, h / 2), torque);
      const auto k4 = slope(truth, moved(k3, h), torque);
      for (std::size_t j = 0; j < 3; ++j) state[j] += h / 6 * (k1[j] + 2 * k2[j] + 2 * k3[j] + k4[j]);
    }
  }
  return recording;
}

const PreslidingFitOptions kKnown{.inertia_kg_m2 = kInertia};  // sliding friction: table 4, the defaults

void expect_refused(const PreslidingFit& fit, const std::string& why) {
  for (const char* name : {"stiffness_Nm_per_rad", "damping_Nm_s_per_rad"})
    EXPECT_FALSE(estimate_of(fit.parameters, "presliding", name).ok());
  ASSERT_FALSE(fit.verdicts.empty());
  EXPECT_NE(fit.verdicts[0].find(why), std::string::npos) << fit.verdicts[0];
}

TEST(IdentifyPresliding, FindsStiffnessDampingAndOffsetsWithAFineEncoder) {
  const Truth truth;
  const PreslidingFit fit = fit_presliding(recorded(truth, kWheelTick_rad / 64), kKnown);
  EXPECT_TRUE(fit.verdicts.empty()) << fit.verdicts[0];
  const auto expect_near = [&](const char* effect, const char* name, double value) {
    const auto& estimate = estimate_of(fit.parameters, effect, name);
    EXPECT_NEAR(estimate.value, value, 0.05 * value) << name;
    EXPECT_LE(estimate.lower, value * (1 + 0.02)) << name;
    EXPECT_GE(estimate.upper, value * (1 - 0.02)) << name;
  };
  expect_near("presliding", "stiffness_Nm_per_rad", truth.s0);
  expect_near("presliding", "damping_Nm_s_per_rad", truth.s1);
  expect_near("torque_offset", "torque_Nm", truth.Fg);
  expect_near("", "position_offset_rad", truth.y0);
  EXPECT_EQ(estimate_of(fit.parameters, "presliding", "exponent").value, 1) << "the law that was fitted";
  EXPECT_LT(fit.relative_error_percent, 2);
}

TEST(IdentifyPresliding, FindsAnotherJointFromTheSameStarts) {
  const Truth truth{.s0 = 900, .s1 = 0.6, .Fg = -0.001, .y0 = 0};
  const PreslidingFit fit = fit_presliding(recorded(truth, kWheelTick_rad / 256), kKnown);
  EXPECT_NEAR(estimate_of(fit.parameters, "presliding", "stiffness_Nm_per_rad").value, truth.s0,
              0.05 * truth.s0);
  EXPECT_NEAR(estimate_of(fit.parameters, "presliding", "damping_Nm_s_per_rad").value, truth.s1,
              0.1 * truth.s1);
}

double slow_sine(double t) { return 0.04 * std::sin(2 * std::numbers::pi * 0.5 * t); }

TEST(IdentifyPresliding, SaysThatTheYouBotsEncoderIsTooCoarse) {  // as the thesis found
  expect_refused(fit_presliding(recorded({}, kWheelTick_rad, slow_sine), kKnown), "encoder is too coarse");
}

TEST(IdentifyPresliding, SaysThatATorqueWhichNeverReversesShowsNothing) {  // thesis figure 24
  const auto positive = [](double t) { return 0.04 - 0.03 * std::cos(2 * std::numbers::pi * 1.1 * t); };
  expect_refused(fit_presliding(recorded({}, kWheelTick_rad / 64, positive), kKnown), "never reverses");
}

TEST(IdentifyPresliding, RefusesTheMotorOffsetOfTheThesis) {  // 0.03 N·m is delivered where less is commanded
  const auto offset = [](double torque) { return std::copysign(std::max(std::abs(torque), 0.03), torque); };
  const identification::Recording recording = recorded({}, kWheelTick_rad / 64, two_sines, offset);
  expect_refused(fit_presliding(recording, kKnown), "where less is commanded");
  identification::Recording measured_only = recording;
  measured_only.columns.erase(measured_only.columns.begin() + 1);
  expect_refused(fit_presliding(measured_only, kKnown), "jumps over zero");
}

TEST(IdentifyPresliding, ALightDampingThatOnlyTheFirstRingingShowsIsFoundOrRefusedNeverInvented) {
  constexpr double kDamping = 0.02;
  for (const int samples : {3000, 6000}) {
    const PreslidingFit fit = fit_presliding(
        recorded(
            {.s1 = kDamping}, kWheelTick_rad / 8, slow_sine, [](double torque) { return torque; }, samples),
        kKnown);
    EXPECT_TRUE(estimate_of(fit.parameters, "presliding", "stiffness_Nm_per_rad").ok());
    const auto& damping = estimate_of(fit.parameters, "presliding", "damping_Nm_s_per_rad");
    if (!damping.ok()) continue;
    EXPECT_LE(damping.lower, kDamping) << samples;
    EXPECT_GE(damping.upper, kDamping) << samples;
    EXPECT_NEAR(damping.value, kDamping, 0.2 * kDamping) << samples;
  }
}

TEST(IdentifyPresliding, NeedsTheInertiaAndItsColumns) {
  EXPECT_THROW(fit_presliding(recorded({}, kWheelTick_rad), {}), std::invalid_argument);
  identification::Recording without = recorded({}, kWheelTick_rad);
  without.columns.pop_back();
  EXPECT_THROW(fit_presliding(without, kKnown), std::invalid_argument);
}

}  // namespace identify_presliding_test
