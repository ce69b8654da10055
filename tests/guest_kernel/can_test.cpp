// TMCL over the kernel's own CAN, on a virtual interface: an emulated module at its other end answers in real
// time. The interface exists when the guest has started.
#include <gtest/gtest.h>
#include <linux/can/raw.h>
#include <net/if.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <optional>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>

#include "drivers/can/interface_bitrate.h"
#include "drivers/can/socket_can.h"
#include "drivers/interface_lock.h"
#include "drivers/tmcl/can_transport.h"
#include "drivers/tmcl/client.h"
#include "hal/can_robot.h"
#include "hal/setup_error.h"
#include "sim/can/bench_rig.h"
#include "tests/guest_kernel/wait_until.h"

namespace guest {
namespace can_test {

using namespace std::chrono_literals;
using drivers::can::Received;
using drivers::can::SocketCan;
using drivers::can::SocketCanOptions;
using std::chrono::steady_clock;

constexpr const char* kInterface = "vcan0";

ifreq request_for_interface() {
  ifreq request{};
  std::string(kInterface).copy(request.ifr_name, IFNAMSIZ - 1);
  return request;
}

/// A raw socket that receives everything and sends anything.
class OpenSocket {
 public:
  OpenSocket() : socket_(::socket(PF_CAN, SOCK_RAW | SOCK_CLOEXEC, CAN_RAW)) {
    sockaddr_can address{};
    address.can_family = AF_CAN;
    address.can_ifindex = static_cast<int>(::if_nametoindex(kInterface));
    if (::bind(socket_, reinterpret_cast<const sockaddr*>(&address), sizeof(address)) != 0)
      throw std::runtime_error("no CAN socket on vcan0: are vcan and can-raw loaded?");
  }
  OpenSocket(const OpenSocket&) = delete;
  OpenSocket& operator=(const OpenSocket&) = delete;
  ~OpenSocket() { ::close(socket_); }

  bool send(const can_frame& frame) { return ::write(socket_, &frame, sizeof(frame)) == sizeof(frame); }
  bool send(canid_t id) {
    can_frame frame{};
    frame.can_id = id;
    frame.can_dlc = 7;
    return send(frame);
  }
  bool receive(can_frame& frame, std::chrono::milliseconds timeout) {
    pollfd entry{socket_, POLLIN, 0};
    return ::poll(&entry, 1, static_cast<int>(timeout.count())) > 0 &&
           ::recv(socket_, &frame, sizeof(frame), MSG_DONTWAIT) == sizeof(frame);
  }

 private:
  int socket_;
};

/// The module and its joint. Time passes in it as it does outside.
class ModuleOnTheBus {
 public:
  ModuleOnTheBus()
      : thread_([this](const std::stop_token& stop) {
          auto before = steady_clock::now();
          while (!stop.stop_requested()) {
            can_frame frame{};
            if (socket_.receive(frame, 1ms)) (void)rig_.send(frame);
            const auto now = steady_clock::now();
            rig_.advance(now - std::exchange(before, now));
            while (rig_.receive(frame)) (void)socket_.send(frame);
          }
        }) {}

 private:
  sim::can::BenchRig rig_;
  OpenSocket socket_;
  std::jthread thread_;
};

struct TmclOverCan {
  drivers::tmcl::CanTransport transport{SocketCan(SocketCanOptions{.interface = kInterface})};
  drivers::tmcl::SteadyClock clock;
  drivers::tmcl::Client client{transport, clock, {.timeout = 500ms, .tries = 2}};
};

void set_interface_up(bool up) {
  const int any = ::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  ifreq request = request_for_interface();
  EXPECT_EQ(::ioctl(any, SIOCGIFFLAGS, &request), 0);
  request.ifr_flags = static_cast<short>(up ? request.ifr_flags | IFF_UP : request.ifr_flags & ~IFF_UP);
  EXPECT_EQ(::ioctl(any, SIOCSIFFLAGS, &request), 0);
  ::close(any);
}

/// The others need it up.
struct InterfaceDown {
  InterfaceDown() { set_interface_up(false); }
  ~InterfaceDown() { set_interface_up(true); }
};

TEST(CanInKernel, ModuleIsIdentifiedAndKeepsItsSettings) {
  const ModuleOnTheBus module;
  TmclOverCan tmcl;
  EXPECT_EQ(tmcl.client.version(), (drivers::tmcl::FirmwareVersion{1610, 148}));
  const auto& acceleration = drivers::tmcl::drive_parameter("motor_acceleration");
  for (const int value : {2000, 12345}) {
    tmcl.client.set(acceleration, value);
    EXPECT_EQ(tmcl.client.get(acceleration), value);
  }
}

TEST(CanInKernel, SilenceIsAnErrorThatNamesTheModule) {
  TmclOverCan tmcl;
  try {
    tmcl.client.get(drivers::tmcl::drive_parameter("actual_speed"));
    FAIL() << "no module answers";
  } catch (const drivers::SetupError& error) {
    EXPECT_EQ(error.report().device, "vcan0, module 1");
    EXPECT_EQ(error.report().expected, "a reply within 500 ms, 2 tries");
    EXPECT_EQ(error.report().found, "none");
    EXPECT_NE(error.report().step.find("actual_speed"), std::string::npos) << error.what();
  }
}

TEST(CanInKernel, OnlyTheReplysIdentifierPassesTheFilter) {
  SocketCan socket({.interface = kInterface, .receive_id = 2});
  OpenSocket others;
  for (const canid_t id : {canid_t{1}, canid_t{3}, canid_t{0x402}, 2 | CAN_EFF_FLAG, 2 | CAN_RTR_FLAG})
    ASSERT_TRUE(others.send(id));
  ASSERT_TRUE(others.send(canid_t{2}));
  can_frame frame{};
  EXPECT_EQ(socket.receive(frame, 1s), Received::kFrame);
  EXPECT_EQ(frame.can_id, 2U);
  EXPECT_EQ(frame.can_dlc, 7);
  EXPECT_EQ(socket.receive(frame, 0ns), Received::kNothing);
}

TEST(CanInKernel, InterfaceThatIsDownIsExplainedAtTheOpening) {
  const InterfaceDown down;
  try {
    SocketCan socket({.interface = kInterface});
    FAIL() << "opened";
  } catch (const drivers::SetupError& error) {
    EXPECT_EQ(error.report().device, "vcan0");
    EXPECT_EQ(error.report().found, "it down");
    EXPECT_NE(error.report().hint.find("ip link set vcan0 up"), std::string::npos) << error.what();
  }
}

TEST(CanInKernel, InterfaceThatGoesDownFailsTheNextCallAndWorksAgainWhenItIsBack) {
  SocketCan socket({.interface = kInterface, .receive_id = 2});
  can_frame frame{};
  frame.can_id = 1;
  EXPECT_TRUE(socket.send(frame, 0ns));
  {
    const InterfaceDown down;
    EXPECT_EQ(socket.receive(frame, 1s), Received::kFailed);
    EXPECT_EQ(socket.last_error(), ENETDOWN);
    EXPECT_FALSE(socket.send(frame, 0ns));
    EXPECT_EQ(socket.last_error(), ENETDOWN);
  }
  EXPECT_TRUE(socket.send(frame, 0ns));
  ASSERT_TRUE(OpenSocket().send(canid_t{2}));
  EXPECT_EQ(socket.receive(frame, 1s), Received::kFrame);
}

TEST(CanInKernel, OtherInterfacesAreRefused) {
  EXPECT_THROW(SocketCan({.interface = "vcan9"}), drivers::SetupError);
  try {
    SocketCan socket({.interface = "lo"});
    FAIL() << "opened";
  } catch (const drivers::SetupError& error) {
    EXPECT_EQ(error.report().found, "another kind of network interface");
  }
}

TEST(CanInKernel, ASecondProgramOfOursIsRefusedUntilTheFirstHasEnded) {
  std::optional<SocketCan> first(std::in_place, SocketCanOptions{.interface = kInterface});
  std::optional<SocketCan> moved(std::move(*first));
  first.reset();
  hal::SteadyClock clock;
  const auto robot = hal::make_can_robot(kInterface, {}, clock, 10ms);
  try {
    robot->activate();
    ADD_FAILURE() << "it would take the other's replies for its joint's position";
  } catch (const hal::SetupError& error) {
    EXPECT_NE(std::string(error.what())
                  .find("vcan0: lock the interface: expected no other master on this bus, found guest_tests "
                        "(process " +
                        std::to_string(::getpid()) + " of root)"),
              std::string::npos)
        << error.what();
  }
  EXPECT_THROW(SocketCan({.interface = kInterface}), drivers::InterfaceInUse);
  moved.reset();
  EXPECT_NO_THROW(SocketCan({.interface = kInterface}));
}

TEST(CanInKernel, VirtualInterfaceHasNoBitRate) {
  EXPECT_EQ(drivers::can::interface_bitrate(::if_nametoindex(kInterface)), std::nullopt);
}

// In real time on a processor that is emulated: periods and patience are long, and how much of them was
// needed is not looked at.
TEST(CanInKernel, RobotTurnsItsJoint) {
  const ModuleOnTheBus module;
  hal::SteadyClock clock;
  constexpr auto kPeriod = 10ms;
  const auto robot =
      hal::make_can_robot(kInterface, {.patience_cycles = 50, .tolerated_cycles = 500}, clock, kPeriod);
  robot->activate();
  hal::RobotCommand command;
  hal::RobotSample sample;
  const auto cycle_until = [&](auto&& condition) {
    auto deadline = clock.now();
    return wait_until([&] {
      clock.sleep_until(deadline += kPeriod);
      const hal::CycleStatus status = robot->exchange(command, sample);
      EXPECT_TRUE(status.ok()) << hal::describe_can(status);
      return !status.ok() || condition();
    });
  };
  command.enable = true;
  ASSERT_TRUE(cycle_until([&] { return sample.enabled; }));
  const double start_rad = sample.joints[0].position_rad;
  command.joints[0] = hal::JointCommand::velocity_rad_per_s(2);
  EXPECT_TRUE(cycle_until([&] { return sample.joints[0].position_rad > start_rad + 1; }));
  EXPECT_NEAR(sample.joints[0].velocity_rad_per_s, 2, 0.2);
  robot->deactivate();
  EXPECT_TRUE(robot->report().empty()) << "the module acknowledged the stop";
}

TEST(CanInKernel, RobotWithoutAModuleIsRefused) {
  hal::SteadyClock clock;
  const auto robot = hal::make_can_robot(kInterface, {}, clock, 10ms);
  EXPECT_THROW(robot->activate(), hal::SetupError);
}

}  // namespace can_test
}  // namespace guest
