/// @file
/// Mecanum base and arm: kinematics, odometry, dynamics, and control of the base.
///
///     const youbot::LinkMap map = youbot::LinkMap::with_geometry({});
///     const youbot::WheelVector w = map.wheel_velocity({0.2, 0.0, 0.0});     // 0.2 m/s forward
///
/// Frames: W is the floor, B the base (x forward, y left, z up), T the end effector. Poses are X_WB; a planar
/// vector is x, y [m], yaw [rad], their rates, or a wrench [N, N, N·m]. All functions except constructors may
/// be called in a cycle.
#pragma once
#include "control/base_controller.h"
#include "control/base_odometry.h"
#include "control/base_path.h"
#include "control/link_map.h"
#include "control/odometry_covariance.h"
#include "control/planar.h"
#include "control/robot_model.h"

namespace youbot {

using control::BaseController;
using control::BaseGeometry;
using control::BaseOdometry;
using control::BasePath;
using control::BaseReference;
using control::LinkMap;
using control::OdometryCovariance;
using control::PlanarPose;
using control::PlanarVector;
using control::RobotModel;
using control::WheelSigns;
using control::WheelVector;

}  // namespace youbot
