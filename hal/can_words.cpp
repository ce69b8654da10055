// Texts of the CAN robot.
#include <cmath>
#include <system_error>

#include "drivers/can/bus_error.h"
#include "drivers/can/frame_time.h"
#include "drivers/tmcl/axis_parameters.h"
#include "drivers/tmcl/telegram.h"
#include "hal/can_robot.h"

namespace hal {
namespace {

namespace can = drivers::can;
namespace tmcl = drivers::tmcl;
using std::chrono::nanoseconds;

constexpr double kBusShare = 0.8;
constexpr int kTelegramBytes = 7;

}  // namespace

nanoseconds shortest_can_period(std::uint32_t bit_per_s, int requests_per_cycle) noexcept {
  const nanoseconds busy = 2 * requests_per_cycle * can::frame_time(kTelegramBytes, bit_per_s);
  return nanoseconds(std::llround(static_cast<double>(busy.count()) / kBusShare));
}

std::string describe_can(const CycleStatus& status) {
  std::string what = describe(status.fault);
  if (status.fault == Fault::kFrameLost) {
    const can::BusError error{status.detail & 0xFFFFU, {}};
    if (error.any()) return what + ": " + describe(error);
    const auto number = static_cast<int>(status.detail >> 16);
    return number == 0 ? what : what + ": " + std::generic_category().message(number);
  }
  if (status.fault != Fault::kJointFault) return what;
  if (status.joint_fault() != JointFault::kRefused) return describe(status.joint_fault());
  const auto command = static_cast<tmcl::Command>(status.detail >> 24);
  const auto number = static_cast<std::uint8_t>(status.detail >> 16);
  std::string refused = name(command);
  const bool axis =
      command == tmcl::Command::kSetAxisParameter || command == tmcl::Command::kGetAxisParameter;
  if (const tmcl::AxisParameter* parameter = tmcl::find_drive_parameter(number); axis && parameter != nullptr)
    refused += " " + std::string(parameter->name);
  return refused + " (" + std::to_string(number) +
         ") refused: " + tmcl::describe(static_cast<tmcl::Status>(status.detail >> 8 & 0xFFU));
}

}  // namespace hal
