#include "apps/youbot_bench/bus.h"

#include <stdexcept>

#include "drivers/ethercat/raw_socket_link.h"
#include "runtime/open_robot.h"
#include "sim/bus/bus_link.h"

namespace youbot_bench {
namespace {

/// Sleeping advances the emulated robot's time.
class EmulatedClock final : public hal::Clock {
 public:
  explicit EmulatedClock(sim::bus::YoubotBus& emulation) : emulation_(emulation) {}
  std::chrono::nanoseconds now() const noexcept override { return emulation_.wire().now(); }
  void sleep_until(std::chrono::nanoseconds deadline) noexcept override {
    if (deadline > now()) emulation_.advance(deadline - now());
  }

 private:
  sim::bus::YoubotBus& emulation_;
};

}  // namespace

Bus open_bus(const std::string& robot) {
  runtime::check_robot_name(robot);
  if (robot == "wire") {
    Bus bus;
    bus.emulation = std::make_unique<sim::bus::YoubotBus>(
        sim::bus::YoubotBusOptions{.robot = drivers::tmcl::YoubotKind::kBaseAndArm});
    bus.link = std::make_unique<sim::bus::BusLink>(bus.emulation->wire(), bus.emulation.get());
    bus.clock = std::make_unique<EmulatedClock>(*bus.emulation);
    return bus;
  }
  if (!robot.starts_with(runtime::kEthercatPrefix))
    throw std::invalid_argument("--robot: this command needs an EtherCAT bus, wire or ethercat:IFACE, and " +
                                robot + " has none");
  using drivers::ethercat::RawSocketLink;
  return {.emulation = nullptr,
          .link = std::make_unique<RawSocketLink>(robot.substr(runtime::kEthercatPrefix.size()),
                                                  RawSocketLink::Wait::kBlock),
          .clock = std::make_unique<hal::SteadyClock>()};
}

}  // namespace youbot_bench
