// The parts of the search for missing effects, each compared with a hand calculation.
#include <gtest/gtest.h>

#include <Eigen/QR>
#include <cmath>
#include <numbers>
#include <random>
#include <vector>

#include "identification/gap/actuator_channel.h"
#include "identification/gap/candidates.h"
#include "identification/gap/chance_data.h"
#include "identification/gap/lost_sign.h"
#include "identification/gap/prediction.h"
#include "identification/gap/regression.h"
#include "identification/gap/zero_phase.h"

namespace identification::gap {
namespace gap_parts_test {

constexpr double kPi = std::numbers::pi;

std::vector<double> sine(double frequency_Hz, double period_s, std::size_t count) {
  std::vector<double> samples(count);
  for (std::size_t i = 0; i < count; ++i)
    samples[i] = std::sin(2 * kPi * frequency_Hz * period_s * static_cast<double>(i));
  return samples;
}

TEST(ZeroPhase, ConstantsAndRampsPass) {
  std::vector<double> ramp(400);
  for (std::size_t i = 0; i < ramp.size(); ++i) ramp[i] = 3.0 - 0.01 * static_cast<double>(i);
  const std::vector<double> smooth = zero_phase(ramp, 1e-3, 25);
  for (std::size_t i = 0; i < ramp.size(); ++i) EXPECT_NEAR(smooth[i], ramp[i], 1e-3) << i;
}

// |H|² of a second-order Butterworth, bilinear with its cutoff where it belongs: 1/(1 + (tan w / tan wc)^4).
TEST(ZeroPhase, SinesKeepTheirPhaseAndLoseWhatButterworthTakesTwice) {
  const double period_s = 1e-3;
  for (const double frequency_Hz : {5.0, 25.0, 60.0}) {
    const std::vector<double> in = sine(frequency_Hz, period_s, 4000);
    const std::vector<double> out = zero_phase(in, period_s, 25);
    const double ratio = std::tan(kPi * frequency_Hz * period_s) / std::tan(kPi * 25 * period_s);
    const double gain = 1 / (1 + std::pow(ratio, 4));
    for (std::size_t i = 1500; i < 2500; ++i)
      EXPECT_NEAR(out[i], gain * in[i], 1e-3) << frequency_Hz << " " << i;
  }
}

TEST(ZeroPhase, ACutoffBeyondTheSampleRateIsRefused) {
  EXPECT_THROW((void)zero_phase(sine(1, 0.01, 100), 0.01, 50), std::invalid_argument);
}

TEST(Derivative, IsExactForAParabola) {
  std::vector<double> parabola(50);
  for (std::size_t i = 0; i < parabola.size(); ++i) parabola[i] = 0.25 * static_cast<double>(i * i);
  const std::vector<double> slope = derivative(parabola, 0.5);
  for (std::size_t i = 1; i + 1 < slope.size(); ++i) EXPECT_DOUBLE_EQ(slope[i], static_cast<double>(i));
}

struct Problem {
  Eigen::MatrixXd columns;
  Eigen::VectorXd target;
  std::vector<int> block;
};
Problem problem(double noise) {
  constexpr Eigen::Index kRows = 240;
  std::mt19937 random(3);
  std::normal_distribution<double> normal;
  Problem p{
      Eigen::MatrixXd::NullaryExpr(kRows, 3, [&] { return normal(random); }), Eigen::VectorXd(kRows), {}};
  const Eigen::Vector3d truth(2, -1, 0.5);
  p.target = p.columns * truth + Eigen::VectorXd::NullaryExpr(kRows, [&] { return noise * normal(random); });
  for (Eigen::Index i = 0; i < kRows; ++i) p.block.push_back(static_cast<int>(i * 12 / kRows));
  return p;
}

TEST(BlockRegression, PredictsEachFoldFromTheOthers) {
  const Problem p = problem(0.3);
  const BlockRegression regression(p.columns, p.block, 4);
  const BlockRegression::Target target = regression.target(p.target);
  const std::vector<Eigen::Index> columns = {0, 2};
  const std::vector<Bounds> free(2);
  const BlockRegression::Fit fit = regression.fit(target, columns, free);
  EXPECT_NEAR(regression.held_out(target, columns, free), fit.held_out, 1e-9 * fit.held_out);
  double held_out = 0;
  for (int fold = 0; fold < 4; ++fold) {
    std::vector<Eigen::Index> in;
    std::vector<Eigen::Index> out;
    for (std::size_t i = 0; i < p.block.size(); ++i)
      (p.block[i] % 4 == fold ? out : in).push_back(static_cast<Eigen::Index>(i));
    const Eigen::MatrixXd x = p.columns(in, columns);
    const Eigen::VectorXd beta = x.colPivHouseholderQr().solve(p.target(in));
    held_out += (p.target(out) - p.columns(out, columns) * beta).squaredNorm();
  }
  EXPECT_NEAR(fit.held_out, held_out, 1e-5 * held_out);
}

TEST(BlockRegression, CoefficientsStayWithinTheirBounds) {
  const Problem p = problem(0);
  const BlockRegression regression(p.columns, p.block, 4);
  const BlockRegression::Target target = regression.target(p.target);
  const std::vector<Eigen::Index> all = {0, 1, 2};
  const std::vector<Bounds> free(3);
  const BlockRegression::Fit fit = regression.fit(target, all, free);
  EXPECT_NEAR(fit.coefficients[0], 2, 1e-6);
  EXPECT_NEAR(fit.coefficients[1], -1, 1e-6);
  const std::vector<Bounds> bounded = {{}, {.lower = 0}, {.lower = 0, .upper = 0.2}};
  const BlockRegression::Fit held = regression.fit(target, all, bounded);
  EXPECT_EQ(held.coefficients[1], 0);
  EXPECT_EQ(held.coefficients[2], 0.2);
}

TEST(ChanceData, KeepsTheSizeAndForgetsTheOrder) {
  const Eigen::VectorXd residual = Eigen::VectorXd::LinSpaced(2000, -1, 1);
  ChanceData chance(residual, 1);
  double correlation = 0;
  double power = 0;
  constexpr int kDraws = 200;
  for (int i = 0; i < kDraws; ++i) {
    const Eigen::VectorXd drawn = chance.draw();
    correlation += drawn.dot(residual) / residual.squaredNorm() / kDraws;
    power += drawn.squaredNorm() / residual.squaredNorm() / kDraws;
  }
  EXPECT_NEAR(correlation, 0, 0.05);
  EXPECT_NEAR(power, 1, 0.1);
}

TEST(Ripple, IsFoundAtItsPeriodsPerTurnEvenBetweenWholeNumbers) {
  std::mt19937 random(1);
  std::normal_distribution<double> normal;
  Eigen::VectorXd position(4000);
  Eigen::VectorXd residual(4000);
  for (Eigen::Index i = 0; i < position.size(); ++i) {
    const double t = 0.02 * static_cast<double>(i);
    position[i] = 20 * std::sin(0.2 * t) + 0.5 * t;
    residual[i] = std::sin(25.838 * position[i] + 1) + normal(random);
  }
  EXPECT_NEAR(ripple_periods_per_rev(residual, position), 25.838, 0.05);
  EXPECT_EQ(ripple_periods_per_rev(residual, Eigen::VectorXd::Zero(4000)), 0);
}

TEST(Ripple, OfAWheelThatDroveAHundredKilometresIsFoundToAPartOfAPeriodOverAllOfIt) {
  constexpr double kPeriods = 26.00037;  // a number that the spectrum of one stretch cannot resolve
  const Eigen::VectorXd position = Eigen::VectorXd::LinSpaced(800'000, 0, 2e6);
  std::mt19937 random(1);
  std::normal_distribution<double> normal;
  const Eigen::VectorXd residual =
      position.unaryExpr([&](double at) { return std::sin(kPeriods * at + 1) + normal(random); });
  EXPECT_NEAR(ripple_periods_per_rev(residual, position), kPeriods, 2e-6)
      << "a period over the whole way is 3e-6";
}

Source commanded(double threshold_Nm, int delay_samples, bool lose_sign) {
  std::mt19937 random(5);
  std::normal_distribution<double> normal;
  Source source{.name = "bench.csv", .recording = {}};
  std::vector<double> time, command, measured, position;
  for (int i = 0; i < 20000; ++i) {
    time.push_back(1e-3 * i);
    command.push_back(0.1 * std::sin(2e-3 * i) + 0.05 * std::sin(11e-3 * i));
    const int then = std::max(0, i - delay_samples);
    double delivered = 0.1 * std::sin(2e-3 * then) + 0.05 * std::sin(11e-3 * then);
    if (std::abs(delivered) < threshold_Nm) delivered = std::copysign(threshold_Nm, delivered);
    delivered += 0.001 * normal(random);
    measured.push_back(lose_sign ? std::abs(delivered) : delivered);
    position.push_back(std::sin(2e-3 * i));
  }
  source.recording.columns = {{"time_s", time},
                              {"torque_command_Nm", command},
                              {"torque_measured_Nm", measured},
                              {"position_rad", position}};
  return source;
}

ActuatorFindings findings(const Source& source) {
  const model::effects::DriveModel base{.name = "bench"};
  const Band band = choose_band({source}, base);
  return actuator_channel(std::vector{make_signals(source, band)}, base, {});
}

TEST(ActuatorChannel, APerfectActuatorLacksNothing) {
  EXPECT_TRUE(findings(commanded(0, 0, false)).effects.empty());
}

TEST(ActuatorChannel, FindsThresholdAndDelay) {
  const ActuatorFindings threshold = findings(commanded(0.03, 0, false));
  ASSERT_EQ(threshold.effects.size(), 1U);
  EXPECT_EQ(model::effects::name_of(threshold.effects[0].effect), "torque_deadband");
  EXPECT_NEAR(threshold.effects[0].parameters.at(0).value, 0.03, 3e-4);
  const ActuatorFindings delay = findings(commanded(0, 12, false));
  ASSERT_EQ(delay.effects.size(), 1U);
  EXPECT_EQ(model::effects::name_of(delay.effects[0].effect), "transport_delay");
  EXPECT_NEAR(delay.effects[0].parameters.at(0).value, 0.011, 5e-4) << "from the row that answers on";
}

TEST(ActuatorChannel, PutsALostSignBack) {
  const std::vector<Source> logged = {commanded(0, 0, true)};
  const std::optional<LostSign> lost = lost_sign(logged, 1, {}, {});
  ASSERT_TRUE(lost && lost->found);
  EXPECT_LT(lost->found->p_value, 0.01);
  const auto measured = lost->sources[0].recording.column("torque_measured_Nm");
  const auto command = lost->sources[0].recording.column("torque_command_Nm");
  for (std::size_t i = 0; i < measured.size(); ++i) ASSERT_NEAR(measured[i], command[i], 0.01) << i;
  EXPECT_FALSE(lost_sign({commanded(0, 0, false)}, 1, {}, {}));
}

}  // namespace gap_parts_test
}  // namespace identification::gap
