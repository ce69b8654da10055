// A drive whose actuator follows its commands slowly, and whose model follows them at once.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <string>

#include "identification/gap/gap.h"
#include "model/effects/any_effect.h"
#include "tests/gap/gap_cases.h"

namespace gap_test {
namespace torque_lag_test {

constexpr double kLength = 0.4;

using identification::gap::Result;

enum class Recorded : std::uint8_t { kBoth, kCommand };

Case drive_of(std::uint64_t seed) { return make_case({CaseKind::kNone, {}, 0, seed}, kLength); }

/// The case's motions again, with what has changed in its drive.
Result analysed(Case hidden, Recorded recorded) {
  hidden.data = recordings_of(hidden.drive, hidden.runs);
  hidden.held_out = recordings_of(hidden.drive, hidden.held_out_runs, "held_out_");
  if (recorded == Recorded::kCommand)
    for (auto* sources : {&hidden.data, &hidden.held_out})
      for (identification::gap::Source& source : *sources)
        std::erase_if(source.recording.columns,
                      [](const auto& column) { return column.name == "torque_measured_Nm"; });
  return identification::gap::analyse(hidden.base, hidden.data, hidden.held_out);
}

std::string named(const Result& result) {
  std::string names;
  for (const auto& found : result.effects)
    names += (names.empty() ? "" : " ") + std::string(model::effects::name_of(found.effect));
  return names;
}

class SlowActuator : public testing::TestWithParam<Recorded> {};

TEST_P(SlowActuator, IsNamedWithItsTimeConstant) {
  for (const double lag_s : {0.02, 0.06}) {
    Case hidden = drive_of(static_cast<std::uint64_t>(1e3 * lag_s));
    hidden.drive.effects.command_lag_s = lag_s;
    const Result result = analysed(hidden, GetParam());
    ASSERT_EQ(named(result), "torque_lag") << lag_s;
    const auto& lag = result.effects.front().parameters.at(0);
    EXPECT_EQ(lag.name, "time_constant_s");
    if (GetParam() == Recorded::kCommand) {
      EXPECT_NEAR(lag.value, lag_s, 0.005 * lag_s);
      EXPECT_LT(lag.lower, lag_s + 1e-4);
      EXPECT_GT(lag.upper, lag_s - 1e-4);
    } else {
      // The sensor, the current loop with its back-EMF, and half a period before a sample add to it.
      EXPECT_NEAR(lag.value, lag_s, 0.05 * lag_s + 2e-3);
    }
  }
}

TEST_P(SlowActuator, IsNotTakenForADelayAndADelayNotForIt) {
  Case hidden = drive_of(7);
  hidden.drive.effects.delay_s = 0.008;
  EXPECT_EQ(named(analysed(hidden, GetParam())), "transport_delay");
}

INSTANTIATE_TEST_SUITE_P(Of, SlowActuator, testing::Values(Recorded::kBoth, Recorded::kCommand),
                         [](const auto& instance) {
                           return instance.param == Recorded::kBoth ? "BothTorques" : "TheCommand";
                         });

// The motion follows the command at once.
TEST(SlowTorqueSensor, HasNoNameInTheDrive) {
  for (const double lag_s : {0.02, 0.05}) {
    Case hidden = drive_of(11);
    hidden.drive.sensors.torque_lag_s = lag_s;
    const Result result = analysed(hidden, Recorded::kBoth);
    EXPECT_EQ(named(result), "") << lag_s;
  }
}

}  // namespace torque_lag_test
}  // namespace gap_test
