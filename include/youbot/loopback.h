/// @file
/// An in-process robot without hardware: your own plant or the simulated base.
///
///     youbot::VirtualClock clock;
///     youbot::SimulatedBase base{youbot::BaseParameters{}};
///     youbot::LoopbackRobot robot(base, clock, 1ms, {{"wheel-1", 2.4}, {"wheel-2", 2.4}, ...});
///
/// Robot::exchange() measures, then advances the plant by one period with the command applied.
#pragma once
#include "hal/loopback_robot.h"
#include "hal/plant.h"
#include "sim/base.h"

namespace youbot {

using hal::LoopbackRobot;
using hal::Plant;
using sim::BaseParameters;
using SimulatedBase = sim::Base;

}  // namespace youbot
