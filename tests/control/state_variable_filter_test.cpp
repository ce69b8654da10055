// The filter against closed forms of its transfer function ω²/(s² + 2ζωs + ω²).
#include "control/state_variable_filter.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <complex>
#include <limits>
#include <numbers>
#include <stdexcept>
#include <string>

#include "tests/support/no_alloc_guard.h"

namespace state_variable_filter_test {

using control::StateVariableFilter;
using Config = StateVariableFilter::Config;
using Output = StateVariableFilter::Output;

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// Position, velocity and acceleration at time t after the start (p, v) with the input at zero: the textbook
/// solutions of x'' + 2ζω·x' + ω²·x = 0.
Output free_response(double w, double zeta, double p, double v, double t) {
  const double a = zeta * w;
  double x = 0, dx = 0;
  if (zeta == 1) {
    const double e = std::exp(-w * t), c = v + w * p;
    x = e * (p + c * t);
    dx = e * (v - w * c * t);
  } else if (zeta < 1) {
    const double wd = w * std::sqrt(1 - zeta * zeta), e = std::exp(-a * t), c = (v + a * p) / wd;
    x = e * (p * std::cos(wd * t) + c * std::sin(wd * t));
    dx = -a * x + e * wd * (c * std::cos(wd * t) - p * std::sin(wd * t));
  } else {
    const double root = w * std::sqrt(zeta * zeta - 1), slow = a - root, fast = a + root;
    const double c1 = (v + fast * p) / (2 * root), c2 = p - c1;
    x = c1 * std::exp(-slow * t) + c2 * std::exp(-fast * t);
    dx = -slow * c1 * std::exp(-slow * t) - fast * c2 * std::exp(-fast * t);
  }
  return {x, dx, -w * w * x - 2 * a * dx};
}

/// The last output after `input(t)` was fed at t = 0, T, 2T, … up to `duration_s`.
template <class Input>
Output run(StateVariableFilter& filter, const Config& config, double duration_s, const Input& input) {
  Output output;
  const long steps = std::lround(duration_s / config.period_s);
  for (long k = 0; k <= steps; ++k) output = filter.step(input(static_cast<double>(k) * config.period_s));
  return output;
}

TEST(StateVariableFilter, StepResponseIsTheClosedForm) {
  for (const double zeta : {0.1, 0.5, 0.9, 1 - 1e-7, 1.0, 1 + 1e-7, 1.5, 10.0})
    for (const double cutoff : {1.0, 125.0, 1000.0}) {
      const Config config{cutoff, zeta, 1e-3};
      StateVariableFilter filter(config);
      filter.reset(0.0);
      const Output first = filter.step(1.0);
      // Next to ζ = 1 the textbook forms lose half their digits themselves: there its own form counts.
      const bool nearly_one = std::abs(zeta - 1) < 1e-3;
      const double digits = nearly_one && zeta != 1 ? 1e-6 : 1e-10;
      for (int k = 1; k <= 300; ++k) {
        const Output output = filter.step(1.0);
        // From the first output on the input stands still, and nothing depends on how samples are joined.
        const Output expected =
            free_response(cutoff, nearly_one ? 1.0 : zeta, first.position - 1, first.velocity, 1e-3 * k);
        ASSERT_NEAR(output.position, 1 + expected.position, digits) << "zeta " << zeta << ", step " << k;
        ASSERT_NEAR(output.velocity, expected.velocity, digits * cutoff) << "zeta " << zeta << ", step " << k;
        ASSERT_NEAR(output.acceleration, expected.acceleration, digits * cutoff * cutoff)
            << "zeta " << zeta << ", step " << k;
        // From the step itself on: within the period in which the input is seen to change.
        const double from_start =
            1 + free_response(cutoff, nearly_one ? 1.0 : zeta, -1, 0, 1e-3 * (k + 1)).position;
        ASSERT_NEAR(output.position, from_start, 0.51 * cutoff * 1e-3) << "zeta " << zeta << ", step " << k;
      }
    }
}

TEST(StateVariableFilter, ConstantInputComesThroughUnchanged) {
  const Config config;
  StateVariableFilter filter(config);
  filter.reset(0.0);
  const Output output = run(filter, config, 1.0, [](double) { return 3.5; });
  EXPECT_NEAR(output.position, 3.5, 1e-12);
  EXPECT_NEAR(output.velocity, 0.0, 1e-12 * 125);
  EXPECT_NEAR(output.acceleration, 0.0, 1e-12 * 125 * 125);
}

TEST(StateVariableFilter, TheSlopeOfARampComesOutExactly) {
  for (const Config& config : {Config{}, Config{125, 0.5, 1e-3}, Config{500, 1.2, 1e-3}}) {
    StateVariableFilter filter(config);
    const Output output = run(filter, config, 1.0, [](double t) { return 2.0 - 3.0 * t; });
    // 1 s is 50 time constants and more: the transient is gone, rounding of differences remains.
    EXPECT_NEAR(output.velocity, -3.0, 1e-9) << "cutoff " << config.cutoff_rad_per_s;
  }
}

TEST(StateVariableFilter, ARampHasNoAcceleration) {
  const Config config;
  StateVariableFilter filter(config);
  const Output output = run(filter, config, 1.0, [](double t) { return 3.0 * t; });
  EXPECT_NEAR(output.acceleration, 0.0, 1e-6);
}

TEST(StateVariableFilter, ARampComesOutLateByTwiceTheDampingOverTheCutoff) {
  for (const Config& config : {Config{}, Config{125, 0.5, 1e-3}, Config{40, 1.5, 1e-3}}) {
    StateVariableFilter filter(config);
    const Output output = run(filter, config, 2.0, [](double t) { return 3.0 * t; });
    const double delay_s = (3.0 * 2.0 - output.position) / 3.0;
    // Half a period may belong to how samples are joined, the rest to rounding.
    EXPECT_NEAR(delay_s, 2 * config.damping / config.cutoff_rad_per_s, 0.51 * config.period_s);
  }
}

TEST(StateVariableFilter, TheAccelerationOfAParabolaComesOut) {
  const Config config;
  StateVariableFilter filter(config);
  const Output output = run(filter, config, 1.0, [](double t) { return 0.5 * 4.0 * t * t; });
  // Relative to the value, a percent: between samples the input runs straight where the parabola bends.
  EXPECT_NEAR(output.acceleration, 4.0, 0.04);
  EXPECT_NEAR(output.velocity, 4.0 * (1.0 - 2 * 0.9 / 125), 0.51e-3 * 4.0 + 0.002 * 4.0);
}

TEST(StateVariableFilter, AtTheCutoffASineComesOutAQuarterPeriodLate) {
  const Config config;
  StateVariableFilter filter(config);
  const double w = config.cutoff_rad_per_s;
  std::complex<double> in = 0;
  std::complex<double> out = 0;
  // Fourier coefficients over 40 periods, after 40 periods of transient.
  const double period_s = 2 * std::numbers::pi / w;
  for (double k = 0; k * config.period_s < 80 * period_s; ++k) {
    const double t = k * config.period_s;
    const double position = filter.step(std::sin(w * t)).position;
    if (t < 40 * period_s) continue;
    const std::complex<double> wave = std::polar(1.0, -w * t);
    in += wave * std::sin(w * t);
    out += wave * position;
  }
  const std::complex<double> gain = out / in;
  EXPECT_NEAR(std::abs(gain), 1 / (2 * 0.9), 0.02);  // 1 %: 40 periods are not a whole number of samples
  // An input held over each period adds half of it, 0.0625 rad.
  EXPECT_NEAR(std::arg(gain), -std::numbers::pi / 2, 0.5 * w * config.period_s + 0.02);
}

TEST(StateVariableFilter, AStartFarFromZeroMakesNoFalseVelocity) {
  StateVariableFilter fresh{Config{}};
  StateVariableFilter reset{Config{}};
  reset.reset(0.0);
  reset.reset(-54321.0);
  for (int k = 0; k < 100; ++k) {
    const Output a = fresh.step(12345.678);
    EXPECT_NEAR(a.position, 12345.678, 1e-9);
    EXPECT_NEAR(a.velocity, 0.0, 1e-9 * 125);  // rounding of 1e4 times ω
    EXPECT_NEAR(reset.step(-54321.0).velocity, 0.0, 1e-9 * 125);
  }
}

TEST(StateVariableFilter, ResetForgetsTheMotion) {
  const Config config;
  StateVariableFilter filter(config);
  static_cast<void>(run(filter, config, 0.1, [](double t) { return 100 * t; }));
  filter.reset(7.0);
  const Output output = filter.step(7.0);
  EXPECT_NEAR(output.position, 7.0, 1e-12);
  EXPECT_NEAR(output.velocity, 0.0, 1e-9);
}

TEST(StateVariableFilter, AlongAStraightInputAGapIsAsIfEachSampleHadCome) {
  for (const Config& config :
       {Config{}, Config{125, 1.0, 1e-3}, Config{1000, 10, 1e-3}, Config{40, 0.5, 1e-2}})
    for (const int periods : {2, 5, 50, 95}) {
      SCOPED_TRACE(testing::Message()
                   << config.cutoff_rad_per_s << ", " << config.damping << ", " << periods);
      StateVariableFilter whole(config), gapped(config);
      const auto input = [&](int k) { return 2.0 - 3.0 * config.period_s * k; };
      // The gap begins in the middle of the transient: the deviation from the ramp must decay in it, too.
      for (StateVariableFilter* filter : {&whole, &gapped}) {
        filter->reset(1.9);
        for (int k = 0; k <= 4; ++k) filter->step(input(k));
      }
      Output expected;
      for (int k = 5; k <= 4 + periods; ++k) expected = whole.step(input(k));
      const Output output = gapped.step(input(4 + periods), periods * config.period_s);
      EXPECT_NEAR(output.position, expected.position, 1e-9);
      EXPECT_NEAR(output.velocity, expected.velocity, 1e-7);
      EXPECT_NEAR(gapped.step(input(5 + periods)).velocity, whole.step(input(5 + periods)).velocity, 1e-7);
    }
}

TEST(StateVariableFilter, AGapHoweverLongShowsNoMoreThanItsMeanSpeed) {
  for (const double zeta : {0.1, 0.9, 1.0, 10.0})
    for (const double gap_s : {0.02, 0.1, 10.0, 1e6}) {
      const Config config{125, zeta, 1e-3};
      StateVariableFilter filter(config);
      filter.reset(0);
      const double velocity = filter.step(gap_s * 2.0, gap_s).velocity;
      EXPECT_TRUE(std::isfinite(velocity)) << zeta << ", " << gap_s;
      if (zeta >= 1) {
        EXPECT_LE(velocity, 2.0 + 1e-6) << zeta << ", " << gap_s;
      }
      if (gap_s >= 10) {
        EXPECT_NEAR(velocity, 2.0, 1e-6) << zeta << ", " << gap_s;
      }
    }
}

TEST(StateVariableFilter, BeforeTheFirstSampleThereIsNoGap) {
  StateVariableFilter filter{Config{}};
  EXPECT_EQ(filter.step(5.0, 0.05).velocity, 0.0);
  StateVariableFilter held{Config{}};
  EXPECT_EQ(held.step(5.0, 0.0).position, 5.0) << "there is nothing else to hold";
}

TEST(StateVariableFilter, ASampleThatIsNoNewOneTakesNoTime) {
  StateVariableFilter heard{Config{}}, lossy{Config{}};
  const auto input = [](int k) { return 0.018 * k; };
  Output known = lossy.step(input(0));
  for (int k = 0, newest = 0; k <= 100; ++k) {
    const Output expected = heard.step(input(k));
    if (k % 4 != 0) {
      const Output output = lossy.step(input(newest), 0.0);
      EXPECT_EQ(output.position, known.position);
      EXPECT_EQ(output.velocity, known.velocity);
      EXPECT_EQ(output.acceleration, known.acceleration);
    } else {
      known = lossy.step(input(k), (k - newest) * 1e-3);
      newest = k;
      EXPECT_NEAR(known.velocity, expected.velocity, 1e-9) << "three of four lost, and it looks no slower";
    }
  }
}

TEST(StateVariableFilter, IsLinear) {
  const Config config;
  StateVariableFilter a(config), b(config), sum(config);
  a.reset(0.0), b.reset(0.0), sum.reset(0.0);
  for (int k = 0; k < 200; ++k) {
    const double x = std::sin(0.1 * k), y = 0.01 * k;
    const Output out_a = a.step(x), out_b = b.step(y), out_sum = sum.step(2 * x - 3 * y);
    ASSERT_NEAR(out_sum.position, 2 * out_a.position - 3 * out_b.position, 1e-12);
    ASSERT_NEAR(out_sum.velocity, 2 * out_a.velocity - 3 * out_b.velocity, 1e-10);
  }
}

TEST(StateVariableFilter, OneEncoderTickShowsAsAFewMilliradiansPerSecond) {
  // The default cut-off is chosen for this: a step of 6.08e-5 rad peaks at ω·0.394·tick for ζ = 0.9
  // (e^(−ζφ/√(1−ζ²)) with cos φ = ζ), where one tick per period would show as 61 mrad/s.
  StateVariableFilter filter{Config{}};
  filter.reset(0.0);
  double peak = 0;
  for (int k = 0; k < 100; ++k) peak = std::max(peak, filter.step(6.08e-5).velocity);
  EXPECT_NEAR(peak, 125 * 0.394 * 6.08e-5, 2e-5);  // the peak falls between samples
}

TEST(StateVariableFilter, RefusesConfigurationsByName) {
  const auto expect_refused = [](const Config& config, const std::string& name) {
    try {
      const StateVariableFilter filter(config);
      FAIL() << "accepted a bad " << name;
    } catch (const std::invalid_argument& error) {
      EXPECT_NE(std::string(error.what()).find(name), std::string::npos) << error.what();
    }
  };
  for (const double bad : {0.0, -1.0, kNaN, kInfinity}) {
    expect_refused({.cutoff_rad_per_s = bad}, "cutoff_rad_per_s");
    expect_refused({.period_s = bad}, "period_s");
  }
  expect_refused({.cutoff_rad_per_s = 1001}, "cutoff_rad_per_s");  // ω·T above 1
  for (const double bad : {0.0, 0.09, 10.1, -0.9, kNaN, kInfinity})
    expect_refused({.damping = bad}, "damping");
  EXPECT_NO_THROW(StateVariableFilter(Config{1000, 0.1, 1e-3}));
  EXPECT_NO_THROW(StateVariableFilter(Config{1000, 10, 1e-3}));
}

TEST(StateVariableFilter, StepDoesNotAllocateOrLock) {
  if (!support::NoAllocGuard::kActive) GTEST_SKIP() << "the sanitizer owns malloc";
  StateVariableFilter filter{Config{}};
  double sum = 0;
  const support::NoAllocGuard guard;
  for (int i = 0; i < 10; ++i) sum += filter.step(i).velocity;
  EXPECT_EQ(guard.violations(), 0);
  EXPECT_GT(sum, 0.0);
}

}  // namespace state_variable_filter_test
