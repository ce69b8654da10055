// Relays datagrams between two stations like a bad network:
//   udp_relay LISTEN_PORT TARGET_HOST TARGET_PORT SEED
// Each line on its input sets the conditions from then on, and is answered with one line:
//   DELAY_MS JITTER_MS LOSS REPEATED   of one way; LOSS and REPEATED are shares
//   silent | heard                     nothing passes; the last conditions again
// Ends with its input.
#include <arpa/inet.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <iostream>
#include <sstream>
#include <string>

#include "hal/clock.h"
#include "sim/datagram_channel.h"

namespace {

using std::chrono::nanoseconds;

int bound_socket(std::uint16_t port) {
  const int made = socket(AF_INET, SOCK_DGRAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(port);
  if (made < 0 || bind(made, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0) {
    std::perror("udp_relay: bind");
    std::exit(3);
  }
  // A relay that does not run for a while loses nothing of its own.
  const int bytes = 1 << 22;
  (void)setsockopt(made, SOL_SOCKET, SO_RCVBUF, &bytes, sizeof bytes);
  return made;
}

/// From one socket into a channel, and from the channel to the other station.
struct Way {
  Way(int from, int to, std::uint64_t seed) : in(from), out(to), channel({}, seed) {}
  void pass(nanoseconds now) {
    std::array<std::uint8_t, 2048> bytes{};
    sockaddr_in sender{};
    socklen_t size = sizeof sender;
    for (ssize_t count = 0; (count = recvfrom(in, bytes.data(), bytes.size(), 0,
                                              reinterpret_cast<sockaddr*>(&sender), &size)) >= 0;
         size = sizeof sender) {
      last_sender = sender;
      channel.send(std::span(bytes).first(static_cast<std::size_t>(count)), now);
    }
    while (const std::size_t count = channel.receive(bytes, now))
      if (target.sin_port != 0)
        (void)sendto(out, bytes.data(), count, 0, reinterpret_cast<const sockaddr*>(&target), sizeof target);
  }
  int in;
  int out;
  sim::DatagramChannel channel;
  sockaddr_in target{};
  sockaddr_in last_sender{};
};

}  // namespace

int main(int argc, char** argv) {
  if (argc != 5) return 2;
  const int at_operator = bound_socket(static_cast<std::uint16_t>(std::atoi(argv[1])));
  const int at_robot = bound_socket(0);
  const auto seed = static_cast<std::uint64_t>(std::atoi(argv[4]));
  Way to_robot(at_operator, at_robot, 2 * seed);
  Way to_operator(at_robot, at_operator, 2 * seed + 1);
  to_robot.target.sin_family = AF_INET;
  to_robot.target.sin_port = htons(static_cast<std::uint16_t>(std::atoi(argv[3])));
  if (inet_pton(AF_INET, argv[2], &to_robot.target.sin_addr) != 1) return 2;
  const hal::SteadyClock clock;
  std::puts("relaying");
  std::fflush(stdout);
  for (;;) {
    std::array<pollfd, 3> ready{pollfd{STDIN_FILENO, POLLIN, 0}, pollfd{at_operator, POLLIN, 0},
                                pollfd{at_robot, POLLIN, 0}};
    const nanoseconds next = std::min(to_robot.channel.next(), to_operator.channel.next());
    // A millisecond is short against every delay that is asked for.
    const int wait_ms = next == nanoseconds::max() ? 100 : next > clock.now() ? 1 : 0;
    (void)poll(ready.data(), ready.size(), wait_ms);
    if (ready[0].revents != 0) {
      std::string line;
      if (!std::getline(std::cin, line)) return 0;
      if (line == "silent" || line == "heard") {
        to_robot.channel.set_silent(line == "silent");
        to_operator.channel.set_silent(line == "silent");
      } else {
        std::istringstream words(line);
        double delay_ms = 0;
        double jitter_ms = 0;
        sim::NetworkConditions conditions;
        words >> delay_ms >> jitter_ms >> conditions.loss >> conditions.repeated;
        conditions.delay = nanoseconds(static_cast<std::int64_t>(1e6 * delay_ms));
        conditions.jitter = nanoseconds(static_cast<std::int64_t>(1e6 * jitter_ms));
        to_robot.channel.set(conditions);
        to_operator.channel.set(conditions);
      }
      std::printf("now %s\n", line.c_str());
      std::fflush(stdout);
    }
    const nanoseconds now = clock.now();
    to_robot.pass(now);
    to_operator.target = to_robot.last_sender;
    to_operator.pass(now);
  }
}
