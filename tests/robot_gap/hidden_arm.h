// Arms that hide an effect, simulated by DART: nothing here is shared with the library that searches.
#pragma once
#include <Eigen/Core>
#include <cstdint>
#include <dart/dynamics/Skeleton.hpp>
#include <string>
#include <string_view>
#include <vector>

namespace robot_gap_test {

/// An arm as its maker publishes it.
struct ArmDesign {
  struct Body {
    Eigen::Vector3d joint_at_m;  // in the body before, all frames parallel at zero
    Eigen::Vector3d axis;
    double mass_kg;
    Eigen::Vector3d centre_m;
    Eigen::Vector3d inertia_kg_m2;  // about the centre, along the axes
  };
  std::string name;
  std::vector<Body> bodies;
  Eigen::Vector3d tip_m;  // in the last body
  double slowest_Hz;
  double fastest_Hz;
  double amplitude_rad;
};
ArmDesign planar_arm();      // two links that swing in a vertical plane
ArmDesign elbow_arm();       // four joints: yaw, shoulder, elbow, roll of the hand
ArmDesign industrial_arm();  // six joints

std::string urdf_of(const ArmDesign& design);

/// What the published description does not say.
struct HiddenEffect {
  std::string effect;  // as the answer should name it, or one that it cannot name
  int part = -1;       // joint or link from 0
  double size = 0;
};

/// Published friction of every joint, which the given model has too.
struct Friction {
  double coulomb_Nm = 0;
  double viscous_Nm_s_per_rad = 0;
};

struct HiddenRecording {
  std::string name;
  std::vector<double> time_s;
  Eigen::MatrixXd position_rad;  // joints × rows, as an encoder gives it
  Eigen::MatrixXd torque_Nm;     // late, noisy and in steps
};

struct RecordingPlan {
  double seconds = 30;
  double tempo = 1;  // of the motion's frequencies
  std::uint64_t seed = 1;
  double rate_Hz = 500;
  double noise = 0.004;  // of the largest torque, 1 sigma
  double lag_s = 0.003;  // of the torque's low-pass
};

class HiddenArm {
 public:
  HiddenArm(const ArmDesign& design, std::vector<HiddenEffect> effects);
  HiddenRecording record(const RecordingPlan& plan, const std::string& name);
  /// Of the links alone, with gravity.
  Eigen::VectorXd rigid_torque_Nm(const Eigen::VectorXd& q, const Eigen::VectorXd& v,
                                  const Eigen::VectorXd& a);
  const std::vector<Friction>& friction() const { return friction_; }
  /// The largest torque of each joint in a recording of the published arm: effects are sized by it.
  Eigen::VectorXd torque_scale_Nm();

 private:
  Eigen::VectorXd torque(const Eigen::VectorXd& q, const Eigen::VectorXd& v, const Eigen::VectorXd& a,
                         double time_s);
  double size_of(std::string_view effect, int part) const;

  ArmDesign design_;
  std::vector<HiddenEffect> effects_;
  std::vector<Friction> friction_;
  dart::dynamics::SkeletonPtr skeleton_;
};

}  // namespace robot_gap_test
