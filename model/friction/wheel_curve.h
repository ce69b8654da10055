/// @file
/// The friction of the four youBot wheel drives as measured with lifted wheels (thesis 2.6 and appendix A;
/// appendix A applies where they differ).
#pragma once

namespace model::friction {

/// The curves were identified for |velocity| up to this; there are no measurements beyond.
inline constexpr double kIdentifiedSpeed_rad_per_s = 10.0;

/// Joint-side friction torque [N·m] of wheel 1 to 4 at `velocity_rad_per_s`, positive against positive
/// motion. As published: with its jumps of up to 0.0009 N·m between segments (wheel 1: 0.7, 1.5, −3.59 rad/s,
/// …), zero at rest and a steep straight line (5 N·m·s/rad) next to it. Outside the identified range the
/// value at its edge is held.
/// @throws std::out_of_range if `wheel` is not 1 to 4. Setup: tens of exponentials per call; a loop uses a
/// friction::SlidingTable made from it.
double wheel_curve_Nm(int wheel, double velocity_rad_per_s);

}  // namespace model::friction
