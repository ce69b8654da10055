// A slice of sensor_campaign: a sensor frozen in motion is detected in time, and fault-free sensors end no
// run.
#include <gtest/gtest.h>

#include <cstddef>
#include <cstdint>
#include <set>
#include <string>
#include <vector>

#include "tests/sensor_campaign/detection.h"
#include "tests/sensor_campaign/soak.h"

namespace sensor_campaign_test {

using sensor_campaign::Detection;
using sensor_campaign::DetectionCase;
using sensor_campaign::Motion;

/// The safety issue's bound. A joint that moves: in the approach these of the arm.
TEST(SensorCampaign, EveryFrozenSensorInMotionIsSeenIn60MillisecondsAnd10Centimetres) {
  constexpr double kLongest_s = 0.060;
  constexpr std::size_t kFirstMoving = sensor_campaign::kWheels + 1;
  constexpr std::size_t kLastMoving = sensor_campaign::kWheels + 3;
  std::vector<DetectionCase> cases = detection_cases(sensor_campaign::factors());
  std::erase_if(cases, [](const DetectionCase& row) {
    const std::string& fault = row.fault.name;
    const bool wheel = row.motion == Motion::kDriving;
    const bool arm = row.motion == Motion::kApproach && row.joint >= kFirstMoving && row.joint <= kLastMoving;
    return !(wheel || arm) ||
           (fault != "encoder frozen" && fault != "position frozen" && fault != "board frozen");
  });
  ASSERT_EQ(cases.size(), 3 * (sensor_campaign::kWheels + 3));
  const std::vector<Detection> results = sensor_campaign::detect(cases, {.seed = 1});
  for (std::size_t i = 0; i < cases.size(); ++i) {
    SCOPED_TRACE(cases[i].fault.name + ", " + sensor_campaign::joint_name(cases[i].joint));
    EXPECT_EQ(results[i].seen, results[i].runs);
    EXPECT_EQ(results[i].named, results[i].runs);
    EXPECT_LE(results[i].longest_s, kLongest_s);
    EXPECT_LT(results[i].travel.share(), 1.0)
        << results[i].travel.m << " m, " << results[i].travel.rad << " rad";
  }
}

/// Faults that no factor describes: whether they are detected or not, the robot stays near its way.
TEST(SensorCampaign, NoSensorThatLiesLetsTheRobotGoAstray) {
  const std::set<std::string> kFaults{"encoder drifts slowly", "encoder pauses",      "encoder fades to 0.7",
                                      "encoder slips often",   "bit 13 flips once",   "bit 31 flips once",
                                      "position INT_MIN",      "velocity INT_MIN",    "torque INT_MIN",
                                      "velocity 50 ms late",   "encoder slips slowly"};
  constexpr std::size_t kWheel = 2;
  constexpr std::size_t kArmJoint = sensor_campaign::kWheels + 2;
  std::vector<DetectionCase> cases = detection_cases(sensor_campaign::other_faults());
  std::erase_if(cases, [&](const DetectionCase& row) {
    const bool wheel = row.joint == kWheel && row.motion == Motion::kDriving;
    const bool arm = row.joint == kArmJoint && row.motion == Motion::kLed;
    return !(wheel || arm) || !kFaults.contains(row.fault.name);
  });
  ASSERT_EQ(cases.size(), 2 * kFaults.size());
  const std::vector<Detection> results = sensor_campaign::detect(cases, {.seed = 1});
  for (std::size_t i = 0; i < cases.size(); ++i) {
    SCOPED_TRACE(cases[i].fault.name + ", " + sensor_campaign::joint_name(cases[i].joint));
    EXPECT_EQ(results[i].beyond, 0) << results[i].astray.m << " m, " << results[i].astray.rad << " rad";
    EXPECT_EQ(results[i].misnamed, 0);
    if (cases[i].fault.name.starts_with("encoder slips") || cases[i].fault.name == "position INT_MIN") {
      EXPECT_EQ(results[i].seen + results[i].ended, results[i].runs);
    }
  }
}

TEST(SensorCampaign, TrueSensorsEndNoRun) {
  constexpr double kHours = 0.1;
  double hours = 0.0;
  for (const sensor_campaign::SoakResult& scenario : sensor_campaign::soak(kHours, 1)) {
    EXPECT_EQ(scenario.alarms, std::vector<std::string>{}) << scenario.scenario;
    EXPECT_GT(scenario.runs, 0) << scenario.scenario;
    hours += scenario.hours;
  }
  EXPECT_GT(hours, 0.9 * kHours);
}

/// Overspeed is judged by the clock, and may end a run there.
TEST(SensorCampaign, TrueSensorsAreBelievedWhereABusyMachineHoldsUpTheBus) {
  int runs = 0;
  for (const sensor_campaign::SoakResult& scenario : sensor_campaign::soak(0.1, 3, {}, /*busy=*/true)) {
    EXPECT_EQ(scenario.alarms, std::vector<std::string>{}) << scenario.scenario;
    runs += scenario.runs;
  }
  EXPECT_GT(runs, 15);
}

/// Whatever the number of threads.
TEST(SensorCampaign, EqualSeedsGiveEqualRuns) {
  const auto hours = [](std::uint32_t seed) {
    return sensor_campaign::soak(0.01, seed, "black ice").front().hours;
  };
  EXPECT_EQ(hours(7), hours(7));
  EXPECT_NE(hours(7), hours(8));
}

}  // namespace sensor_campaign_test
