// Recordings of an arm whose logger paused.
#include "identification/robot_gap/arm_motion.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <stdexcept>
#include <string>
#include <vector>

#include "control/arm_description.h"
#include "identification/robot_gap/arm_subject.h"
#include "identification/robot_gap/body_places.h"

namespace arm_motion_test {
namespace {

using identification::robot_gap::ArmMotion;
using identification::robot_gap::ArmRecording;
using identification::robot_gap::ArmSubject;
using identification::robot_gap::CutRecording;
using identification::robot_gap::Part;

constexpr double kBand_Hz = 10;

/// One joint that swings with 1 Hz and 1 rad, recorded at 1 kHz except during the pauses.
struct Pause {
  double from_s;
  double to_s;
};
ArmRecording swing(double seconds, const std::vector<Pause>& pauses) {
  ArmRecording recording{"swing.csv", {}, {}, {}};
  for (int i = 0; i <= 1000 * seconds; ++i) {
    const double t = 1e-3 * i;
    bool paused = false;
    for (const Pause& pause : pauses) paused = paused || (t > pause.from_s && t < pause.to_s);
    if (!paused) recording.time_s.push_back(t);
  }
  const auto rows = static_cast<Eigen::Index>(recording.time_s.size());
  recording.position_rad.resize(1, rows);
  for (Eigen::Index i = 0; i < rows; ++i)
    recording.position_rad(0, i) =
        std::sin(2 * std::numbers::pi * recording.time_s[static_cast<std::size_t>(i)]);
  recording.torque_Nm = 2 * recording.position_rad;
  return recording;
}

// A recorder that misses eight rows of a thousand has still more of them than a band of 10 Hz needs.
TEST(ArmPauses, OneWithinTheBandIsNoReasonToCut) {
  const ArmRecording late = swing(10, {{4.0, 4.009}});
  const auto parts = cut_at_pauses(late, kBand_Hz).parts;
  ASSERT_EQ(parts.size(), 1U);
  EXPECT_EQ(parts.front().name, "swing.csv");
  const ArmMotion motion = filtered(parts.front(), kBand_Hz);
  const double peak = 4 * std::numbers::pi * std::numbers::pi;
  // A straight line over 9 ms is off by at most 9 ms squared times an eighth of the acceleration, 0.4 mrad.
  for (Eigen::Index i = motion.acceleration_rad_per_s2.cols() / 5;
       i < motion.acceleration_rad_per_s2.cols() * 4 / 5; ++i) {
    const double t = motion.start_s + motion.period_s * static_cast<double>(i);
    EXPECT_NEAR(motion.acceleration_rad_per_s2(0, i), -peak * std::sin(2 * std::numbers::pi * t),
                0.05 * peak);
  }
}

TEST(ArmPauses, ALongOneMakesTwoRecordings) {
  const auto parts = cut_at_pauses(swing(10, {{4.0, 4.5}}), kBand_Hz).parts;
  ASSERT_EQ(parts.size(), 2U);
  EXPECT_EQ(parts[0].name, "swing.csv, from 0.000 s");
  EXPECT_EQ(parts[1].name, "swing.csv, from 4.500 s");
  EXPECT_DOUBLE_EQ(parts[0].time_s.back(), 4.0);
  EXPECT_DOUBLE_EQ(parts[1].time_s.front(), 4.5);
  EXPECT_EQ(parts[1].position_rad.cols(), 5501);
  EXPECT_NEAR(parts[1].torque_Nm(0, 250), 2 * std::sin(2 * std::numbers::pi * 4.75), 1e-12);
}

TEST(ArmPauses, PartsThatAreTooShortAreLeftOut) {
  const CutRecording cut = cut_at_pauses(swing(10, {{0.5, 1.0}}), kBand_Hz);
  ASSERT_EQ(cut.parts.size(), 1U);
  EXPECT_EQ(cut.parts.front().name, "swing.csv, from 1.000 s");
  ASSERT_EQ(cut.left_out.size(), 1U);
  EXPECT_DOUBLE_EQ(cut.left_out.front().from_s, 0);
  EXPECT_DOUBLE_EQ(cut.left_out.front().to_s, 0.5);
  try {
    cut_at_pauses(swing(4, {{1.0, 1.2}, {2.0, 2.2}, {3.0, 3.2}}), kBand_Hz);
    ADD_FAILURE() << "no part is long enough";
  } catch (const std::invalid_argument& error) {
    EXPECT_EQ(std::string(error.what()).find("swing.csv: after 1.000 s there is a pause of 0.2 s"), 0U)
        << error.what();
  }
}

control::ArmDescription pendulum() {
  return {
      .arm = control::read_serial_arm(
          R"(<robot name="one"><link name="base"/><link name="arm"><inertial><origin xyz="0.2 0 0"/>)"
          R"(<mass value="1"/><inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial>)"
          R"(</link><joint name="swing" type="continuous"><parent link="base"/><child link="arm"/>)"
          R"(<axis xyz="0 1 0"/></joint></robot>)",
          "base", "arm"),
      .drives = {{.joint = "swing"}}};
}

// A quarter of 5 s is less than the 2 s that a band of 10 Hz needs.
TEST(ArmSetAside, OnePartInFourIsHeldOutOfThoseTooShortToBeDivided) {
  const auto parts = cut_at_pauses(swing(32, {{20.0, 20.5}, {25.5, 26.0}}), kBand_Hz).parts;
  ASSERT_EQ(parts.size(), 3U);
  const ArmSubject subject(pendulum(), parts, {}, {.band_Hz = kBand_Hz});
  EXPECT_EQ(subject.motions(Part::kSearched),
            (std::vector<std::string>{"swing.csv, from 0.000 s", "swing.csv, from 20.500 s"}));
  EXPECT_EQ(subject.motions(Part::kHeldOut),
            (std::vector<std::string>{"swing.csv, from 0.000 s, last quarter", "swing.csv, from 26.000 s"}));
  try {
    const ArmSubject alone(pendulum(), {swing(7, {})}, {}, {.band_Hz = kBand_Hz});
    ADD_FAILURE() << "nothing is held out";
  } catch (const std::invalid_argument& error) {
    EXPECT_EQ(std::string(error.what()).find("swing.csv: is too short to set a quarter of it aside"), 0U)
        << error.what();
  }
}

TEST(ArmBodies, ACentreOfMassBeyondTheReachOfItsLinkIsReported) {
  control::ArmDescription given = pendulum();
  given.arm.X_LT.translation().x() = 0.4;
  control::ArmDescription changed = given;
  changed.arm.links[0].inertia.p_LC_m.x() = 0.5;
  changed.payload_kg = 0.1;
  changed.p_TP_m = {0, 0, 0.3};
  EXPECT_TRUE(identification::robot_gap::implausible_places(given, changed).empty());
  changed.arm.links[0].inertia.p_LC_m.x() = -0.7;
  changed.p_TP_m = {0, 0, 0.5};
  const std::vector<std::string> found = identification::robot_gap::implausible_places(given, changed);
  ASSERT_EQ(found.size(), 2U);
  EXPECT_EQ(found[0].find("arm would have its centre of mass 0.7 m from its joint swing"), 0U) << found[0];
  EXPECT_EQ(found[1].find("the payload would have its centre of mass 0.5 m from the tip"), 0U) << found[1];
}

}  // namespace
}  // namespace arm_motion_test
