// Measures of a teleoperation (thesis 3.2.3.2) and the human limits (3.2.3.4).
#include "operation/teleop_measures.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstddef>
#include <functional>
#include <numbers>
#include <string>
#include <utility>

#include "operation/teleop_measures_page.h"

namespace teleop_measures_test {

using operation::TeleopMeasures;
using operation::TeleopRecord;

TeleopRecord operating(double force_N = 0) {
  TeleopRecord record;
  record.phase = control::TeleopPhase::kOperating;
  record.held_force_H_N = {force_N, 0, 0};
  record.force_scale = 10;
  record.motion_scale = 1;
  return record;
}

// 2 N for one second: ∫ F² dt = 4 N²·s, whatever else the run has.
TEST(TeleopMeasures, SumForcesOverTheTimeInWhichTheHandMovesTheRobot) {
  TeleopMeasures measures({});
  TeleopRecord before = operating(7);
  before.phase = control::TeleopPhase::kStiffening;
  for (int n = 0; n < 500; ++n) measures.add(before);
  for (int n = 0; n < 1000; ++n) {
    TeleopRecord record = operating(2);
    record.wrench_W = {0, 3, 4, 0, 0, 0};
    record.contact_force_W_N = {0, 0, n == 500 ? -9.0 : 0.0};
    measures.add(record);
  }
  EXPECT_NEAR(measures.operating_s(), 1, 1e-9);
  EXPECT_NEAR(measures.hand().force_squared_N2_s, 4, 1e-9);
  EXPECT_NEAR(measures.rms_N(measures.hand()), 2, 1e-9);
  EXPECT_NEAR(measures.robot().force_squared_N2_s, 25, 1e-9);
  EXPECT_EQ(measures.hand().largest_force_N, 2);
  EXPECT_EQ(measures.robot().largest_force_N, 5);
  EXPECT_EQ(measures.largest_contact_N(), 9);
}

TEST(TeleopMeasures, TakeTheRangesOfHandleAndEndEffector) {
  TeleopMeasures measures({});
  for (const double x_m : {0.01, -0.03, 0.02}) {
    TeleopRecord record = operating();
    record.grip_p_HD_m = {x_m, 0, 0};
    record.tip_p_WT_m = {1 - 10 * x_m, 0, 0};
    measures.add(record);
  }
  EXPECT_NEAR(measures.hand().p_m[0].length(), 0.05, 1e-12);
  EXPECT_NEAR(measures.robot().p_m[0].length(), 0.5, 1e-12);
  EXPECT_EQ(measures.hand().p_m[1].length(), 0);
}

TEST(TeleopMeasures, CountForcesThatStepByMoreThanAHandFeels) {
  TeleopMeasures measures({});
  for (const double force_N : {1.0, 1.06, 1.0, 1.2, 1.2, 0.1, 0.2}) measures.add(operating(force_N));
  // Above 0.36 N are five, of which one steps by more than 7 % of itself: to 1.2.
  EXPECT_NEAR(measures.rough_share(), 0.2, 1e-12);
  EXPECT_NEAR(measures.largest_force_step_N(), 1.1, 1e-12);
}

// 28 dB over 1 µm are 25.1 µm; each octave from 30 Hz on is 12 dB less, a quarter.
TEST(TeleopMeasures, TheVibrationThresholdIsThatOfTheThesis) {
  EXPECT_NEAR(operation::human::smallest_felt_vibration_m(5), 25.1e-6, 0.05e-6);
  EXPECT_NEAR(
      operation::human::smallest_felt_vibration_m(60) / operation::human::smallest_felt_vibration_m(30),
      0.251, 0.001);
  EXPECT_EQ(operation::human::smallest_felt_vibration_m(300),
            operation::human::smallest_felt_vibration_m(900));
}

/// The amplitude in each band of a handle that moves as `x_m(t)` says.
std::array<double, 3> vibration_m(const std::function<double(double)>& x_m) {
  TeleopMeasures measures({});
  for (int n = 0; n < 20'000; ++n) {
    TeleopRecord record = operating();
    record.grip_p_HD_m = {x_m(n * 1e-3), 0, 0};
    measures.add(record);
  }
  std::array<double, 3> amplitude_m{};
  for (std::size_t i = 0; i < 3; ++i) amplitude_m[i] = measures.bands()[i].amplitude_m();
  return amplitude_m;
}

TEST(TeleopMeasures, AVibrationIsSeenInItsBandAndAHandsMotionInNone) {
  constexpr double kTurn = 2 * std::numbers::pi;
  const auto shaken = vibration_m([](double t) { return 20e-6 * std::sin(kTurn * 84.9 * t); });
  EXPECT_NEAR(shaken[1], 20e-6, 1e-6);
  EXPECT_LT(shaken[0], 20e-6 / 3) << "an octave off";
  EXPECT_LT(shaken[2], 20e-6 / 3);
  // 5 cm at 1 Hz, two thousand times the threshold.
  const auto moved = vibration_m([](double t) { return 0.05 * (1 - std::cos(kTurn * t)); });
  for (std::size_t i = 0; i < 3; ++i)
    EXPECT_LT(moved[i], operation::human::smallest_felt_vibration_m(TeleopMeasures::kBands_Hz[i])) << i;
}

// 5 cm at 1 Hz, at each period that a configuration allows: what is too fast for it is not measured.
TEST(TeleopMeasures, ASlowLoopMeasuresTheVibrationsThatItCan) {
  for (const auto& [period_s, measured] : {std::pair(0.002, 3), std::pair(0.004, 2), std::pair(0.01, 0)}) {
    control::Teleoperation::Config config;
    config.period_s = period_s;
    TeleopMeasures measures(config);
    for (int n = 0; n < 20'000; ++n) {
      TeleopRecord record = operating();
      record.grip_p_HD_m = {0.05 * (1 - std::cos(2 * std::numbers::pi * n * period_s)), 0, 0};
      measures.add(record);
    }
    for (int i = 0; i < 3; ++i) {
      const double amplitude_m = measures.bands()[static_cast<std::size_t>(i)].amplitude_m();
      if (i < measured)
        EXPECT_LT(amplitude_m, 1e-4) << period_s << ", " << i;
      else
        EXPECT_TRUE(std::isnan(amplitude_m)) << period_s << ", " << i;
    }
  }
}

// The handle goes back under the clutch, three times: it moved 5 cm with the robot each time.
TEST(TeleopMeasures, LeaveOutTheWayBackUnderTheClutch) {
  TeleopMeasures measures({});
  for (int stroke = 0; stroke < 3; ++stroke)
    for (const bool clutched : {false, true}) {
      TeleopRecord record = operating(clutched ? 5 : 1);
      record.clutched = clutched;
      record.grip_p_HD_m = {clutched ? -0.2 : 0.05, 0, 0};
      measures.add(record);
    }
  EXPECT_EQ(measures.hand().p_m[0].lowest, 0.05);
  EXPECT_EQ(measures.hand().largest_force_N, 1);
  EXPECT_NEAR(measures.operating_s(), 0.003, 1e-12);
}

// 700 N/m over a force scale that the operator turns from 10 to 5 feel like 70 and 140 N/m.
TEST(TeleopMeasures, FollowTheScalesThatAreTuned) {
  TeleopMeasures measures({});
  TeleopRecord record = operating(1);
  record.stiffness_N_per_m = 700;
  measures.add(record);
  EXPECT_NEAR(measures.largest_felt_stiffness_N_per_m(), 70, 1e-12);
  record.force_scale = 5;
  measures.add(record);
  EXPECT_NEAR(measures.largest_felt_stiffness_N_per_m(), 140, 1e-12);
  report::Page page("tuned");
  operation::add_measures(page, measures, {});
  EXPECT_NE(page.html().find("scale 5 to 10"), std::string::npos);
  EXPECT_NE(page.html().find("Position control alone gives 1;"), std::string::npos);
}

TEST(TeleopMeasures, ThePageHasEachOfThem) {
  TeleopMeasures measures({});
  for (int n = 0; n < 100; ++n) {
    TeleopRecord record = operating(1);
    record.stiffness_N_per_m = 700;
    record.grip_p_HD_m = {0.0001 * n, 0, 0};
    measures.add(record);
  }
  report::Page page("measures");
  operation::add_measures(page, measures, {});
  const std::string html = page.html();
  for (const char* const part :
       {"completion time", "peak force, hand", "sum of squared forces, hand", "Match of the workspaces",
        "hard objects: 242 N/cm", "0.7 N/cm", "not met", "smooth force", "vibration around 42 Hz"})
    EXPECT_NE(html.find(part), std::string::npos) << part;

  TeleopMeasures without_force({});
  without_force.add(operating());
  report::Page free("no force");
  operation::add_measures(free, without_force, {});
  EXPECT_NE(free.html().find("Peak force of the robot over that of the hand: –"), std::string::npos);

  report::Page nothing("nothing moved");
  operation::add_measures(nothing, TeleopMeasures({}), {});
  EXPECT_EQ(nothing.html().find("completion time"), std::string::npos);
}

}  // namespace teleop_measures_test
