/// @file
/// A haptic device in the operator's hand: one exchange a cycle, force out, pose in.
///
///     youbot::OpenedHaptic opened = youbot::open_haptic({.name = "loopback"}, clock, 1ms);
///     youbot::HapticDevice& device = *opened.device;
///     device.activate();                                    // set-up: throws SetupError
///     while (...) status = device.exchange({.enable = true, .f_D_H_N = force}, sample);   // never blocks
///     device.deactivate();
///
/// Frame H is the device's fixed base: x towards the operator, y to the operator's right, z up. Forces act on
/// the hand. The force fades in after each enable, is limited in magnitude and rate, and is removed when
/// samples or commands become stale (hal/haptic_device.h, hal/haptic_servo.h). An omega.6 needs the vendor's
/// library, from $FDSDK or HapticOptions::force_dimension; a Falcon needs its firmware file after each
/// power-on, HapticOptions::falcon.firmware (runtime/open_haptic.h).
#pragma once
#include "hal/haptic_device.h"
#include "runtime/open_haptic.h"

namespace youbot {

using hal::needs_reopening;

using hal::HapticCommand;
using hal::HapticDevice;
using hal::HapticFault;
using hal::HapticInfo;
using hal::HapticLimits;
using hal::HapticSample;
using hal::HapticStatus;
using runtime::HapticOptions;
using runtime::open_haptic;
using runtime::OpenedHaptic;

}  // namespace youbot
