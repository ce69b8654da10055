// Exports of a drive model: what another engine can hold, what it cannot, and the files. tests/mujoco has
// MuJoCo itself judge the MJCF.
#include <gtest/gtest.h>
#include <urdf_parser/urdf_parser.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "analysis/export_mujoco.h"
#include "analysis/export_parts.h"
#include "analysis/sliding_fit.h"
#include "model/effects/effect_chain.h"

namespace export_test {

using analysis::Carriage;
using analysis::carried_by;
using analysis::fit_sliding;
using analysis::mujoco_target;
using analysis::plain_target;
using analysis::SlidingFit;
using analysis::SlidingTerms;
using model::effects::DriveModel;
using model::effects::make_effect;

std::vector<double> speeds() {
  std::vector<double> all;
  for (int i = 0; i <= 200; ++i) all.push_back(0.05 * i);
  return all;
}

DriveModel drive(std::vector<model::effects::AnyEffect> effects) {
  DriveModel model{.name = "wheel <1> & \"co\"", .inertia_kg_m2 = 0.0112};
  model.effects = std::move(effects);
  return model;
}

const auto kCoulomb = make_effect("coulomb", {{"torque_Nm", 0.045}});
const auto kViscous = make_effect("viscous", {{"coefficient_Nm_s_per_rad", 0.0125}});

TEST(ExportParts, EveryEffectIsCarriedOrSaidToBeLost) {
  for (const auto& effect : model::effects::effect_descriptions()) {
    for (const auto& target : {mujoco_target(), plain_target("URDF")}) {
      const Carriage carriage = analysis::carriage_of(make_effect(effect.name), target);
      EXPECT_EQ(carriage.effect, effect.name);
      EXPECT_FALSE(carriage.as.empty() && carriage.lost.empty()) << effect.name;
    }
  }
}

TEST(ExportParts, AFrictionLawIsCarriedByItsSteadyCurve) {
  for (const auto& law : model::effects::friction_law_effects()) {
    const auto effect = make_effect(law.name);
    EXPECT_EQ(analysis::part_of(effect), analysis::Part::kSliding) << law.name;
    EXPECT_FALSE(analysis::carriage_of(effect, mujoco_target()).as.empty()) << law.name;
    EXPECT_FALSE(analysis::carriage_of(effect, mujoco_target()).lost.empty()) << law.name;
  }
  // At high speed a LuGre bristle rubs as much as its sliding curve.
  const auto lugre =
      make_effect("lugre", {{"coulomb_Nm", 0.05}, {"static_Nm", 0.08}, {"viscous_Nm_s_per_rad", 0}});
  const SlidingFit fit = fit_sliding(drive({lugre}), speeds(), SlidingTerms::kAll);
  EXPECT_NEAR(fit.level_Nm(9), 0.05, 0.002);
  EXPECT_NEAR(fit.level_Nm(0.01), 0.08, 0.004);
}

TEST(ExportParts, AnEffectWithoutAPlaceIsNotCarried) {
  for (const char* name : {"load_friction", "torque_deadband", "unsigned_current"}) {
    EXPECT_TRUE(analysis::carriage_of(make_effect(name), mujoco_target()).as.empty()) << name;
    EXPECT_TRUE(carried_by(drive({make_effect(name)}), mujoco_target()).effects.empty()) << name;
  }
  EXPECT_FALSE(analysis::carriage_of(make_effect("cogging"), mujoco_target()).as.empty());
  EXPECT_TRUE(analysis::carriage_of(make_effect("cogging"), plain_target("URDF")).as.empty());
}

TEST(ExportParts, AnEffectThatTheTableDoesNotKnowIsNotCarried) {
  model::effects::add_custom_effect(
      {.name = "export_test_friction",
       .shows = "nothing",
       .amplitude = {"torque_Nm", 0, 1, 0.1},
       .level = [](const model::effects::Sliding&, double) noexcept { return 1.0; }});
  const Carriage carriage = analysis::carriage_of(make_effect("export_test_friction"), mujoco_target());
  EXPECT_TRUE(carriage.as.empty());
  EXPECT_EQ(carriage.lost, "all of it");
}

TEST(SlidingFit, ParametersThatAnEngineHasAreTakenAsTheyAre) {
  const DriveModel model = drive(
      {kCoulomb, kViscous, make_effect("quadratic_drag", {{"coefficient_Nm_s2_per_rad2", 0.001}}),
       make_effect("stribeck", {{"static_torque_Nm", 0.08}, {"velocity_rad_per_s", 0.3}, {"exponent", 2}}),
       make_effect("direction_asymmetry", {{"coulomb_Nm", 0.01}})});
  const SlidingFit fit = fit_sliding(model, speeds(), SlidingTerms::kAll);
  EXPECT_DOUBLE_EQ(fit.coulomb_Nm, 0.045);
  EXPECT_DOUBLE_EQ(fit.viscous_Nm_s_per_rad, 0.0125);
  EXPECT_DOUBLE_EQ(fit.quadratic_Nm_s2_per_rad2, 0.001);
  ASSERT_EQ(fit.bristles.size(), 1U);
  EXPECT_DOUBLE_EQ(fit.bristles[0].rest_Nm, 0.035);
  EXPECT_DOUBLE_EQ(fit.bristles[0].velocity_rad_per_s, 0.3);
  EXPECT_NEAR(fit.offset_Nm, 0.01, 1e-12);
  EXPECT_LT(fit.rms_error_Nm, 1e-12);
}

TEST(SlidingFit, AWarmDriveIsExported) {
  const SlidingFit fit = fit_sliding(
      drive({kCoulomb, kViscous,
             make_effect("thermal_drift", {{"coulomb_change_Nm", -0.015}, {"time_constant_s", 60}})}),
      speeds(), SlidingTerms::kAll);
  EXPECT_NEAR(fit.coulomb_Nm, 0.03, 1e-12);
}

TEST(SlidingFit, OtherFormsAreApproximatedByTermsThatBrake) {
  for (const auto& effect :
       {make_effect("stribeck", {{"static_torque_Nm", 0.09}, {"velocity_rad_per_s", 0.4}, {"tail", 1}}),
        make_effect("stribeck", {{"static_torque_Nm", 0.09}, {"velocity_rad_per_s", 0.4}, {"exponent", 0.7}}),
        make_effect("midspeed_dip",
                    {{"depth_Nm", 0.02}, {"centre_rad_per_s", 2.5}, {"width_rad_per_s", 0.8}})}) {
    const SlidingFit fit = fit_sliding(drive({kCoulomb, kViscous, effect}), speeds(), SlidingTerms::kAll);
    const SlidingFit plain =
        fit_sliding(drive({kCoulomb, kViscous, effect}), speeds(), SlidingTerms::kCoulombViscous);
    EXPECT_GT(plain.rms_error_Nm, 1e-3);
    EXPECT_LT(fit.rms_error_Nm, 0.6 * plain.rms_error_Nm) << name_of(effect);
    if (name_of(effect) == "stribeck") {
      EXPECT_LT(fit.rms_error_Nm, 0.1 * plain.rms_error_Nm);
    }
    EXPECT_TRUE(plain.bristles.empty());
    EXPECT_GE(fit.coulomb_Nm, 0);
    EXPECT_GE(fit.viscous_Nm_s_per_rad, 0);
    for (const analysis::Bristle& one : fit.bristles) EXPECT_TRUE(one.rest_Nm >= 0 && one.sliding_Nm >= 0);
    EXPECT_GE(std::abs(fit.worst_error_Nm), fit.rms_error_Nm);
  }
}

TEST(SlidingFit, ThePlainOneIsTheNearestLine) {
  // Coulomb and viscous friction are on it.
  const SlidingFit fit = fit_sliding(drive({kCoulomb, kViscous}), speeds(), SlidingTerms::kCoulombViscous);
  EXPECT_NEAR(fit.coulomb_Nm, 0.045, 1e-6);
  EXPECT_NEAR(fit.viscous_Nm_s_per_rad, 0.0125, 1e-6);
  // Of c·v² over 0 to V, the line is −c·V²/6 + c·V·v.
  const SlidingFit drag =
      fit_sliding(drive({make_effect("coulomb", {{"torque_Nm", 0.1}}),
                         make_effect("quadratic_drag", {{"coefficient_Nm_s2_per_rad2", 0.003}})}),
                  speeds(), SlidingTerms::kCoulombViscous);
  EXPECT_NEAR(drag.viscous_Nm_s_per_rad, 0.003 * 10, 0.003);
  EXPECT_NEAR(drag.coulomb_Nm, 0.1 - 0.003 * 100 / 6, 0.001);
}

std::string exported(const DriveModel& model) {
  const DriveModel carried = carried_by(model, mujoco_target());
  return analysis::mujoco_text(carried, fit_sliding(carried, speeds(), SlidingTerms::kAll), {});
}
bool has(const std::string& text, const std::string& part) { return text.find(part) != text.npos; }

TEST(ExportMujoco, FrictionWithoutABristleIsAConstraint) {
  const std::string text =
      exported(drive({kCoulomb, kViscous, make_effect("transport_delay", {{"delay_s", 0.0125}})}));
  EXPECT_TRUE(has(text, "frictionloss=\"0.045\"")) << text;
  EXPECT_TRUE(has(text, "damping=\"0.0125\""));
  EXPECT_FALSE(has(text, "lugre"));
  EXPECT_TRUE(has(text, "delay=\"0.0125\" nsample=\"26\""));
  EXPECT_TRUE(has(text, "model=\"wheel &lt;1&gt; &amp; &quot;co&quot;\""));
}

TEST(ExportMujoco, ABristleCarriesAllFriction) {
  const std::string text = exported(drive(
      {kCoulomb, make_effect("presliding", {{"stiffness_Nm_per_rad", 5}, {"damping_Nm_s_per_rad", 0.01}})}));
  EXPECT_FALSE(has(text, "frictionloss")) << text;
  EXPECT_TRUE(has(text, "lugre=\"5 0.01 0.045 0.045 1\""));
}

TEST(ExportMujoco, AnActuatorLimitsDelaysFiltersAndScalesTheCommand) {
  const std::string text = exported(drive({kCoulomb, make_effect("torque_saturation", {{"limit_Nm", 0.6}}),
                                           make_effect("transport_delay", {{"delay_s", 0.01}}),
                                           make_effect("torque_lag", {{"time_constant_s", 0.04}}),
                                           make_effect("actuator_gain", {{"gain", 1.25}}),
                                           make_effect("actuator_offset", {{"torque_Nm", 0.02}})}));
  EXPECT_TRUE(
      has(text, R"(<general name="drive" joint="drive" dyntype="filterexact" dynprm="0.04" actearly="true" )"
                R"(gear="1.25" ctrlrange="-0.6 0.6" delay="0.01" nsample=")"))
      << text;
  EXPECT_TRUE(has(text, R"(biasprm="0.02 0 0")")) << text;
  // Behind the gain, the limit is one of the delivered torque.
  EXPECT_TRUE(has(exported(drive({make_effect("actuator_gain", {{"gain", 2}}),
                                  make_effect("torque_saturation", {{"limit_Nm", 0.6}})})),
                  R"(ctrlrange="-0.3 0.3")"));
}

TEST(ExportMujoco, ASpringActsOnTheLoad) {
  const auto spring = make_effect("spring", {{"stiffness_Nm_per_rad", 0.4}, {"rest_position_rad", -0.2}});
  EXPECT_TRUE(has(exported(drive({kCoulomb, spring})), R"(stiffness="0.4" springref="-0.2"/>)"));
  const std::string text =
      exported(drive({kCoulomb, spring, make_effect("backlash", {{"gap_rad", 0.05}, {"load_share", 0.25}})}));
  EXPECT_LT(text.find("<joint name=\"drive_load\""), text.find("springref")) << text;
}

TEST(ExportMujoco, RipplesOfAnyNumberOpposeMotion) {
  const std::string text = exported(drive(
      {make_effect("cogging", {{"amplitude_Nm", 0.02}, {"periods_per_rev", 12.5}, {"phase_rad", 0.7}})}));
  EXPECT_TRUE(has(text, "gear=\"12.5\" cogging=\"-0.0016 1 0.7\"")) << text;
}

TEST(ExportMujoco, AGapIsATendonBetweenTwoHinges) {
  const std::string text =
      exported(drive({kCoulomb, make_effect("backlash", {{"gap_rad", 0.05}, {"load_share", 0.25}})}));
  EXPECT_TRUE(has(text, "range=\"-0.025 0.025\"")) << text;
  EXPECT_TRUE(has(text, "<joint name=\"drive_load\""));
  EXPECT_TRUE(has(text, "frictionloss=\"0.03375\""));
  EXPECT_TRUE(has(text, "frictionloss=\"0.01125\""));
}

TEST(ExportMujoco, RemarksCannotEndTheirComment) {
  const std::vector<std::string> remarks{"a -->- b --", "-"};
  const DriveModel model = drive({kCoulomb});
  const std::string text =
      analysis::mujoco_text(model, fit_sliding(model, speeds(), SlidingTerms::kAll), {.remarks = remarks});
  const std::size_t begin = text.find("<!--");
  const std::string inside = text.substr(begin + 4, text.find("-->", begin) - begin - 4);
  EXPECT_EQ(inside.find("--"), std::string::npos) << inside;
  EXPECT_TRUE(has(inside, " b ")) << inside;
}

TEST(ExportMujoco, TextsThatXmlCannotHoldAreNamed) {
  const std::vector<std::string> remarks{"a\x1b[2J\xff b"};
  DriveModel model = drive({kCoulomb});
  model.name = "wheel\x01\xfe";
  const std::string text =
      analysis::mujoco_text(model, fit_sliding(model, speeds(), SlidingTerms::kAll), {.remarks = remarks});
  EXPECT_TRUE(has(text, R"(a\x1b[2J\xff b)")) << text;
  EXPECT_TRUE(has(text, R"(wheel\x01\xfe)")) << text;
  const std::string urdf =
      analysis::urdf_text(model, fit_sliding(model, speeds(), SlidingTerms::kCoulombViscous), remarks);
  for (const std::string& each : {text, urdf})
    EXPECT_EQ(each.find_first_of("\x01\x1b\xfe\xff"), std::string::npos) << each;
}

TEST(ExportUrdf, ItsParserReadsDampingFrictionAndInertia) {
  const DriveModel model = drive({kCoulomb, kViscous, make_effect("inertia", {{"difference_kg_m2", 0.002}})});
  const std::vector<std::string> remarks{"from --model wheel.toml"};
  const auto robot = urdf::parseURDF(
      analysis::urdf_text(model, fit_sliding(model, speeds(), SlidingTerms::kCoulombViscous), remarks));
  ASSERT_NE(robot, nullptr);
  EXPECT_EQ(robot->getName(), model.name);
  const auto joint = robot->getJoint("drive");
  ASSERT_NE(joint, nullptr);
  EXPECT_EQ(joint->type, urdf::Joint::CONTINUOUS);
  EXPECT_NEAR(joint->dynamics->damping, 0.0125, 1e-6);
  EXPECT_NEAR(joint->dynamics->friction, 0.045, 1e-6);
  EXPECT_NEAR(robot->getLink("load")->inertial->izz, 0.0132, 1e-9);
}

}  // namespace export_test
