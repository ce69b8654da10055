// The linker substitutes this for runtime::open_robot() in all callers, also in a session or an experiment
// that opens its own robot.
#include "tests/support/watched_open_robot.h"

#include <memory>
#include <utility>

#include "runtime/open_robot.h"
#include "tests/support/watched_robot.h"

namespace runtime {

OpenedRobot open_robot_unwatched(const RobotOptions& options, const hal::Clock& clock,
                                 std::chrono::nanoseconds period) asm("__real_" YOUBOT_OPEN_ROBOT);
OpenedRobot open_robot_watched(const RobotOptions& options, const hal::Clock& clock,
                               std::chrono::nanoseconds period) asm("__wrap_" YOUBOT_OPEN_ROBOT);

namespace {

/// An emulation and its watch, which end together, after the robot.
struct WatchedEmulation {
  explicit WatchedEmulation(std::shared_ptr<sim::bus::YoubotBus> opened)
      : emulation(std::move(opened)), watch(*emulation) {}
  std::shared_ptr<sim::bus::YoubotBus> emulation;
  support::BusWatch watch;
};

int opened_so_far = 0;

}  // namespace

OpenedRobot open_robot_watched(const RobotOptions& options, const hal::Clock& clock,
                               std::chrono::nanoseconds period) {
  OpenedRobot opened = open_robot_unwatched(options, clock, period);
  opened_so_far += opened.emulation || opened.plant || opened.manipulator ? 1 : 0;
  if (opened.emulation) {
    const auto watched = std::make_shared<WatchedEmulation>(opened.emulation);
    opened.robot = watched->watch.over(std::move(opened.robot));
    opened.emulation = {watched, watched->emulation.get()};
  } else if (opened.plant || opened.manipulator) {
    hal::Plant& plant = opened.plant ? static_cast<hal::Plant&>(*opened.plant) : *opened.manipulator;
    const std::vector joints(opened.robot->joints().begin(), opened.robot->joints().end());
    opened.robot = std::make_unique<support::WatchedLoopback>(plant, clock, period, joints);
  }
  return opened;
}

}  // namespace runtime

int support::watched_robots_opened() { return runtime::opened_so_far; }
