// The two-port: estimates from simulated recordings match the closed forms, and the measures of known
// matrices match hand calculations.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <complex>
#include <cstdint>
#include <limits>
#include <numbers>
#include <random>
#include <stdexcept>
#include <string>
#include <vector>

#include "identification/two_port/excitation.h"
#include "identification/two_port/hybrid_matrix.h"
#include "identification/two_port/measures.h"

namespace two_port_test {

using namespace identification::two_port;
using Complex = std::complex<double>;
using Eigen::Matrix2cd;

constexpr double kSample_s = 1e-3;

// ---- A teleoperator along one line
// --------------------------------------------------------------------------

struct Body {
  double mass_kg = 0.0;
  double drag_N_s_per_m = 0.0;
  Complex impedance(double frequency_Hz) const {
    return {drag_N_s_per_m, 2 * std::numbers::pi * frequency_Hz * mass_kg};
  }
};

/// The hand holds the master by a spring and adds the excitation. Position-error: the spring between the two
/// pulls at both. Position-force: the master gets a share of the environment's force instead.
struct Teleoperator {
  Body master{0.5, 2.0};
  Body slave{4.0, 15.0};
  double stiffness_N_per_m = 700.0;  ///< thesis
  double damping_N_s_per_m = 25.0;
  bool position_force = false;
  double force_scale = 0.4;
  double slave_friction_N = 0.0;
  bool clamped = false;  ///< the slave
  PortEnvironment environment{"free"};

  PortRecord record(const Excitation& excitation, int settling, int periods) const {
    constexpr int kSteps = 10;
    constexpr double kStep_s = kSample_s / kSteps;
    double x_m = 0, v_m = 0, x_s = 0, v_s = 0;
    PortRecord record;
    const auto per_period = static_cast<int>(excitation.samples_per_period());
    for (int n = 0; n < (settling + periods) * per_period; ++n) {
      const double excitation_N = excitation.force_N(static_cast<std::size_t>(n));
      double hand_N = 0, environment_N = 0;
      const double begin_m = x_m, begin_s = x_s;
      for (int i = 0; i < kSteps; ++i) {
        const double f_h = excitation_N - 300 * x_m - 12 * v_m;
        const double f_e = environment.stiffness_N_per_m * x_s + environment.damping_N_s_per_m * v_s;
        const double coupling_N = stiffness_N_per_m * (x_m - x_s) + damping_N_s_per_m * (v_m - v_s);
        const double back_N = position_force ? force_scale * f_e : coupling_N;
        v_m += kStep_s / master.mass_kg * (f_h - back_N - master.drag_N_s_per_m * v_m);
        if (!clamped)
          v_s += kStep_s / slave.mass_kg *
                 (coupling_N - f_e - slave.drag_N_s_per_m * v_s - slave_friction_N * std::tanh(v_s / 1e-3));
        x_m += kStep_s * v_m;
        x_s += kStep_s * v_s;
        hand_N += f_h / kSteps;
        // A clamp takes whatever comes.
        environment_N += (clamped ? coupling_N : f_e) / kSteps;
      }
      if (n < settling * per_period) continue;
      record.excitation_N.push_back(excitation_N);
      record.hand_force_N.push_back(hand_N);
      record.environment_force_N.push_back(environment_N);
      // Means like the forces, which are held for a sample.
      record.master_velocity_m_per_s.push_back((x_m - begin_m) / kSample_s);
      record.slave_velocity_m_per_s.push_back((x_s - begin_s) / kSample_s);
    }
    return record;
  }

  PortExperiment experiment(const ExcitationShape& shape, std::uint64_t first,
                            std::uint64_t realizations) const {
    PortExperiment result{environment.name, {}};
    for (std::uint64_t i = first; i < first + realizations; ++i)
      result.records.push_back(record(Excitation(shape, kSample_s, i), 1, 2));
    return result;
  }

  Matrix2cd closed_form(double frequency_Hz) const {
    const Complex s(0, 2 * std::numbers::pi * frequency_Hz);
    const Complex C = damping_N_s_per_m + stiffness_N_per_m / s;
    const Complex Z_m = master.impedance(frequency_Hz), Z_s = slave.impedance(frequency_Hz);
    const Complex follows = C / (Z_s + C);
    Matrix2cd H;
    H << (position_force ? Z_m : Z_m + Z_s * follows), (position_force ? force_scale : follows), -follows,
        1.0 / (Z_s + C);
    return H;
  }
};

std::vector<HybridPoint> estimated(const Teleoperator& free, const Teleoperator& contact,
                                   std::uint64_t realizations = 3) {
  const ExcitationShape shape{.peak_N = 6.0};
  const Excitation excitation(shape, kSample_s, 0);
  return estimate_hybrid_matrix(
      {free.experiment(shape, 1, realizations), contact.experiment(shape, 11, realizations)},
      excitation.harmonics(), excitation.samples_per_period(), kSample_s);
}

/// 5 % and 5 degrees.
void expect_close(const Matrix2cd& H, const Matrix2cd& expected, double frequency_Hz) {
  for (int row = 0; row < 2; ++row)
    for (int column = 0; column < 2; ++column) {
      const Complex ratio = H(row, column) / expected(row, column);
      EXPECT_NEAR(std::abs(ratio), 1.0, 0.05)
          << "h" << row + 1 << column + 1 << " at " << frequency_Hz << " Hz";
      EXPECT_NEAR(std::arg(ratio), 0.0, 5 * std::numbers::pi / 180)
          << "h" << row + 1 << column + 1 << " at " << frequency_Hz << " Hz";
    }
}

const PortEnvironment kSpring{"spring", 800.0, 5.0};

// ---- Excitation
// ---------------------------------------------------------------------------------------------

TEST(PortExcitation, HasItsPowerAtLogSpacedOddMultiplesOfItsPeriodAndNowhereElse) {
  const Excitation excitation(
      {.period_s = 10, .lowest_Hz = 0.3, .highest_Hz = 40, .lines = 40, .peak_N = 2.5}, kSample_s, 7);
  const std::vector<std::size_t>& harmonics = excitation.harmonics();
  ASSERT_GT(harmonics.size(), 30U);
  EXPECT_EQ(harmonics.front(), 3U);
  EXPECT_GE(harmonics.back(), 399U);
  EXPECT_LE(harmonics.back(), 400U);
  for (std::size_t i = 0; i < harmonics.size(); ++i) {
    EXPECT_EQ(harmonics[i] % 2, 1U);
    if (i > 0) {
      EXPECT_GT(harmonics[i], harmonics[i - 1]);
    }
    if (i > 0 && harmonics[i] > 50) {
      EXPECT_NEAR(std::log(static_cast<double>(harmonics[i]) / static_cast<double>(harmonics[i - 1])),
                  std::log(400.0 / 3) / 39, 0.06);
    }
  }
  ASSERT_EQ(excitation.samples_per_period(), 10'000U);
  const auto amplitude_N = [&](std::size_t harmonic) {
    Complex sum = 0;
    for (std::size_t n = 0; n < 10'000; ++n)
      sum += excitation.force_N(n) *
             std::polar(2e-4, -2 * std::numbers::pi * static_cast<double>(n * harmonic) / 1e4);
    return std::abs(sum);
  };
  const double first_N = amplitude_N(3);
  EXPECT_GT(first_N, 0.1);
  for (std::size_t harmonic = 1; harmonic < 420; ++harmonic) {
    const bool in = std::count(harmonics.begin(), harmonics.end(), harmonic) > 0;
    EXPECT_NEAR(amplitude_N(harmonic), in ? first_N : 0.0, 1e-9) << harmonic;
  }
}

TEST(PortExcitation, IsPeriodicStaysBelowItsPeakAndDiffersByRealization) {
  const ExcitationShape shape{.peak_N = 2.5};
  const Excitation a(shape, kSample_s, 1), again(shape, kSample_s, 1), b(shape, kSample_s, 2);
  double largest_N = 0, product = 0, power = 0;
  for (std::size_t n = 0; n < 10'000; ++n) {
    largest_N = std::max(largest_N, std::abs(a.force_N(n)));
    product += a.force_N(n) * b.force_N(n);
    power += a.force_N(n) * a.force_N(n);
    ASSERT_EQ(a.force_N(n), again.force_N(n));
    ASSERT_EQ(a.force_N(n), a.force_N(n + 30'000));
  }
  EXPECT_NEAR(largest_N, 2.5, 1e-12);
  EXPECT_LT(std::abs(product), 0.6 * power);
  EXPECT_LT(a.crest_factor(), 3.5);  // of many draws; noise has 3.7 in as many samples as its lines make
  EXPECT_NEAR(a.crest_factor(), 2.5 / std::sqrt(power / 1e4), 1e-9);
  EXPECT_EQ(a.harmonics(), b.harmonics());
}

TEST(PortExcitation, RefusesWhatCannotBe) {
  EXPECT_THROW(Excitation({.period_s = 10.0005}, kSample_s, 1), std::invalid_argument);
  EXPECT_THROW(Excitation({.highest_Hz = 120}, kSample_s, 1), std::invalid_argument);
  EXPECT_THROW(Excitation({.lowest_Hz = 0.31, .highest_Hz = 0.39}, kSample_s, 1), std::invalid_argument);
  EXPECT_THROW(Excitation({.lines = 0}, kSample_s, 1), std::invalid_argument);
  EXPECT_THROW(Excitation({.peak_N = -1}, kSample_s, 1), std::invalid_argument);
  EXPECT_THROW(Excitation({.period_s = std::numeric_limits<double>::quiet_NaN()}, kSample_s, 1),
               std::invalid_argument);
}

// ---- Estimation
// ---------------------------------------------------------------------------------------------

TEST(HybridMatrix, OfPositionErrorIsItsClosedForm) {
  const Teleoperator free{};
  Teleoperator contact = free;
  contact.environment = kSpring;
  const std::vector<HybridPoint> points = estimated(free, contact);
  ASSERT_GT(points.size(), 30U);
  for (const HybridPoint& point : points) {
    EXPECT_TRUE(point.ok) << point.frequency_Hz << " Hz, condition " << point.condition;
    EXPECT_GT(*std::min_element(point.coherence.begin(), point.coherence.end()), 0.9999);
    expect_close(point.H, free.closed_form(point.frequency_Hz), point.frequency_Hz);
  }
}

TEST(HybridMatrix, OfPositionForceIsItsClosedForm) {
  const Teleoperator free{.position_force = true};
  Teleoperator contact = free;
  contact.environment = kSpring;
  for (const HybridPoint& point : estimated(free, contact)) {
    EXPECT_TRUE(point.ok) << point.frequency_Hz;
    expect_close(point.H, free.closed_form(point.frequency_Hz), point.frequency_Hz);
  }
}

TEST(HybridMatrix, AClampServesAsEnvironment) {
  const Teleoperator free{};
  Teleoperator clamped = free;
  clamped.clamped = true;
  clamped.environment.name = "clamped";
  for (const HybridPoint& point : estimated(free, clamped)) {
    EXPECT_TRUE(point.ok) << point.frequency_Hz;  // neither force in free air nor velocity of the clamp
    expect_close(point.H, free.closed_form(point.frequency_Hz), point.frequency_Hz);
  }
}

TEST(HybridMatrix, NoiseOfTheSensorsMakesNoBiasAndIsReported) {
  const ExcitationShape shape{.peak_N = 6.0};
  const Excitation excitation(shape, kSample_s, 0);
  const Teleoperator free{};
  Teleoperator contact = free;
  contact.environment = kSpring;
  std::vector<PortExperiment> experiments{free.experiment(shape, 1, 8), contact.experiment(shape, 11, 8)};
  std::mt19937_64 random(5);
  std::normal_distribution<double> normal;
  for (PortExperiment& experiment : experiments)
    for (PortRecord& record : experiment.records)
      for (std::size_t n = 0; n < record.excitation_N.size(); ++n) {
        record.hand_force_N[n] += 0.05 * normal(random);
        record.environment_force_N[n] += 0.02 * normal(random);
        record.master_velocity_m_per_s[n] += 0.002 * normal(random);
        record.slave_velocity_m_per_s[n] += 0.0005 * normal(random);
      }
  const auto points = estimate_hybrid_matrix(experiments, excitation.harmonics(), 10'000, kSample_s);
  std::size_t usable = 0;
  double squares = 0;
  int noisy = 0;
  for (const HybridPoint& point : points) {
    if (!point.ok) continue;
    ++usable;
    const Matrix2cd expected = free.closed_form(point.frequency_Hz);
    for (int i = 0; i < 4; ++i) {
      const double error = std::abs(point.H(i) - expected(i));
      // Beside a percent that the steps of the simulation make.
      EXPECT_LT(error, 4 * point.deviation(i) + 0.015 * std::abs(expected(i)))
          << i << " at " << point.frequency_Hz;
      if (point.deviation(i) < 0.02 * std::abs(expected(i))) continue;
      squares += std::pow(error / point.deviation(i), 2);
      ++noisy;
    }
  }
  EXPECT_GT(usable, points.size() / 2);
  ASSERT_GT(noisy, 10);
  EXPECT_LT(std::sqrt(squares / noisy), 1.5);
  EXPECT_GT(std::sqrt(squares / noisy), 0.6);
}

TEST(HybridMatrix, FrictionLowersTheCoherenceOverRealizationsAndIsFlagged) {
  const Teleoperator free{.slave_friction_N = 2.0};
  Teleoperator contact = free;
  contact.environment = kSpring;
  const auto discarded = [](const std::vector<HybridPoint>& points) {
    return std::count_if(points.begin(), points.end(), [](const HybridPoint& point) {
      return !point.ok && *std::min_element(point.coherence.begin(), point.coherence.end()) < 0.9;
    });
  };
  EXPECT_GT(discarded(estimated(free, contact, 4)), 5);
  // One realization repeats its distortion with every period: that is why there are several.
  EXPECT_LT(discarded(estimated(free, contact, 1)), 3);
}

TEST(HybridMatrix, TwiceTheSameEnvironmentDeterminesNothing) {
  const Teleoperator free{};
  Teleoperator contact = free;
  contact.environment = kSpring;
  for (const HybridPoint& point : estimated(contact, contact)) EXPECT_FALSE(point.ok);
  // Of two free slaves neither has a force at all.
  for (const HybridPoint& point : estimated(free, free)) EXPECT_FALSE(point.ok);
}

TEST(HybridMatrix, RefusesRecordsThatDoNotFit) {
  PortRecord record;
  for (auto* signal : {&record.excitation_N, &record.hand_force_N, &record.master_velocity_m_per_s,
                       &record.environment_force_N, &record.slave_velocity_m_per_s})
    signal->assign(200, 1.0);
  const PortExperiment good{"free", {record}};
  const auto refusal = [&good](const PortExperiment& other, std::size_t samples = 100) -> std::string {
    try {
      (void)estimate_hybrid_matrix({good, other}, {3}, samples, 1e-2);
    } catch (const std::invalid_argument& error) {
      return error.what();
    }
    return {};
  };
  EXPECT_EQ(refusal(good), "");
  EXPECT_EQ(refusal(good, 130),
            "two-port: experiment 'free', record 1 has 200 samples, must be whole periods of 130");
  EXPECT_EQ(refusal(good, 200), "two-port: experiment 'free' has 1 periods, coherence takes two or more");
  PortExperiment uneven{"wall", {record}};
  uneven.records[0].slave_velocity_m_per_s.pop_back();
  EXPECT_EQ(refusal(uneven), "two-port: experiment 'wall', record 1 has signals of different lengths");
  EXPECT_NE(refusal({"none", {}}), "");
  EXPECT_THROW((void)estimate_hybrid_matrix({good}, {3}, 100, 1e-2), std::invalid_argument);
}

// ---- Measures
// -----------------------------------------------------------------------------------------------

std::vector<HybridPoint> over_frequency(const auto& H, double highest_Hz = 40) {
  std::vector<HybridPoint> points;
  for (double f_Hz = 0.3; f_Hz < highest_Hz * 1.0001; f_Hz *= std::pow(10, 0.02)) {
    HybridPoint point{.frequency_Hz = f_Hz, .ok = true};
    point.H = H(f_Hz);
    points.push_back(point);
  }
  return points;
}
Matrix2cd matrix(Complex h11, Complex h12, Complex h21, Complex h22) {
  Matrix2cd H;
  H << h11, h12, h21, h22;
  return H;
}

TEST(TwoPortMeasures, OfOneMatrixAreWhatAPencilSays) {
  const Matrix2cd H = matrix(2.0, 0.5, -0.8, 0.1);
  EXPECT_NEAR(std::abs(transmitted_impedance(H, 3.0) - (2.0 + 1.2 / 1.3)), 0.0, 1e-12);
  EXPECT_NEAR(std::abs(transmitted_change(H, 3.0) - 0.4 / 1.69), 0.0, 1e-12);
  EXPECT_NEAR(std::abs(impedance_width(H) - 4.0), 0.0, 1e-12);
  EXPECT_NEAR(llewellyn_stability(H), (2 * 2.0 * 0.1 + 0.4) / 0.4, 1e-12);
  EXPECT_TRUE(unconditionally_stable(H));
  EXPECT_FALSE(unconditionally_stable(matrix(1, 1, 1, 0.1)));        // η = -0.8
  EXPECT_FALSE(unconditionally_stable(matrix(-0.1, 0, 0, 1)));       // pushes the hand by itself
  EXPECT_FALSE(unconditionally_stable(matrix(1, 0.5, -0.8, -0.1)));  // or the environment
  EXPECT_TRUE(unconditionally_stable(matrix(0, 1, -1, 0)));          // the ideal one, just
  EXPECT_TRUE(unconditionally_stable(matrix(1, 0, 0, 1)));           // no teleoperator at all
  EXPECT_FALSE(unconditionally_stable(matrix(0.1, {0, 1}, 1, 0.1)));
}

TEST(TwoPortMeasures, AreDerivativeAndDifferenceOfTheTransmittedImpedance) {
  const Matrix2cd H = Teleoperator{}.closed_form(3.0);
  const Complex Z_e(4, -7), small(1e-5, 2e-5);
  EXPECT_NEAR(std::abs((transmitted_impedance(H, Z_e + small) - transmitted_impedance(H, Z_e - small)) /
                           (2.0 * small) -
                       transmitted_change(H, Z_e)),
              0.0, 1e-8);
  EXPECT_NEAR(std::abs(transmitted_impedance(H, 1e12) - transmitted_impedance(H, 0.0) - impedance_width(H)),
              0.0, 1e-6);
}

TEST(TwoPortMeasures, TheIdealTeleoperatorHasNoFault) {
  const TwoPortMeasures measures =
      measure(over_frequency([](double) { return matrix(0, 1, -1, 0); }), usual_environments());
  EXPECT_NEAR(measures.position.low_frequency_gain, 1.0, 1e-12);
  EXPECT_FALSE(measures.position.bandwidth_Hz);
  EXPECT_FALSE(measures.force.bandwidth_Hz);
  EXPECT_NEAR(measures.scaling_product, 1.0, 1e-12);
  ASSERT_EQ(measures.environments.size(), 3U);
  for (const FeltEnvironment& felt : measures.environments) {
    EXPECT_NEAR(felt.transparency_error, 0.0, 1e-12);
    EXPECT_NEAR(felt.fidelity, 1.0, 1e-12);
  }
  EXPECT_EQ(measures.stable_share, 1.0);
  EXPECT_FALSE(measures.unstable_from_Hz);
}

TEST(TwoPortMeasures, BandwidthIsWhereTheGainHasFallenByThreeDecibels) {
  // First orders of 5 and 12 Hz, the force scaled by 0.3.
  const TwoPortMeasures measures =
      measure(over_frequency(
                  [](double f) { return matrix(0, 0.3 / Complex(1, f / 12), -1.0 / Complex(1, f / 5), 0); }),
              {});
  EXPECT_NEAR(*measures.position.bandwidth_Hz, 5.0, 0.06);  // the lowest octave has lost 0.4 % by itself
  EXPECT_NEAR(*measures.force.bandwidth_Hz, 12.0, 0.06);
  EXPECT_NEAR(measures.position.low_frequency_gain, 1.0, 0.006);
  EXPECT_NEAR(measures.scaling_product, 0.3, 0.003);
}

TEST(TwoPortMeasures, TransparencyErrorCountsGainAndPhaseAlike) {
  const auto error = [](Complex h12) {
    return measure(over_frequency([h12](double) { return matrix(0, h12, -1, 0); }), {{"wall", 1000, 5}})
        .environments[0]
        .transparency_error;
  };
  EXPECT_NEAR(error(1.1), std::log(1.1), 1e-12);
  EXPECT_NEAR(error(1 / 1.1), std::log(1.1), 1e-12);
  EXPECT_NEAR(error(std::polar(1.0, 0.1)), 0.1, 1e-12);
  // Right up to √(0.3·40) Hz, the middle of the decades, and then twice too much: half of ln 2.
  const auto points = over_frequency([](double f) { return matrix(0, f < std::sqrt(12.0) ? 1 : 2, -1, 0); });
  EXPECT_NEAR(measure(points, {{"wall", 1000, 5}}).environments[0].transparency_error, 0.5 * std::log(2.0),
              0.01);
}

TEST(TwoPortMeasures, FidelityWeighsFrequenciesUpToItsBandAlikeAndNoneBeyond) {
  const auto points = over_frequency(
      [](double f) {
        return matrix(0, f < 20 ? 1 : f < 40 ? 0.5 : 9, -1, 0);
      },
      100);
  const double fidelity = measure(points, {{"wall", 1000, 5}}, 40.0).environments[0].fidelity;
  EXPECT_NEAR(fidelity, std::sqrt(0.5 * (1 + 0.25)), 0.01);
}

TEST(TwoPortMeasures, EnvironmentsAreMassDamperAndSpring) {
  const PortEnvironment environment{"all", 200, 3, 0.5};
  const double w = 2 * std::numbers::pi * 4;
  EXPECT_NEAR(std::abs(environment.impedance_N_s_per_m(4) - Complex(3, 0.5 * w - 200 / w)), 0.0, 1e-12);
}

TEST(TwoPortMeasures, DiscardedPointsCountForNothing) {
  auto points = over_frequency([](double) { return matrix(1, 1, -1, 0.1); });
  for (std::size_t i = 0; i < points.size(); i += 3) {
    points[i].ok = false;
    points[i].H = matrix(-1, 0.01, 50, -1);
  }
  const TwoPortMeasures measures = measure(points, usual_environments());
  EXPECT_EQ(measures.discarded, (points.size() + 2) / 3);
  EXPECT_NEAR(measures.position.low_frequency_gain, 1.0, 1e-12);
  EXPECT_EQ(measures.stable_share, 1.0);
  for (HybridPoint& point : points) point.ok = point.frequency_Hz < 0.32;
  EXPECT_THROW((void)measure(points, {}), std::invalid_argument);
}

TEST(TwoPortMeasures, OfPositionErrorShowWhatItIsKnownFor) {
  // Stable with everything; in free air the slave is felt, and against a hard wall the spring instead of it.
  const auto error =
      measure(over_frequency([](double f) { return Teleoperator{}.closed_form(f); }), usual_environments());
  EXPECT_EQ(error.stable_share, 1.0);
  EXPECT_NEAR(error.scaling_product, 1.0, 0.1);  // towards its resonance at 2 Hz
  EXPECT_GT(error.environments[2].transparency_error, error.environments[1].transparency_error);
  // Position-force does not feel the slave and is not stable with everything.
  const Teleoperator position_force{.position_force = true};
  const auto force = measure(over_frequency([&](double f) { return position_force.closed_form(f); }), {});
  EXPECT_LT(force.stable_share, 1.0);
  EXPECT_TRUE(force.unstable_from_Hz);
  EXPECT_NEAR(force.scaling_product, 0.4, 0.02);
  EXPECT_FALSE(force.force.bandwidth_Hz);
}

}  // namespace two_port_test
