/// @file
/// The CAN back-end: one joint on one Trinamic module, on a bench.
///
///     auto robot = youbot::make_can_robot("can0", {.joint_name = "wheel-1"}, clock, 1ms);
///
/// A module on CAN has no watchdog: when the cable breaks or this program dies, it keeps its last target.
#pragma once
#include "hal/can_robot.h"

namespace youbot {

using hal::CanOptions;
using hal::make_can_robot;

}  // namespace youbot
