/// @file
/// A base on wheels with what a robot file knows about it: all that predicts its motion from its wheels.
#pragma once
#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <vector>

namespace control {

enum class BaseKinematics : std::uint8_t {
  kDifferential,  ///< two wheels, left and right
  kTricycle,      ///< one wheel, driven and steered, before a rear axle
  kOmni,          ///< wheels with rollers across, on a circle
  kMecanum        ///< four wheels, in the order of the youBot, with its rollers and signs (link_map.h)
};

/// Name of BaseDescription::turning_length_m in files and reports.
constexpr const char* turning_length_name(BaseKinematics kinematics) {
  switch (kinematics) {
    case BaseKinematics::kDifferential: return "track_m";
    case BaseKinematics::kTricycle: return "wheelbase_m";
    case BaseKinematics::kOmni: return "radius_m";
    case BaseKinematics::kMecanum: return "turning_length_m";
  }
  return "";
}

/// The centre B: differential and tricycle: middle of the (rear) axle; omni: the point that the wheels' axes
/// meet in; mecanum: middle of the four wheels. x forward, y left, z up. With u_i the distance that the
/// circumference of wheel i rolls,
///
///   u_i = radius_i · angle_i · (1 − slip_with_load · load_i)
///   differential: x = (u_left + u_right)/2,              yaw = (u_right − u_left)/turning_length
///   tricycle:     x = u · cos(steering + offset),        yaw = u · sin(steering + offset)/turning_length
///   omni:         u_i = −sin(angle_i)·x + cos(angle_i)·y + turning_length·yaw, least squares
///   mecanum:      LinkMap with the lever turning_length
///   x ← (1 − slip of the floor − slip_forward)·x,  y ← (1 − slip of the floor − slip_sideways)·y,
///   yaw ← (1 − slip of the floor)·yaw
///
/// The tracked body is at `offset` from the base's centre, turned by `yaw`: T = B·M. A measured position is
/// the true one times `scale`.
struct BaseDescription {
  struct Wheel {
    std::string name;
    double radius_m = 0;
    double angle_rad = 0;      ///< omni: place around the centre, from +x, counter-clockwise
    double torque_scale = 1;   ///< true torque over the reported one
    double offset_Nm = 0;      ///< part of the torque that moves nothing
    double inertia_kg_m2 = 0;  ///< about its axle, with rotor and gear
    double coulomb_Nm = 0;
    double viscous_Nm_s_per_rad = 0;
  };
  struct Floor {
    std::string name;
    double slip = 0;          ///< share of the motion that is lost
    double resistance_N = 0;  ///< against rolling, of all wheels together
  };
  struct Tracking {
    Eigen::Vector2d p_BT_m = Eigen::Vector2d::Zero();
    double yaw_BT_rad = 0;
    double scale = 1;
  };
  /// The whole base, wheels included.
  struct Body {
    double mass_kg = 0;                                ///< 0: unknown; its forces are not compared
    double yaw_inertia_kg_m2 = 0;                      ///< about the centre of mass
    Eigen::Vector2d p_BC_m = Eigen::Vector2d::Zero();  ///< centre of mass
    double sideways_resistance_N = 0;                  ///< against motion along y, of rollers
    double turning_resistance_Nm = 0;                  ///< against turning, of tyres and castors
    Eigen::Vector2d slope =
        Eigen::Vector2d::Zero();  ///< rise of the floor along x and y of the tracker's frame
  };

  BaseKinematics kinematics = BaseKinematics::kDifferential;
  std::vector<Wheel> wheels;  ///< differential: left, right; mecanum: front left, front right, rear ones
  /// Differential: track; tricycle: wheelbase; omni: radius of the circle; mecanum: half of wheelbase plus
  /// track.
  double turning_length_m = 0;
  double steering_offset_rad = 0;  ///< tricycle: true angle minus measured one
  double slip_forward = 0;         ///< share of the motion along x that is lost
  double slip_sideways = 0;
  double slip_with_load = 0;  ///< share that a wheel loses per unit of its load
  std::vector<Floor> floors{};
  Tracking tracking{};
  Body body{};
};

}  // namespace control
