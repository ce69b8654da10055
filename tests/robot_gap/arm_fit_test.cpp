// Links, rotors and friction of arms that DART simulates, fitted together.
#include "identification/robot_gap/arm_fit.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <string>
#include <vector>

#include "identification/robot_gap/base_parameters.h"
#include "tests/robot_gap/hidden_arm.h"
#include "tests/robot_gap/robot_cases.h"

namespace robot_gap_test {
namespace {

using control::ArmDescription;
using identification::robot_gap::ArmFit;
using identification::robot_gap::ArmRecording;
using identification::robot_gap::BaseParameters;
using identification::robot_gap::fit_arm;
using identification::robot_gap::FittedNumber;

constexpr double kFitBand_Hz = 10;

ArmDescription elbow(HiddenArm& arm) {
  ArmDescription given = published(elbow_arm(), arm.friction());
  given.gravity_B_m_per_s2 = {0, 0, -9.81};  // DART's
  return given;
}

/// Masses, centres and friction that the publication does not have.
struct Hidden {
  std::vector<HiddenEffect> effects;
  ArmDescription truth;
};
Hidden hidden_elbow() {
  Hidden hidden{{{"link_mass", 1, 0.2},
                 {"link_mass", 3, -0.15},
                 {"link_centre", 2, 0.025},
                 {"coulomb", 0, 0.5},
                 {"coulomb", 2, 0.15},
                 {"viscous", 1, 0.4},
                 {"torque_offset", 2, 0.3}},
                {}};
  HiddenArm arm(elbow_arm(), hidden.effects);
  hidden.truth = elbow(arm);
  for (const HiddenEffect& one : hidden.effects) {
    const auto part = static_cast<std::size_t>(one.part);
    control::LinkInertia& body = hidden.truth.arm.links[part].inertia;
    control::ArmDrive& drive = hidden.truth.drives[part];
    if (one.effect == "link_mass") {
      body.mass_kg *= 1 + one.size;
      body.about_C_kg_m2 *= 1 + one.size;
    }
    if (one.effect == "link_centre") body.p_LC_m += one.size * Eigen::Vector3d(0.3, 0.2, 0.93);
    if (one.effect == "coulomb") drive.coulomb_Nm += one.size;
    if (one.effect == "viscous") drive.viscous_Nm_s_per_rad += one.size;
    if (one.effect == "torque_offset") drive.offset_Nm += one.size;
  }
  return hidden;
}

ArmRecording recorded(HiddenArm& arm, std::uint64_t seed) {
  return as_recorded(arm.record({.seconds = 20, .seed = seed}, "motion-" + std::to_string(seed)));
}

int within(const std::vector<FittedNumber>& numbers, const std::vector<double>& truth, double times = 1) {
  int count = 0;
  for (std::size_t k = 0; k < numbers.size(); ++k)
    if (std::abs(numbers[k].value - truth[k]) <= times * numbers[k].half_interval) ++count;
  return count;
}

TEST(BaseParameters, OfAPendulumAreItsMomentsAndItsInertia) {
  // A vertical swing shows the first moments across the axis and the inertia about it, nothing else.
  ArmDescription planar = published(planar_arm(), {{}, {}});
  planar.arm.links.resize(1);
  planar.drives.resize(1);
  const BaseParameters base(planar);
  EXPECT_EQ(base.count(), 3);
  // Of the elbow arm, whose last joint turns about an axis across those before it: 8 for a joint after
  // a perpendicular one, fewer for the vertical first and the parallel third.
  ArmDescription elbow = published(elbow_arm(), std::vector<Friction>(4));
  const BaseParameters of_elbow(elbow);
  // Parameters that act on nothing leave every base parameter as it is.
  const Eigen::VectorXd before = of_elbow.of(elbow);
  elbow.arm.links.front().inertia.mass_kg += 1;  // at the centre of mass: on a vertical axis
  elbow.arm.links.front().inertia.p_LC_m *=
      (elbow.arm.links.front().inertia.mass_kg - 1) / elbow.arm.links.front().inertia.mass_kg;
  const Eigen::VectorXd after = of_elbow.of(elbow);
  Eigen::Index changed = 0;
  for (Eigen::Index k = 0; k < before.size(); ++k)
    if (std::abs(after[k] - before[k]) > 1e-9) ++changed;
  EXPECT_LE(changed, 1);  // the inertia about the vertical axis alone
}

TEST(ArmFit, TheTruthIsWithinItsIntervals) {
  const Hidden hidden = hidden_elbow();
  HiddenArm arm(elbow_arm(), hidden.effects);
  const ArmDescription given = elbow(arm);
  const std::vector<ArmRecording> data{recorded(arm, 1), recorded(arm, 2), recorded(arm, 3)};
  const ArmFit fit = fit_arm(given, data, std::array{recorded(arm, 4)}, kFitBand_Hz);
  const Eigen::VectorXd base = BaseParameters(given).of(hidden.truth);
  const std::vector<double> base_truth(base.begin(), base.end());
  std::vector<double> drive_truth;
  for (const control::ArmDrive& drive : hidden.truth.drives)
    for (const double one : {drive.coulomb_Nm, drive.viscous_Nm_s_per_rad, drive.offset_Nm})
      drive_truth.push_back(one);
  ASSERT_EQ(fit.drives.size(), drive_truth.size());
  ASSERT_EQ(fit.base.size(), base_truth.size());
  const int base_within = within(fit.base, base_truth);
  RecordProperty("base_within", base_within);
  EXPECT_GE(base_within, 0.8 * static_cast<double>(fit.base.size()));
  const auto shown = [](const FittedNumber& one) {
    return one.name + " " + std::to_string(one.given) + " -> " + std::to_string(one.value) + " ± " +
           std::to_string(one.half_interval);
  };
  for (std::size_t k = 0; k < fit.base.size(); ++k)
    EXPECT_LE(std::abs(fit.base[k].value - base_truth[k]), 3 * fit.base[k].half_interval)
        << shown(fit.base[k]) << ", in truth " << base_truth[k];
  for (std::size_t k = 0; k < fit.drives.size(); ++k) {
    if (fit.drives[k].half_interval == 0) continue;
    EXPECT_LE(std::abs(fit.drives[k].value - drive_truth[k]), 2 * fit.drives[k].half_interval)
        << shown(fit.drives[k]) << ", in truth " << drive_truth[k];
  }
  // Offsets: three that are not there, and one that is.
  for (const std::size_t joint : {0U, 1U, 3U}) EXPECT_EQ(fit.arm.drives[joint].offset_Nm, 0);
  EXPECT_NE(fit.arm.drives[2].offset_Nm, 0);
  // A held-out motion is predicted as well as the sensors allow.
  for (const auto& joint : fit.held_out.joints)
    EXPECT_LT(joint.fitted, 1.15 * joint.noise_floor) << joint.joint;
  EXPECT_LT(fit.held_out.fitted_Nm, 0.3 * fit.held_out.given_Nm);
}

TEST(ArmFit, OneMovingJointLeavesTheOthersAsGiven) {
  HiddenArm arm(elbow_arm(), hidden_elbow().effects);
  ArmDescription given = elbow(arm);
  given.drives[3].offset_Nm = 0.05;
  // Joint 2 alone swings; what the others need to hold still is not compared.
  ArmRecording recording = recorded(arm, 1);
  for (const Eigen::Index j : {0, 2, 3}) recording.position_rad.row(j).setZero();
  const double gravity_Nm = 9.81 * 1.4;
  recording.torque_Nm.row(1) = gravity_Nm * recording.position_rad.row(1).array().sin();
  const ArmFit fit = fit_arm(given, std::array{recording}, {}, kFitBand_Hz);
  for (const std::size_t j : {0U, 2U, 3U}) {
    EXPECT_EQ(fit.arm.drives[j].coulomb_Nm, given.drives[j].coulomb_Nm);
    EXPECT_EQ(fit.arm.drives[j].viscous_Nm_s_per_rad, given.drives[j].viscous_Nm_s_per_rad);
    EXPECT_EQ(fit.arm.drives[j].offset_Nm, given.drives[j].offset_Nm);
  }
  // Before the moving joint nothing acts on it.
  const control::LinkInertia& first = fit.arm.arm.links[0].inertia;
  EXPECT_EQ(first.mass_kg, given.arm.links[0].inertia.mass_kg);
  EXPECT_EQ(first.about_C_kg_m2, given.arm.links[0].inertia.about_C_kg_m2);
}

}  // namespace
}  // namespace robot_gap_test
