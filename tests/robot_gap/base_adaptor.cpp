#include <algorithm>

#include "control/base_description.h"
#include "identification/robot_gap/base_subject.h"
#include "tests/robot_gap/base_cases.h"

namespace robot_gap_test {
namespace {

using control::BaseDescription;
using control::BaseKinematics;

BaseDescription described(const BaseDesign& published) {
  BaseDescription base;
  for (const BaseDesign::Wheel& wheel : published.wheels)
    base.wheels.push_back({.name = wheel.name,
                           .radius_m = wheel.radius_m,
                           .angle_rad = wheel.angle_rad,
                           .inertia_kg_m2 = wheel.inertia_kg_m2,
                           .coulomb_Nm = wheel.coulomb_Nm,
                           .viscous_Nm_s_per_rad = wheel.viscous_Nm_s});
  base.body.mass_kg = published.mass_kg;
  base.body.yaw_inertia_kg_m2 = published.yaw_inertia_kg_m2;
  base.body.p_BC_m = published.centre_m;
  switch (published.kinematics) {
    case Kinematics::kDifferential:
      base.kinematics = BaseKinematics::kDifferential;
      base.turning_length_m = published.track_m;
      break;
    case Kinematics::kTricycle:
      base.kinematics = BaseKinematics::kTricycle;
      base.turning_length_m = published.wheelbase_m;
      break;
    case Kinematics::kOmni:
      base.kinematics = BaseKinematics::kOmni;
      base.turning_length_m = published.radius_m;
      break;
    case Kinematics::kMecanum:
      base.kinematics = BaseKinematics::kMecanum;
      base.turning_length_m = (published.wheelbase_m + published.track_m) / 2;
      break;
  }
  return base;
}

identification::robot_gap::BaseRecording read(const BaseDescription& base, const BaseRecording& recorded) {
  identification::robot_gap::BaseRecording recording;
  recording.name = recorded.name;
  recording.time_s = recorded.time_s;
  recording.wheel = recorded.wheel_rad;
  recording.is_speed.assign(base.wheels.size(), false);
  recording.load = recorded.load;
  recording.torque_Nm = recorded.torque_Nm;
  recording.steering_rad = recorded.steering_rad;
  for (std::size_t i = 0; i < recorded.x_m.size(); ++i)
    recording.pose.push_back({recorded.x_m[i], recorded.y_m[i], recorded.heading_rad[i]});
  const auto floor = std::ranges::find(base.floors, recorded.floor, &BaseDescription::Floor::name);
  if (floor != base.floors.end()) recording.floor = static_cast<int>(floor - base.floors.begin());
  return recording;
}

}  // namespace

identification::robot_gap::RobotResult analyse_base(const BaseDesign& published,
                                                    const std::vector<BaseRecording>& data,
                                                    const std::vector<BaseRecording>& held_out,
                                                    std::uint64_t seed) {
  BaseDescription base = described(published);
  for (const BaseRecording& one : data)
    if (!one.floor.empty() &&
        std::ranges::find(base.floors, one.floor, &BaseDescription::Floor::name) == base.floors.end())
      base.floors.push_back({one.floor});
  std::vector<identification::robot_gap::BaseRecording> searched;
  std::vector<identification::robot_gap::BaseRecording> judging;
  for (const BaseRecording& one : data) searched.push_back(read(base, one));
  for (const BaseRecording& one : held_out) judging.push_back(read(base, one));
  const identification::robot_gap::BaseSubject subject(base, std::move(searched), std::move(judging));
  return identification::robot_gap::analyse(subject, {.seed = seed});
}

}  // namespace robot_gap_test
