// A few of the hidden arms; robot_gap_proof runs all.
#include "identification/robot_gap/robot_gap.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "identification/robot_gap/arm_experiment.h"
#include "identification/robot_gap/arm_motion.h"
#include "identification/robot_gap/arm_rows.h"
#include "tests/robot_gap/robot_cases.h"

namespace robot_gap_test {
namespace {

using identification::gap::Verdict;

RobotCase case_of(const std::string& name) {
  for (const RobotCase& one : robot_cases(1))
    if (one.name() == name) return one;
  ADD_FAILURE() << "no case is called " << name;
  return {};
}

std::string named(const Answer& answer) {
  std::string text;
  for (const auto& found : answer.result.effects) text += found.name.effect + " of " + found.name.part + "; ";
  return text + answer.result.reason;
}

TEST(RobotGap, AnArmWithoutAnEffectHasNoGap) {
  const Answer answered = answer(case_of("planar: nothing"));
  EXPECT_EQ(answered.result.verdict, Verdict::kNoGap) << named(answered);
  EXPECT_TRUE(answered.result.effects.empty()) << named(answered);
}

class RobotGapNames : public testing::TestWithParam<const char*> {};
TEST_P(RobotGapNames, TheHiddenEffectOnItsPart) {
  const Answer answered = answer(case_of(GetParam()));
  EXPECT_TRUE(answered.right) << named(answered);
  const auto& gap = answered.result.gaps.front().gap;
  EXPECT_LT(gap.after, 1.25 * gap.noise_floor);
}
INSTANTIATE_TEST_SUITE_P(Arms, RobotGapNames,
                         testing::Values("planar: payload", "planar: link_mass 2", "planar: coulomb 2",
                                         "planar: torque_constant 2", "planar: load_friction 2",
                                         "elbow: gravity_direction", "elbow: spring 2",
                                         "planar: torque_constant 2 + viscous 1"));

TEST(RobotGap, NamesAnElasticGearAndItsCompliance) {
  const RobotCase asked = case_of("planar: elasticity 2");
  const Answer answered = answer(asked);
  EXPECT_TRUE(answered.right) << named(answered);
  const double true_rad_per_Nm = 1 / asked.hidden.front().size;
  EXPECT_NEAR(answered.arm.drives[1].compliance_rad_per_Nm, true_rad_per_Nm, 0.05 * true_rad_per_Nm);
}

TEST(RobotGap, ATiltInThePlaneOfAnArmIsARivalOfItsFirstEncodersZero) {
  const Answer answered = answer(case_of("planar: gravity_direction"));
  EXPECT_EQ(answered.result.verdict, Verdict::kAmbiguous);
  EXPECT_TRUE(answered.among_rivals) << named(answered);
}

class RobotGapAbstains : public testing::TestWithParam<const char*> {};
TEST_P(RobotGapAbstains, FromWhatIsNotInTheLibrary) {
  const Answer answered = answer(case_of(GetParam()));
  EXPECT_TRUE(answered.result.effects.empty()) << named(answered);
  EXPECT_EQ(answered.result.verdict, Verdict::kUnexplained);
  const auto& gap = answered.result.gaps.front().gap;
  EXPECT_EQ(gap.after, gap.before);
}
INSTANTIATE_TEST_SUITE_P(Arms, RobotGapAbstains,
                         testing::Values("planar: pulse 2", "planar: warming_friction 2"));

// What a maker's URDF says of an arm: nothing of friction. Four joints lack eight effects, and the hand
// carries something. What is found on one joint is not refuted by what the fit of the others then does
// elsewhere.
TEST(RobotGap, AModelWithoutFrictionGetsThatOfEveryJointAndThePayload) {
  const ArmDesign design = elbow_arm();
  const double payload_kg = 0.1 * design.bodies.back().mass_kg;
  HiddenArm arm(design, {{"payload", -1, payload_kg}});
  control::ArmDescription frictionless = published(design, arm.friction());
  for (control::ArmDrive& drive : frictionless.drives) drive.coulomb_Nm = drive.viscous_Nm_s_per_rad = 0;
  std::vector<identification::robot_gap::ArmRecording> data;
  std::vector<identification::robot_gap::ArmRecording> held_out;
  data.push_back(as_recorded(arm.record({.seconds = 30, .tempo = 1, .seed = 5, .rate_Hz = 200}, "one")));
  held_out.push_back(
      as_recorded(arm.record({.seconds = 20, .tempo = 0.8, .seed = 6, .rate_Hz = 200}, "other")));
  const identification::robot_gap::ArmSubject subject(frictionless, std::move(data), std::move(held_out),
                                                      {.band_Hz = 5});
  const auto found = identification::robot_gap::analyse(subject, {});
  const control::ArmDescription mended = subject.changed(found.changes);
  for (std::size_t j = 0; j < mended.drives.size(); ++j) {
    const Friction& truth = arm.friction()[j];
    EXPECT_NEAR(mended.drives[j].coulomb_Nm, truth.coulomb_Nm, 0.1 * truth.coulomb_Nm) << j;
    EXPECT_NEAR(mended.drives[j].viscous_Nm_s_per_rad, truth.viscous_Nm_s_per_rad,
                0.1 * truth.viscous_Nm_s_per_rad)
        << j;
  }
  EXPECT_TRUE(
      std::ranges::any_of(found.effects, [](const auto& one) { return one.name.effect == "payload"; }));
  const auto& gap = found.gaps.front().gap;
  EXPECT_LT(gap.after, 1.25 * gap.noise_floor) << found.reason;
}

// A right gap for a wrong reason: without the effect, on the arm and in the model, the model must fit again.
TEST(RobotGap, WithoutTheNamedEffectOnArmAndModelTheGapIsClosedToo) {
  const RobotCase asked = case_of("planar: torque_constant 2 + viscous 1");
  const Answer answered = answer(asked);
  ASSERT_TRUE(answered.right) << named(answered);
  control::ArmDescription edited = answered.arm;
  edited.drives[1].torque_scale = 1;
  HiddenArm arm(planar_arm(), {asked.hidden[1]});
  std::vector<identification::robot_gap::ArmRecording> recordings;
  recordings.push_back(as_recorded(arm.record({.seconds = 40, .tempo = 1, .seed = 77}, "edited")));
  const identification::robot_gap::ArmSubject subject(edited, std::move(recordings), {}, {});
  const auto judged = identification::robot_gap::analyse(subject, {});
  EXPECT_EQ(judged.verdict, Verdict::kNoGap) << judged.reason;
}

/// Its speed is noise of the encoder; friction at rest is any torque up to breakaway.
TEST(RobotGap, AJointThatOnlyItsEncoderMovesIsNotJudged) {
  using identification::robot_gap::ArmMotion;
  using identification::robot_gap::ArmRecording;
  using identification::robot_gap::RowPlan;
  for (const double noise_rad : {0.0, 1e-5, 1e-3}) {
    ArmRecording recording{.name = "one moves", .time_s = {}, .position_rad = {}, .torque_Nm = {}};
    recording.position_rad.resize(2, 8000);
    recording.torque_Nm = Eigen::MatrixXd::Zero(2, 8000);
    std::mt19937_64 random(3);
    std::normal_distribution<double> noise;
    for (Eigen::Index i = 0; i < 8000; ++i) {
      const double t = 1e-3 * static_cast<double>(i);
      recording.time_s.push_back(t);
      recording.position_rad.col(i) << std::sin(2 * t) + noise_rad * noise(random),
          0.3 + noise_rad * noise(random);
    }
    constexpr double kBand_Hz = 10;
    const std::vector<ArmRecording> recordings{recording};
    const std::vector<ArmMotion> motions{filtered(recording, kBand_Hz)};
    const RowPlan plan = plan_rows(motions, rest_speeds_rad_per_s(motions, recordings, kBand_Hz), 1);
    EXPECT_TRUE(std::ranges::any_of(plan.rows, [](const RowPlan::Row& row) { return row.channel == 0; }));
    EXPECT_TRUE(std::ranges::none_of(plan.rows, [](const RowPlan::Row& row) { return row.channel == 1; }))
        << noise_rad;
  }
}

TEST(RobotGap, AJointThatNeverMovesDecidesNothing) {
  using identification::robot_gap::ArmMotion;
  HiddenArm hidden(planar_arm(), {});
  const control::ArmDescription one = published(planar_arm(), hidden.friction());
  control::ArmDescription other = one;
  other.drives[0].coulomb_Nm += 1;
  ArmMotion motion;
  motion.period_s = 0.01;
  motion.position_rad = Eigen::MatrixXd::Zero(2, 100);
  motion.position_rad.row(0).setLinSpaced(-1, 1);
  motion.velocity_rad_per_s = Eigen::MatrixXd::Zero(2, 100);
  motion.velocity_rad_per_s.row(0).setOnes();
  motion.acceleration_rad_per_s2 = Eigen::MatrixXd::Zero(2, 100);
  const std::vector<ArmMotion> motions{motion};
  const std::string text =
      identification::robot_gap::deciding_pose(one, other, motions, Eigen::Vector2d::Constant(0.1), 1);
  EXPECT_EQ(text.rfind("move joint1 between", 0), 0U) << text;
}

TEST(RobotGap, RecordingsThatAreTooShortAreRefusedByName) {
  HiddenArm arm(planar_arm(), {});
  std::vector<identification::robot_gap::ArmRecording> recordings;
  recordings.push_back(as_recorded(arm.record({.seconds = 1}, "short.csv")));
  try {
    const identification::robot_gap::ArmSubject subject(published(planar_arm(), arm.friction()),
                                                        std::move(recordings), {}, {});
    FAIL() << "accepted";
  } catch (const std::invalid_argument& error) {
    EXPECT_NE(std::string(error.what()).find("short.csv"), std::string::npos) << error.what();
  }
}

}  // namespace
}  // namespace robot_gap_test
