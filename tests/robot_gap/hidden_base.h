// Wheeled bases that hide an effect, simulated from their contacts: nothing here is shared with the library
// that searches.
#pragma once
#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace robot_gap_test {

enum class Kinematics { kDifferential, kTricycle, kOmni, kMecanum };

/// A base as its maker publishes it. x forward, y left; the origin is the middle of the (rear) axle or of the
/// wheels.
struct BaseDesign {
  struct Wheel {
    std::string name;
    double radius_m;
    double angle_rad =
        0;  // omni: its place around the centre; a positive rotation turns the base counter-clockwise
    double inertia_kg_m2 = 0;
    double coulomb_Nm = 0;
    double viscous_Nm_s = 0;
  };
  std::string name;
  Kinematics kinematics;
  std::vector<Wheel> wheels;  // mecanum: in the youBot's order and signs: all positive turn counter-clockwise
  double track_m = 0;
  double wheelbase_m = 0;
  double radius_m = 0;  // omni: from centre to wheel
  double speed_m_per_s;
  double path_m;                 // side of a square that it drives
  double mass_kg = 0;            // 0: its torques are not recorded
  double yaw_inertia_kg_m2 = 0;  // about the centre of mass
  Eigen::Vector2d centre_m = Eigen::Vector2d::Zero();
};
BaseDesign two_wheeler();
BaseDesign tricycle();
BaseDesign omni_base();  // three wheels
BaseDesign mecanum_base();
/// With masses and friction that its maker publishes, and torques recorded.
BaseDesign weighed(BaseDesign base);

/// What the published description does not say.
struct BaseEffect {
  std::string effect;  // as the answer should name it, or one that it cannot name
  std::string part;
  double size = 0;    // relative to the published value, or in SI units; of a slip: the share that is lost
  double size_y = 0;  // of an offset
};

struct BaseRecording {
  std::string name;
  std::string floor;
  std::vector<double> time_s{};
  Eigen::MatrixXd wheel_rad;           // wheels × rows, accumulated, in steps of the encoders
  Eigen::MatrixXd load;                // wheels × rows, magnitude of the motors' currents [A]
  Eigen::MatrixXd torque_Nm{};         // wheels × rows; late, noisy, in steps; empty: not recorded
  std::vector<double> steering_rad{};  // of a tricycle
  std::vector<double> x_m{}, y_m{};    // of the tracked point; late and noisy
  std::vector<double> heading_rad{};   // continuous
};

enum class BaseMotion { kSquares, kCircles, kLines, kFree };

struct BasePlan {
  BaseMotion motion = BaseMotion::kSquares;
  double seconds = 60;
  double tempo = 1;  // of the base's usual speed
  std::uint64_t seed = 1;
  std::string floor{};
  bool camera = false;  // instead of motion capture: slower, 2 mm and half a degree, in steps
  double lag_s = 0.03;  // of the tracker
  double torque_lag_s = 0.012;
  double worn_from = 0;  // share of its wear that a worn tyre has at the start and at the end
  double worn_to = 1;
};

class HiddenBase {
 public:
  HiddenBase(BaseDesign design, std::vector<BaseEffect> effects);
  BaseRecording record(const BasePlan& plan, const std::string& name) const;
  /// Twist (x, y, yaw) in base axes at which the forces of all contacts balance, for surface speeds of the
  /// wheels.
  Eigen::Vector3d rolling_twist(const Eigen::VectorXd& surface_speed_m_per_s, double steering_rad) const;
  const BaseDesign& design() const { return design_; }  // as published
  const BaseDesign& actual() const { return actual_; }
  const std::vector<BaseEffect>& effects() const { return effects_; }
  /// 0 without the effect.
  double size_of(std::string_view effect, std::string_view part) const;

 private:
  BaseDesign design_;
  BaseDesign actual_;
  std::vector<BaseEffect> effects_;
};

}  // namespace robot_gap_test
