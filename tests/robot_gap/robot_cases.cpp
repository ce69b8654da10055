#include "tests/robot_gap/robot_cases.h"

#include <algorithm>
#include <chrono>
#include <optional>
#include <utility>

namespace robot_gap_test {
namespace {

using identification::robot_gap::FoundPart;
using identification::robot_gap::NamedEffect;

ArmDesign design_of(const std::string& name) {
  if (name == "planar") return planar_arm();
  return name == "elbow" ? elbow_arm() : industrial_arm();
}

NamedEffect wanted(const HiddenEffect& hidden) {
  if (hidden.effect == "payload") return {hidden.effect, "tip"};
  if (hidden.part < 0) return {hidden.effect, "base"};
  const bool is_link = hidden.effect.rfind("link_", 0) == 0;
  return {hidden.effect, (is_link ? "link" : "joint") + std::to_string(hidden.part + 1)};
}

/// The number that the answer should have for an effect; nothing for those of several numbers.
std::optional<double> true_value(const HiddenEffect& hidden, const std::vector<Friction>& friction) {
  if (hidden.part < 0) return {};
  const Friction& given = friction[static_cast<std::size_t>(hidden.part)];
  if (hidden.effect == "coulomb") return given.coulomb_Nm + hidden.size;
  if (hidden.effect == "viscous") return given.viscous_Nm_s_per_rad + hidden.size;
  if (hidden.effect == "torque_constant") return 1 + hidden.size;
  if (hidden.effect == "torque_offset" || hidden.effect == "load_friction" || hidden.effect == "encoder_zero")
    return hidden.size;
  if (hidden.effect == "elasticity") return 1 / hidden.size;
  return {};
}

/// Relative to what the arm's joints carry.
HiddenEffect sized(const ArmDesign& design, const std::string& effect, int part, double factor = 1) {
  HiddenArm plain(design, {});
  const Eigen::VectorXd scale = plain.torque_scale_Nm();
  const double torque = part >= 0 ? scale[part] : 0;
  if (effect == "payload") return {effect, -1, factor * 0.5 * design.bodies.back().mass_kg};
  if (effect == "gravity_direction") return {effect, -1, factor * 0.06};
  if (effect == "link_mass") return {effect, part, factor * 0.25};
  if (effect == "link_centre") return {effect, part, factor * 0.04};
  if (effect == "encoder_zero") return {effect, part, factor * 0.07};
  if (effect == "torque_constant") return {effect, part, factor * 0.12};
  if (effect == "load_friction") return {effect, part, factor * 0.12};
  if (effect == "elasticity") return {effect, part, torque / 0.06};
  if (effect == "rotor_inertia") return {effect, part, factor * 0.02 * torque};
  return {effect, part, factor * 0.05 * torque};
}

}  // namespace

std::string RobotCase::name() const {
  std::string text = arm + ": ";
  if (hidden.empty()) return text + "nothing";
  for (std::size_t i = 0; i < hidden.size(); ++i)
    text += (i == 0 ? "" : " + ") + hidden[i].effect +
            (hidden[i].part < 0 ? "" : " " + std::to_string(hidden[i].part + 1));
  return text;
}

std::vector<RobotCase> robot_cases(std::uint64_t seeds) {
  std::vector<RobotCase> cases;
  for (std::uint64_t seed = 1; seed <= seeds; ++seed)
    for (const std::string arm : {"planar", "elbow", "industrial"}) {
      const ArmDesign design = design_of(arm);
      const auto joints = static_cast<int>(design.bodies.size());
      const auto joint = static_cast<int>(seed % design.bodies.size());
      const auto other = (joint + 1) % joints;
      using Kind = RobotCase::Kind;
      const auto add = [&](Kind kind, std::vector<HiddenEffect> hidden) {
        cases.push_back({kind, arm, std::move(hidden), seed});
      };
      add(Kind::kNone, {});
      for (const char* const effect : {"payload", "gravity_direction"})
        add(Kind::kOne, {sized(design, effect, -1)});
      for (const char* const effect : {"link_mass", "coulomb", "viscous", "torque_constant", "encoder_zero",
                                       "spring", "load_friction", "torque_offset", "elasticity"})
        // Of the first link and joint, a vertical axis shows neither mass nor zero.
        add(Kind::kOne, {sized(design, effect, std::max(joint, arm == "planar" ? 0 : 1))});
      add(Kind::kPair, {sized(design, "payload", -1), sized(design, "coulomb", other)});
      add(Kind::kPair, {sized(design, "torque_constant", joint), sized(design, "viscous", other)});
      add(Kind::kPair, {sized(design, "gravity_direction", -1), sized(design, "coulomb", joint)});
      add(Kind::kOutside, {sized(design, "end_stop", joint, 4)});
      add(Kind::kOutside, {sized(design, "pulse", joint, 2)});
      add(Kind::kOutside, {sized(design, "warming_friction", joint, 3)});
    }
  return cases;
}

control::ArmDescription published(const ArmDesign& design, const std::vector<Friction>& friction) {
  control::ArmDescription arm;
  arm.arm = control::read_serial_arm(urdf_of(design), "base", "tip");
  for (std::size_t j = 0; j < arm.arm.links.size(); ++j) {
    control::ArmDrive drive;
    drive.joint = arm.arm.links[j].joint;
    drive.gear_ratio = 50;
    drive.coulomb_Nm = friction[j].coulomb_Nm;
    drive.viscous_Nm_s_per_rad = friction[j].viscous_Nm_s_per_rad;
    arm.drives.push_back(drive);
  }
  return arm;
}

identification::robot_gap::ArmRecording as_recorded(HiddenRecording recording) {
  return {std::move(recording.name), std::move(recording.time_s), std::move(recording.position_rad),
          std::move(recording.torque_Nm)};
}

Answer answer(const RobotCase& asked) {
  const ArmDesign design = design_of(asked.arm);
  HiddenArm arm(design, asked.hidden);
  std::vector<identification::robot_gap::ArmRecording> data;
  std::vector<identification::robot_gap::ArmRecording> held_out;
  data.push_back(as_recorded(arm.record({.seconds = 40, .tempo = 0.6, .seed = 10 * asked.seed}, "slow")));
  data.push_back(as_recorded(arm.record({.seconds = 30, .tempo = 1.3, .seed = 10 * asked.seed + 1}, "fast")));
  held_out.push_back(
      as_recorded(arm.record({.seconds = 25, .tempo = 0.8, .seed = 10 * asked.seed + 2}, "other")));
  held_out.push_back(
      as_recorded(arm.record({.seconds = 25, .tempo = 1.2, .seed = 10 * asked.seed + 3}, "quick")));
  const auto begin = std::chrono::steady_clock::now();
  Answer result;
  const identification::robot_gap::ArmSubject subject(published(design, arm.friction()), std::move(data),
                                                      std::move(held_out), {});
  result.result = identification::robot_gap::analyse(subject, {.seed = asked.seed});
  result.arm = subject.changed(result.result.changes);
  result.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();

  std::vector<NamedEffect> truth;
  if (asked.kind != RobotCase::Kind::kOutside)
    for (const HiddenEffect& hidden : asked.hidden) truth.push_back(wanted(hidden));
  judge_names(result, truth);
  if (!result.right) return result;
  for (const HiddenEffect& hidden : asked.hidden)
    for (const FoundPart& found : result.result.effects)
      if (const auto value = true_value(hidden, arm.friction()); value && same(found.name, wanted(hidden)))
        judge_parameter(result, found, *value);
  return result;
}

}  // namespace robot_gap_test
