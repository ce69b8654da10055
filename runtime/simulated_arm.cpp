#include "runtime/simulated_arm.h"

namespace runtime {

void build_arm(const ArmModel& model, control::ModelChanges& masses,
               std::array<sim::bus::ArmJointData, control::kArmJoints>& joints) {
  const control::ModelChanges::LinkChange base = masses.links[0];
  masses = model.changes;
  masses.links[0] = base;
  for (std::size_t i = 0; i < joints.size(); ++i) {
    sim::bus::ArmJointData& joint = joints[i];
    joint.coulomb_Nm = model.friction.coulomb_Nm[i];
    joint.viscous_Nm_s_per_rad = model.friction.viscous_Nm_s_per_rad[i];
    const double gear = joint.axis.gear_ratio;
    joint.rotor_inertia_kg_m2 = model.rotor_inertia_kg_m2[i] / (gear * gear);
  }
}

}  // namespace runtime
