// The link's sockets on the loopback interface.
#include "drivers/station/udp_port.h"

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sched.h>
#include <sys/mount.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "drivers/setup_error.h"
#include "drivers/station/endpoint.h"
#include "tests/support/skip.h"
#include "tests/support/temporary_directory.h"

namespace station_udp_port_test {

using namespace drivers::station;
using namespace std::chrono_literals;
using Bytes = std::vector<std::uint8_t>;

/// A port that no program uses at this moment.
std::string free_port() {
  const int socket = ::socket(AF_INET6, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  sockaddr_in6 address{};
  address.sin6_family = AF_INET6;
  socklen_t size = sizeof address;
  EXPECT_EQ(::bind(socket, reinterpret_cast<const sockaddr*>(&address), size), 0);
  EXPECT_EQ(::getsockname(socket, reinterpret_cast<sockaddr*>(&address), &size), 0);
  ::close(socket);
  return std::to_string(ntohs(address.sin6_port));
}

/// The next datagram, waited for; empty if none comes.
Bytes received(UdpPort& port) {
  std::array<std::uint8_t, 64> buffer{};
  for (const auto end = std::chrono::steady_clock::now() + 20s; std::chrono::steady_clock::now() < end;) {
    if (const std::size_t size = port.receive(buffer); size > 0)
      return {buffer.begin(), buffer.begin() + size};
    std::this_thread::sleep_for(1ms);
  }
  return {};
}

void expect_both_ways(UdpPort& robot, UdpPort& operating) {
  operating.send_to_all(Bytes{1, 2, 3});
  EXPECT_EQ(received(robot), (Bytes{1, 2, 3}));
  robot.adopt_sender();
  robot.send(Bytes{4});
  EXPECT_EQ(received(operating), Bytes{4});
  operating.adopt_sender();
  operating.send(Bytes{5, 6});
  EXPECT_EQ(received(robot), (Bytes{5, 6}));
}

/// Both stations find each other over these ports.
void expect_connection(UdpPort& robot_port, UdpPort& operator_port) {
  RobotEndpoint robot(robot_port, Key({1}), {});
  OperatorEndpoint operating(operator_port, Key({1}), {});
  std::chrono::nanoseconds now{};
  for (int i = 0; i < 5000 && !(robot.connected(now) && operating.connected(now)); ++i) {
    now += 1ms;
    (void)operating.poll(now);
    operating.send({.enable = true}, {}, now);
    (void)robot.poll(now);
    robot.send({.enable = true}, {}, now);
  }
  EXPECT_TRUE(robot.connected(now));
  EXPECT_TRUE(operating.connected(now));
}

TEST(StationUdpPort, CarriesBothFamilies) {
  for (const std::string host : {"127.0.0.1", "[::1]"}) {
    SCOPED_TRACE(host);
    const std::string address = host + ":" + free_port();
    UdpPort robot = UdpPort::listening(address);
    UdpPort operating = UdpPort::towards(address);
    expect_both_ways(robot, operating);
  }
}

TEST(StationUdpPort, RefusesWhatIsNoAddress) {
  for (const std::string address : {"", "robot", "robot:", ":7777", "robot:http", "256.1.1.1:7777"})
    EXPECT_THROW((void)UdpPort::towards(address), drivers::SetupError) << address;
}

/// Towards a name with these addresses, which only the calling thread sees in its file of hosts.
UdpPort towards_named(const std::string& port, const std::vector<std::string>& addresses,
                      const std::filesystem::path& hosts) {
  std::ofstream file(hosts);
  for (const std::string& address : addresses) file << address << " robot.test\n";
  file.close();
  EXPECT_EQ(::unshare(CLONE_NEWNS), 0);
  EXPECT_EQ(::mount("none", "/", nullptr, MS_REC | MS_PRIVATE, nullptr), 0);
  EXPECT_EQ(::mount(hosts.c_str(), "/etc/hosts", nullptr, MS_BIND, nullptr), 0);
  return UdpPort::towards("robot.test:" + port);
}

// A name often has an address of IPv6, which comes first, and the robot's station listens at 0.0.0.0.
TEST(StationUdpPort, FindsTheAddressAtWhichTheRobotListens) {
  SKIP_UNLESS(::geteuid() == 0, "needs root, for a mount of its own");
  const support::TemporaryDirectory folder;
  for (const std::string listening : {"127.0.0.1", "[::1]"}) {
    SCOPED_TRACE(listening);
    const std::string port = free_port();
    UdpPort robot = UdpPort::listening(listening + ":" + port);
    std::optional<UdpPort> operating;
    std::thread([&] {
      operating.emplace(towards_named(port, {"::1", "127.0.0.1"}, folder / "hosts"));
    }).join();
    expect_connection(robot, *operating);
  }
}

TEST(StationUdpPort, TriesUpToEightAddresses) {
  SKIP_UNLESS(::geteuid() == 0, "needs root, for a mount of its own");
  const support::TemporaryDirectory folder;
  const std::string port = free_port();
  for (const int last : {8, 9}) {
    std::vector<std::string> addresses;
    for (int i = 1; i <= last; ++i) addresses.push_back("127.0.0." + std::to_string(i));
    UdpPort robot = UdpPort::listening("0.0.0.0:" + port);
    std::optional<UdpPort> operating;
    std::thread([&] { operating.emplace(towards_named(port, addresses, folder / "hosts")); }).join();
    operating->send_to_all(Bytes{7});
    // All reach it: it listens at every address of this machine.
    for (int i = 0; i < 8; ++i) EXPECT_EQ(received(robot), Bytes{7}) << i;
    std::array<std::uint8_t, 64> buffer{};
    EXPECT_EQ(robot.receive(buffer), 0) << last;
  }
}

}  // namespace station_udp_port_test
