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

}  // namespace actuator_channel_test
