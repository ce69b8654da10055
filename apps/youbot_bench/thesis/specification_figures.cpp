// Tables 1 and 2: the makers' data beside what control and simulation use.
#include <spdlog/fmt/fmt.h>

#include <numbers>
#include <string>
#include <vector>

#include "apps/youbot_bench/thesis/chapters.h"
#include "control/rate_boundary.h"
#include "control/robot_model.h"
#include "control/teleoperation.h"
#include "hal/youbot_axes.h"
#include "operation/config.h"
#include "runtime/open_haptic.h"
#include "sim/hand.h"

namespace youbot_bench::thesis {
namespace {

constexpr double kDegrees = 180 / std::numbers::pi;

Figure omega() {
  const control::RateBoundary boundary;
  Figure figure{
      .number = "Table 1",
      .caption = "Data of the omega.6",
      .text =
          "Beside them the surface in which the thesis itself has position control (3.4.3), and the "
          "simulated device."};
  figure.compared = {
      compare(
          "omega/width", 2e3 * boundary.half_axes_m.y(),
          "The thesis contradicts itself: the spheroid that it fitted to the handle's travel is wider than "
          "the maker's data. Ours is the fitted one."),
      compare(
          "omega/depth", 1e3 * (boundary.centre_H_m.x() + boundary.half_axes_m.x() - boundary.least_x_m),
          "Between the plane and the far end of the thesis' spheroid; the device reaches a little further."),
      compare("omega/force", runtime::HapticOptions{}.force_limit_N,
              "Ours is limited by default; haptic.force_limit_N takes up to what the device has."),
      compare("omega/stiffness", 1e-3 * sim::GripTravel{}.stiffness_N_per_m)};
  return figure;
}

Figure youbot() {
  Figure figure{
      .number = "Table 2",
      .caption = "Data of the youBot",
      .text = "Beside them the robot description in control/youbot.urdf and the axes in hal/youbot_axes.h."};
  // Table 2 counts from the upright arm, the description from the end stop at which homing ends.
  const control::ArmVector upright_rad = control::Teleoperation::Config{}.unfolded_rad;
  const auto ranges = control::RobotModel().ranges();
  for (std::size_t i = 0; i < ranges.size(); ++i) {
    const std::string joint = fmt::format("youbot/joint {}, ", i + 1);
    const double from_rad = upright_rad[static_cast<Eigen::Index>(i)];
    figure.compared.push_back(compare(joint + "lower", kDegrees * (ranges[i].lower_rad - from_rad)));
    figure.compared.push_back(compare(joint + "upper", kDegrees * (ranges[i].upper_rad - from_rad)));
  }
  figure.compared.push_back(compare("youbot/arm speed", kDegrees * hal::kArmSpeedLimit_rad_per_s));
  figure.compared.push_back(compare(
      "youbot/base speed", hal::kWheelAxis.speed_limit_rad_per_s * control::BaseGeometry{}.wheel_radius_m,
      "4000 revolutions a minute of the motor, through the gear, on a wheel of 47.5 mm."));
  figure.compared.push_back(compare("youbot/encoder", hal::kWheelAxis.constants.ticks_per_motor_rev));
  return figure;
}

}  // namespace

std::vector<Figure> specifications(const Workshop& workshop) {
  workshop.begin("makers' data");
  return {omega(), youbot()};
}

}  // namespace youbot_bench::thesis
