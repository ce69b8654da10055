// Rows of torque command and measured torque: real delays, and delays of the recording only.
#include "identification/gap/actuator_channel.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <random>
#include <vector>

namespace actuator_channel_test {

using identification::gap::actuator_channel;
using identification::gap::is_of_late_sensor;
using identification::gap::Signals;

/// Three sines at 100 Hz, measured some rows later.
Signals rows_late(std::size_t rows) {
  std::mt19937_64 random(1);
  std::normal_distribution<double> noise(0, 1e-3);
  Signals s;
  s.raw_period_s = 1e-2;
  for (std::size_t i = 0; i < 3000; ++i) {
    const double t = 1e-2 * static_cast<double>(i);
    s.raw_command_Nm.push_back(0.1 * std::sin(2 * t) + 0.08 * std::sin(7.3 * t) + 0.05 * std::sin(16.1 * t));
    s.raw_measured_Nm.push_back(s.raw_command_Nm[i >= rows ? i - rows : 0] + noise(random));
  }
  return s;
}

TEST(GapActuatorChannel, ATorqueFromBeforeTheRowsCommandIsNoDelay) {
  for (const std::size_t rows : {0, 1}) {
    const auto findings = actuator_channel(std::vector{rows_late(rows)}, {}, {});
    EXPECT_TRUE(findings.effects.empty()) << rows;
    ASSERT_EQ(findings.left_Nm.size(), 1U);
    double square = 0;
    for (const double left : findings.left_Nm[0]) square += left * left;
    // Only noise is left, whatever its source.
    EXPECT_LT(std::sqrt(square / static_cast<double>(findings.left_Nm[0].size())), 1.1e-3) << rows;
  }
}

TEST(GapActuatorChannel, MoreThanARowIsADelay) {
  for (const std::size_t rows : {2, 5}) {
    const auto findings = actuator_channel(std::vector{rows_late(rows)}, {}, {});
    ASSERT_EQ(findings.effects.size(), 1U) << rows;
    EXPECT_EQ(model::effects::name_of(findings.effects[0].effect), "transport_delay");
    EXPECT_NEAR(model::effects::parameter_of(findings.effects[0].effect, "delay_s"),
                1e-2 * static_cast<double>(rows - 1), 2e-3)
        << "a row's torque answers the row before";
  }
}

Signals scaled(double gain, double offset_Nm, double limit_Nm) {
  Signals s = rows_late(0);
  std::mt19937_64 random(2);
  std::normal_distribution<double> noise(0, 1e-3);
  for (std::size_t i = 0; i < s.raw_command_Nm.size(); ++i)
    s.raw_measured_Nm[i] =
        gain * std::clamp(s.raw_command_Nm[i], -limit_Nm, limit_Nm) + offset_Nm + noise(random);
  return s;
}

double size_of(const identification::gap::FoundEffect& found, const char* parameter) {
  return model::effects::parameter_of(found.effect, parameter);
}

TEST(GapActuatorChannel, AGainAndAnOffsetAreBothFound) {
  const auto findings = actuator_channel(std::vector{scaled(1.3, -0.02, 1)}, {}, {});
  ASSERT_EQ(findings.effects.size(), 2U);
  EXPECT_NEAR(size_of(findings.effects[0], "gain"), 1.3, 0.002);
  EXPECT_NEAR(size_of(findings.effects[1], "torque_Nm"), -0.02, 1e-4);
  for (const auto& found : findings.effects) {
    EXPECT_LT(found.parameters.at(0).upper - found.parameters.at(0).lower, 0.01);
    EXPECT_GT(found.parameters.at(0).upper, found.parameters.at(0).lower);
  }
}

TEST(GapActuatorChannel, AGainThatTorqueConstantsAreNotKnownToHasNoNameAndIsNoNoise) {
  const auto findings = actuator_channel(std::vector{scaled(1.02, 0, 1)}, {}, {});
  EXPECT_TRUE(findings.effects.empty());
  double square = 0;
  for (const double left : findings.left_Nm.at(0)) square += left * left;
  EXPECT_LT(std::sqrt(square / static_cast<double>(findings.left_Nm[0].size())), 1.1e-3);
}

/// In steps of 2 mN·m, as a current in whole milliamperes, a motor's limit keeps its noise; a sensor at its
/// end reports one value.
TEST(GapActuatorChannel, ASensorAtItsEndIsNoLimitOfTheMotor) {
  for (const bool at_its_end : {false, true}) {
    Signals s = scaled(1, 0, at_its_end ? 1 : 0.12);
    for (double& measured : s.raw_measured_Nm) {
      measured = 2e-3 * std::round(measured / 2e-3);
      if (at_its_end) measured = std::clamp(measured, -0.12, 0.12);
    }
    EXPECT_EQ(actuator_channel(std::vector{s}, {}, {}).effects.size(), at_its_end ? 0U : 1U);
  }
}

/// A model's effects act in its order: a gain before the dead-band would change its threshold.
TEST(GapActuatorChannel, AGainActsBehindTheDeadBand) {
  Signals s = scaled(1.3, 0, 1);
  for (std::size_t i = 0; i < s.raw_command_Nm.size(); ++i)
    if (std::abs(s.raw_command_Nm[i]) < 0.04)
      s.raw_measured_Nm[i] = std::copysign(1.3 * 0.04, s.raw_command_Nm[i]);
  const auto findings = actuator_channel(std::vector{s}, {}, {});
  ASSERT_EQ(findings.effects.size(), 2U);
  EXPECT_NEAR(size_of(findings.effects[0], "threshold_Nm"), 0.04, 0.002);
  EXPECT_NEAR(size_of(findings.effects[1], "gain"), 1.3, 0.01);
}

/// Steps at 1 kHz, some rows late and through a first-order lag.
Signals lagging(double lag_s, std::size_t rows) {
  std::mt19937_64 random(3);
  std::normal_distribution<double> noise(0, 1e-3);
  std::uniform_real_distribution<double> level(-0.2, 0.2);
  Signals s;
  s.raw_period_s = 1e-3;
  double delivered_Nm = 0;
  for (std::size_t i = 0; i < 20000; ++i) {
    s.raw_command_Nm.push_back(i % 150 == 0 ? level(random) : s.raw_command_Nm.back());
    const double acting_Nm = i >= rows ? s.raw_command_Nm[i - rows] : 0.0;
    delivered_Nm += (acting_Nm - delivered_Nm) * (1 - std::exp(-1e-3 / lag_s));
    s.raw_measured_Nm.push_back(delivered_Nm + noise(random));
  }
  return s;
}

TEST(GapActuatorChannel, ALagIsNoDelayAndBothAreFound) {
  for (const double lag_s : {0.015, 0.05, 0.3})
    for (const std::size_t rows : {1U, 9U}) {
      SCOPED_TRACE(testing::Message() << lag_s << " s, " << rows << " rows");
      const auto findings = actuator_channel(std::vector{lagging(lag_s, rows)}, {}, {});
      ASSERT_EQ(findings.effects.size(), rows > 1 ? 2U : 1U);
      const auto& lag = findings.effects.back().parameters.at(0);
      EXPECT_EQ(model::effects::name_of(findings.effects.back().effect), "torque_lag");
      EXPECT_NEAR(lag.value, lag_s, 0.01 * lag_s + 0.5e-3);
      EXPECT_LT(lag.lower, lag_s);
      EXPECT_GT(lag.upper, lag_s);
      if (rows > 1) {
        EXPECT_EQ(model::effects::name_of(findings.effects[0].effect), "transport_delay");
        EXPECT_NEAR(size_of(findings.effects[0], "delay_s"), 8e-3, 1e-3);
      }
    }
}

TEST(GapActuatorChannel, ALagThatACurrentLoopOrASensorMayHaveHasNoName) {
  EXPECT_TRUE(actuator_channel(std::vector{lagging(0.006, 1)}, {}, {}).effects.empty());
}

TEST(GapActuatorChannel, ALagOrDelayIsTheSensorsIfTheMotionIsEarlier) {
  const auto findings = actuator_channel(std::vector{lagging(0.02, 1)}, {}, {});
  ASSERT_EQ(findings.effects.size(), 1U);
  // The motion shows up to 10 ms.
  EXPECT_TRUE(is_of_late_sensor(findings.effects[0], 0.01));
  EXPECT_FALSE(is_of_late_sensor(findings.effects[0], 0.002));
}

TEST(GapActuatorChannel, ALimitIsNoGain) {
  const auto findings = actuator_channel(std::vector{scaled(1, 0, 0.12)}, {}, {});
  ASSERT_EQ(findings.effects.size(), 1U);
  EXPECT_EQ(model::effects::name_of(findings.effects[0].effect), "torque_saturation");
  EXPECT_NEAR(size_of(findings.effects[0], "limit_Nm"), 0.12, 0.002);
}

}  // namespace actuator_channel_test
