/// @file
/// What the figures of this folder are compared with: the numbers that the thesis prints, each with its
/// place, and criteria of ours where it prints words, a curve or a function. A figure that needs a printed
/// number as a setting reads it from here.
///
/// M. Corberán Ruiz, "Haptic teleoperation of the youBot with friction compensation for the base",
/// Universidad Carlos III de Madrid and University of Twente, 2012.
#pragma once
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <stdexcept>
#include <string>
#include <string_view>

namespace youbot_bench::thesis {

inline constexpr double kUnbounded = std::numeric_limits<double>::infinity();

/// What it means that ours is near the number.
enum class Kind : std::uint8_t {
  kMayDiffer,       ///< nothing says that it must be; no limit
  kMustAgree,       ///< ours was measured or computed by a way that could miss it
  kSetting,         ///< we take it from the thesis, and read it back, perhaps at the end of a run
  kByConstruction,  ///< it follows from other printed numbers, or what is not printed was chosen to give it
};
using enum Kind;

enum class Origin : std::uint8_t {
  kThesis,     ///< the thesis prints the number
  kCriterion,  ///< ours: the thesis prints words, a curve or a function here
};
using enum Origin;

struct Printed {
  std::string_view key;    ///< "table 5/first, command"
  std::string_view place;  ///< "Table 5"
  std::string_view what;
  std::string_view unit;
  /// A single number has both ends equal; "over 4 rad" ends at kUnbounded.
  double from;
  double to;
  Kind kind = kMayDiffer;
  double within_percent = 0;  ///< how far beyond it ours may lie, unless it may differ anyway
  Origin origin = kThesis;

  bool limited() const noexcept { return kind != kMayDiffer; }
};

inline constexpr auto kNumbers = std::to_array<Printed>({
    // Table 1: the maker's data of the omega.6.
    {"omega/width", "Table 1", "workspace of the handle, diameter", "mm", 160, 160},
    {"omega/depth", "Table 1", "workspace of the handle, depth", "mm", 110, 110},
    {"omega/force", "Table 1", "force of the device", "N", 12, 12},
    {"omega/stiffness", "Table 1", "closed-loop stiffness", "N/mm", 14.5, 14.5, kSetting},
    // Table 2: the maker's data of the youBot.
    {"youbot/joint 1, lower", "Table 2", "lower end of arm joint 1, from the upright arm", "deg", -169, -169,
     kSetting, 1},
    {"youbot/joint 1, upper", "Table 2", "upper end of arm joint 1, from the upright arm", "deg", 169, 169,
     kSetting, 1},
    {"youbot/joint 2, lower", "Table 2", "lower end of arm joint 2, from the upright arm", "deg", -65, -65,
     kSetting, 1},
    {"youbot/joint 2, upper", "Table 2", "upper end of arm joint 2, from the upright arm", "deg", 90, 90,
     kSetting, 1},
    {"youbot/joint 3, lower", "Table 2", "lower end of arm joint 3, from the upright arm", "deg", -151, -151,
     kSetting, 1},
    {"youbot/joint 3, upper", "Table 2", "upper end of arm joint 3, from the upright arm", "deg", 146, 146,
     kSetting, 1},
    {"youbot/joint 4, lower", "Table 2", "lower end of arm joint 4, from the upright arm", "deg", -102, -102,
     kSetting, 1},
    {"youbot/joint 4, upper", "Table 2", "upper end of arm joint 4, from the upright arm", "deg", 102, 102,
     kSetting, 1},
    {"youbot/joint 5, lower", "Table 2", "lower end of arm joint 5, from the upright arm", "deg", -167, -167,
     kSetting, 1},
    {"youbot/joint 5, upper", "Table 2", "upper end of arm joint 5, from the upright arm", "deg", 167, 167,
     kSetting, 1},
    {"youbot/arm speed", "Table 2", "speed of an arm joint", "deg/s", 90, 90, kSetting, 1},
    {"youbot/base speed", "Table 2", "speed of the base", "m/s", 0.8, 0.8, kMustAgree, 5},
    {"youbot/encoder", "Section 1.3", "ticks of a motor's encoder", "per revolution", 4000, 4000, kSetting,
     0.01},
    // Section 2.3: what is said about the laws.
    {"lugre/loop", "Section 2.3, figure 12",
     "torque by which LuGre misses the point where it left for an inner loop", "N·m", 1e-5, kUnbounded,
     kMustAgree, 0, kCriterion},
    // Table 3: one measurement, and the sets.
    {"steady state/T1", "Section 2.5.1, figure 14", "time to settle, T1", "s", 50, 50, kSetting},
    {"steady state/T2", "Section 2.5.1, figure 14", "time of measuring, T2", "s", 30, 30, kSetting},
    {"steady state/whole", "Section 2.5.1, figure 14", "one measurement", "s", 90, 90, kMustAgree, 0.1},
    {"table 3/set 1", "Table 3", "measurements from 0 to 0.5 rad/s by 0.05", "", 10, 10, kSetting},
    {"table 3/set 2", "Table 3", "measurements from 0 to 0.5 rad/s by 0.005", "", 100, 100, kSetting},
    {"table 3/set 3", "Table 3", "measurements from 0.5 to 0.75 rad/s by 0.005", "", 50, 50, kSetting},
    {"table 3/set 4", "Table 3", "measurements from 0.75 to 2 rad/s by 0.05", "", 25, 25, kSetting},
    {"table 3/set 5", "Table 3", "measurements from 0.7 to 4 rad/s by 0.1", "", 33, 33, kSetting},
    {"table 3/set 6", "Table 3", "measurements from 2 to 10 rad/s by 0.5", "", 16, 16, kSetting},
    {"table 3/set 7", "Table 3", "measurements from 0 to -1.5 rad/s by 0.05", "", 30, 30, kSetting},
    {"table 3/set 8", "Table 3", "measurements from -1 to -4.5 rad/s by 0.1", "", 35, 35, kSetting},
    {"table 3/set 9", "Table 3", "measurements from -4.5 to -10 rad/s by 0.5", "", 13, 13, kSetting},
    // Figure 15, as the text describes it.
    {"figure 15/dip 1", "Section 2.5.1, figure 15", "speed of the least friction of wheel 1", "rad/s", 1, 4,
     kMustAgree},
    {"figure 15/dip 2", "Section 2.5.1, figure 15", "speed of the least friction of wheel 2", "rad/s", 1, 4,
     kMustAgree},
    {"figure 15/dip 3", "Section 2.5.1, figure 15", "speed of the least friction of wheel 3", "rad/s", 1, 4,
     kMustAgree},
    {"figure 15/dip 4", "Section 2.5.1, figure 15", "speed of the least friction of wheel 4", "rad/s", 1, 4},
    {"figure 15/dip 1, backward", "Section 2.5.1, figure 15",
     "speed of the least friction of wheel 1, backward", "rad/s", 1, 4, kMustAgree},
    {"figure 15/dip 2, backward", "Section 2.5.1, figure 15",
     "speed of the least friction of wheel 2, backward", "rad/s", 1, 4, kMustAgree},
    {"figure 15/dip 3, backward", "Section 2.5.1, figure 15",
     "speed of the least friction of wheel 3, backward", "rad/s", 1, 4, kMustAgree},
    {"figure 15/dip 4, backward", "Section 2.5.1, figure 15",
     "speed of the least friction of wheel 4, backward", "rad/s", 1, 4},
    {"figure 15/fastest", "Section 2.5.1, figure 15", "highest speed reached, in either direction", "rad/s",
     10, 10, kMustAgree, 1},
    {"figure 15/backward", "Section 2.5.1, figure 15",
     "friction at -9 rad/s over that at 9 rad/s, least of the wheels", "", 1, kUnbounded, kMustAgree, 0,
     kCriterion},
    // Appendix A: the printed functions, evaluated.
    {"curve/wheel 1 at 1", "Appendix A", "friction of wheel 1 at 1 rad/s", "N·m", 0.0536847, 0.0536847,
     kMustAgree, 1, kCriterion},
    {"curve/wheel 1 at 3.2", "Appendix A", "friction of wheel 1 at 3.2 rad/s", "N·m", 0.122475, 0.122475,
     kMustAgree, 1, kCriterion},
    {"curve/wheel 1 at -9", "Appendix A", "friction of wheel 1 at -9 rad/s", "N·m", -0.310798, -0.310798,
     kMustAgree, 1, kCriterion},
    {"curve/wheel 2 at 2", "Appendix A", "friction of wheel 2 at 2 rad/s", "N·m", 0.0549988, 0.0549988,
     kMustAgree, 1, kCriterion},
    {"curve/wheel 2 at -4", "Appendix A", "friction of wheel 2 at -4 rad/s", "N·m", -0.123525, -0.123525,
     kMustAgree, 1, kCriterion},
    {"curve/wheel 3 at 0.2", "Appendix A", "friction of wheel 3 at 0.2 rad/s", "N·m", 0.0862276, 0.0862276,
     kMustAgree, 1, kCriterion},
    {"curve/wheel 3 at 5", "Appendix A", "friction of wheel 3 at 5 rad/s", "N·m", 0.149057, 0.149057,
     kMustAgree, 1, kCriterion},
    {"curve/wheel 4 at 0.2", "Appendix A", "friction of wheel 4 at 0.2 rad/s", "N·m", 0.0576455, 0.0576455,
     kMustAgree, 1, kCriterion},
    {"curve/wheel 4 at -7", "Appendix A", "friction of wheel 4 at -7 rad/s", "N·m", -0.299831, -0.299831,
     kMustAgree, 1, kCriterion},
    // Table 4.
    {"table 4/Fc", "Table 4", "Fc", "N·m", 0.03718, 0.03718},
    {"table 4/Fs", "Table 4", "Fs", "N·m", 0.08976, 0.08976},
    {"table 4/vs", "Table 4", "vs", "rad/s", 0.1516, 0.1516},
    {"table 4/exponent", "Table 4", "δs", "", 1.047, 1.047},
    {"table 4/viscous", "Table 4", "σ2", "N·m·s/rad", 0.01898, 0.01898},
    {"table 4/Fc, method", "Table 4", "Fc, of a wheel that has it", "N·m", 0.03718, 0.03718, kMustAgree, 2},
    {"table 4/Fs, method", "Table 4", "Fs, of a wheel that has it", "N·m", 0.08976, 0.08976, kMustAgree, 2},
    {"table 4/vs, method", "Table 4", "vs, of a wheel that has it", "rad/s", 0.1516, 0.1516, kMustAgree, 2},
    {"table 4/exponent, method", "Table 4", "δs, of a wheel that has it", "", 1.047, 1.047, kMustAgree, 2},
    {"table 4/viscous, method", "Table 4", "σ2, of a wheel that has it", "N·m·s/rad", 0.01898, 0.01898,
     kMustAgree, 2},
    // Section 2.5.2: the torque ramp.
    {"ramp/offset", "Section 2.5.2, figure 18", "torque of the motor below its offset", "N·m", 0.03, 0.03,
     kSetting, 5},
    {"table 5/first, real", "Table 5", "σ0 = 0.0251 N·m over 1e-4 rad", "N·m/rad", 251, 251, kByConstruction,
     0.2},
    {"table 5/first, command", "Table 5", "σ0 = 0.0377 N·m over 1e-4 rad", "N·m/rad", 377, 377,
     kByConstruction, 0.2},
    {"table 5/second, real", "Table 5", "σ0 = 0.0156 N·m over 1e-4 rad", "N·m/rad", 156, 156, kByConstruction,
     0.2},
    {"table 5/second, command", "Table 5", "σ0 = 0.0283 N·m over 1e-4 rad", "N·m/rad", 283, 283,
     kByConstruction, 0.2},
    {"table 5/step", "Table 5", "first displacement that the encoder shows", "rad", 1e-4, 1e-4},
    {"table 5/command", "Table 5", "torque commanded at the first displacement", "N·m", 0.0283, 0.0377},
    {"table 5/real", "Table 5", "torque of the motor at the first displacement", "N·m", 0.0156, 0.0251},
    {"ramp/stiffness", "Section 2.5.2", "σ0, as chosen", "N·m/rad", 250, 250, kMustAgree, 10},
    {"ramp/damping", "Section 2.5.2", "σ1 = 0.2·√(J·σ0)", "N·m·s/rad", 0.127, 0.127, kByConstruction, 0.5},
    // Section 2.5.2: Dahl's curve, and figure 24.
    {"dahl/stiffness", "Section 2.5.2, figure 19", "σ0, slope at the centre of Dahl's curve", "N·m/rad", 250,
     250, kMustAgree, 20},
    {"dahl/cycles", "Section 2.5.2", "cycles of the sine", "", 7, 10, kSetting},
    {"dahl/offset", "Section 2.5.2, figure 20", "torque of the motor at the centre of the loop", "N·m", 0.03,
     0.03, kSetting, 5},
    {"dahl/displacement", "Section 2.5.2, figure 20", "displacements, \"of the order of\"", "rad", 3.16e-4,
     3.16e-3, kMustAgree, 0, kCriterion},
    {"creep", "Section 2.5.2, figure 24", "rise of the minima of position, each higher than the last",
     "rad a period", 1e-6, kUnbounded, kMustAgree, 0, kCriterion},
    // Section 2.7.2: friction compensation.
    {"swing/highest", "Section 2.7.2, figure 28", "highest position of wheel 1, \"over 4\"", "rad", 4,
     kUnbounded, kByConstruction},
    {"swing/reference", "Section 2.7.2, figure 28", "reference position", "rad", 2, 2, kSetting},
    {"swing/extra", "Section 2.7.2, figure 28", "constant torque beside the spring", "N·m", 0.01, 0.01,
     kSetting},
    {"swing/count", "Section 2.7.2, figure 28",
     "half swings with compensation, \"almost three times\" to and fro", "", 5, 6, kByConstruction, 0,
     kCriterion},
    // "No starting motion" and "did move as commanded", on a path whose first line is 1 m long.
    {"base/without", "Section 2.7.2", "motion of the base without compensation", "mm", 0, 10, kByConstruction,
     0, kCriterion},
    {"base/with", "Section 2.7.2", "largest path error of the base with compensation", "mm", 0, 100,
     kMustAgree, 0, kCriterion},
    // Section 2.7.2: the link map.
    {"link map/yaw 1", "Section 2.7.2, link map", "yaw for wheel 1 at 1 rad/s", "rad/s", 1, 1, kSetting},
    {"link map/yaw 2", "Section 2.7.2, link map", "yaw for wheel 2 at 1 rad/s", "rad/s", 1, 1, kSetting},
    {"link map/yaw 3", "Section 2.7.2, link map", "yaw for wheel 3 at 1 rad/s", "rad/s", 1, 1, kSetting},
    {"link map/yaw 4", "Section 2.7.2, link map", "yaw for wheel 4 at 1 rad/s", "rad/s", 1, 1, kSetting},
    {"link map/vx 1", "Section 2.7.2, link map", "vx for wheel 1 at 1 rad/s", "rad/s", -1, -1, kSetting},
    {"link map/vx 2", "Section 2.7.2, link map", "vx for wheel 2 at 1 rad/s", "rad/s", 1, 1, kSetting},
    {"link map/vx 3", "Section 2.7.2, link map", "vx for wheel 3 at 1 rad/s", "rad/s", -1, -1, kSetting},
    {"link map/vx 4", "Section 2.7.2, link map", "vx for wheel 4 at 1 rad/s", "rad/s", 1, 1, kSetting},
    {"link map/vy 1", "Section 2.7.2, link map", "vy for wheel 1 at 1 rad/s", "rad/s", 1, 1, kSetting},
    {"link map/vy 2", "Section 2.7.2, link map", "vy for wheel 2 at 1 rad/s", "rad/s", 1, 1, kSetting},
    {"link map/vy 3", "Section 2.7.2, link map", "vy for wheel 3 at 1 rad/s", "rad/s", -1, -1, kSetting},
    {"link map/vy 4", "Section 2.7.2, link map", "vy for wheel 4 at 1 rad/s", "rad/s", -1, -1, kSetting},
    // Section 3.2.3.4: human factors.
    {"human/stiffness", "Section 3.2.3.4", "stiffness that feels like a hard wall", "N/cm", 242, kUnbounded},
    {"human/force", "Section 3.2.3.4", "largest force that a human controls, weakest joint to strongest", "N",
     16.5, 102.3},
    {"human/bandwidth", "Section 3.2.3.4", "bandwidth of human force control", "Hz", 20, 30},
    {"human/resolution", "Section 3.2.3.4", "resolution at which a human controls a force", "N", 0, 0.36},
    // Section 3.2.1: the ideal teleoperator.
    {"ideal/position", "Section 3.2.1", "position scale h21 of the ideal teleoperator", "", 1, 1},
    {"ideal/force", "Section 3.2.1", "force scale h12 of the ideal teleoperator", "", 1, 1},
    {"ideal/product", "Section 3.2.3.1", "scaling product", "", 1, 1},
    {"hold/equilibrium", "Section 3.4.1.1", "distance of the pen from the origin to which it converges", "mm",
     0, 1, kMustAgree, 0, kCriterion},
    // Section 3.4.2: smoothing.
    {"smoothing/step", "Section 3.4.2", "step of translation a millisecond, largest axis", "mm", 0.25, 0.25,
     kSetting, 0.1},
    {"smoothing/turn", "Section 3.4.2", "step of rotation a millisecond", "deg", 0.01, 0.01, kSetting, 0.1},
    {"smoothing/threshold", "Appendix B", "largest step of translation that passes unchanged", "mm", 0.5, 0.5,
     kSetting, 0.1},
    {"smoothing/turn threshold", "Appendix B", "largest step of rotation that passes unchanged", "deg", 0.05,
     0.05, kSetting, 0.1},
    // Section 3.4.3: the spheroid of position control, in the device's frame.
    {"spheroid/centre x", "Section 3.4.3, figures 36 and 37", "centre of the spheroid, x", "m", -0.08, -0.08,
     kSetting},
    {"spheroid/centre z", "Section 3.4.3, figures 36 and 37", "centre of the spheroid, z", "m", 0.008, 0.008,
     kSetting},
    {"spheroid/axis x", "Section 3.4.3, figures 36 and 37", "half axis of the spheroid, x", "m", 0.14, 0.14,
     kSetting},
    {"spheroid/axis y", "Section 3.4.3, figures 36 and 37", "half axis of the spheroid, y", "m", 0.1, 0.1,
     kSetting},
    {"spheroid/axis z", "Section 3.4.3, figures 36 and 37", "half axis of the spheroid, z", "m", 0.1, 0.1,
     kSetting},
    {"spheroid/plane x", "Section 3.4.3, figures 36 and 37", "plane x", "m", -0.042, -0.042, kSetting},
    {"spheroid/plane z", "Section 3.4.3, figures 36 and 37", "plane z", "m", -0.066, -0.066, kSetting},
    {"rate/thesis", "Section 3.4.3", "speed of the set-point under rate control, with the thesis' v = 1",
     "m/s", 1, 1, kSetting, 0.5},
    {"rate/default", "Section 3.4.3", "speed of the set-point under rate control, by default", "m/s", 1, 1},
    // Section 3.4.4: deployment.
    {"start/centring", "Section 3.4.4", "stiffness that brings the pen to its origin", "N/m", 40, 40,
     kSetting, 2},
    {"start/x", "Section 3.4.4", "set-point at the end of the approach, x", "m", 0.35, 0.35, kSetting, 2},
    {"start/z", "Section 3.4.4", "set-point at the end of the approach, z", "m", 0.35, 0.35, kSetting, 2},
    {"start/unfolded 1", "Appendix B", "arm joint 1, unfolded", "deg", 169, 169, kSetting, 0.1},
    {"start/unfolded 2", "Appendix B", "arm joint 2, unfolded", "deg", 65, 65, kSetting, 0.1},
    {"start/unfolded 3", "Appendix B", "arm joint 3, unfolded", "deg", -146, -146, kSetting, 0.1},
    {"start/unfolded 4", "Appendix B", "arm joint 4, unfolded", "deg", 102.5, 102.5, kSetting, 0.1},
    {"start/unfolded 5", "Appendix B", "arm joint 5, unfolded", "deg", 167.5, 167.5, kSetting, 0.1},
    {"start/unfolded within", "Section 3.4.4", "distance of a joint at which the arm counts as unfolded",
     "deg", 10, 10},
    {"start/slack", "Section 3.4.4", "vertical force of the spring at which the hand is coupled", "N", 0, 0.1,
     kSetting, 0.1},
    {"start/soft", "Section 3.4.4", "stiffness before the coupling", "N/m", 100, 100, kSetting, 0.1},
    {"start/stiff", "Section 3.4.4", "stiffness in operation", "N/m", 700, 700, kSetting, 0.1},
    {"start/rise", "Section 3.4.4", "rise of the stiffness a millisecond", "N/m", 0.1, 0.1, kSetting, 0.5},
    {"start/turning stiff", "Section 3.4.4", "rotational stiffness in operation", "N·m/rad", 30, 30, kSetting,
     0.1},
    {"start/turning rise", "Section 3.4.4", "rise of the rotational stiffness a millisecond", "N·m/rad",
     0.005, 0.005, kSetting, 0.5},
    {"gripper/closed", "Appendix B", "opening of the gripper with the button pressed", "m", 0.01, 0.01,
     kSetting},
    {"gripper/open", "Appendix B", "opening of the gripper with the button released", "m", 0.02, 0.02,
     kSetting},
    {"start/scale", "Section 3.4.4, appendix B", "force on the robot over force on the hand, kf", "", 10, 10,
     kSetting, 2},
});

/// @throws std::logic_error if the table does not have it.
inline const Printed& printed(std::string_view key) {
  const auto* const found = std::ranges::find(kNumbers, key, &Printed::key);
  if (found == kNumbers.end())
    throw std::logic_error("the thesis' numbers have no '" + std::string(key) + "'");
  return *found;
}
/// A number with both ends equal. @throws std::logic_error as printed().
inline double printed_value(std::string_view key) { return printed(key).from; }

/// By which the printed σ1 = 0.2·√(J·σ0) follows from the printed σ0: about the wheel alone.
inline double implied_inertia_kg_m2() {
  return std::pow(printed_value("ramp/damping") / 0.2, 2) / printed_value("ramp/stiffness");
}

}  // namespace youbot_bench::thesis
