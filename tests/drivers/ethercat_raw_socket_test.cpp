// The raw socket over a veth pair. Needs root (CAP_NET_ADMIN to create the pair, CAP_NET_RAW to use it);
// otherwise skipped with a message.
#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <linux/if_packet.h>
#include <net/if.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <ctime>
#include <optional>
#include <thread>

#include "drivers/ethercat/monotonic_clock.h"
#include "drivers/ethercat/raw_socket_link.h"
#include "drivers/ethercat/transceiver.h"
#include "tests/drivers/ethercat_fakes.h"
#include "tests/support/other_master.h"
#include "tests/support/skip.h"

namespace drivers::ethercat::test {
namespace ethercat_raw_socket_test {

bool shell(const std::string& command) { return std::system((command + " >/dev/null 2>&1").c_str()) == 0; }

class RawSocket : public ::testing::TestWithParam<RawSocketLink::Wait> {
 protected:
  void SetUp() override {
    // Interface names have at most 15 characters; the process makes them unique among parallel tests.
    const std::string number = std::to_string(getpid());
    near_ = "ecm" + number;
    far_ = "ecs" + number;
    made_ = shell("ip link add " + near_ + " type veth peer name " + far_);
    SKIP_UNLESS(made_, "no veth pair: needs root and the ip command");
    SKIP_UNLESS(shell("ip link set " + near_ + " up && ip link set " + far_ + " up"), "cannot set it up");
  }
  void TearDown() override {
    if (made_) shell("ip link del " + near_);
  }
  static Bytes frame(std::uint8_t index) {
    FrameWriter writer;
    writer.add(Command::kBrd, index, 0, 2);
    return {writer.bytes().begin(), writer.bytes().end()};
  }

  std::string near_;
  std::string far_;
  bool made_ = false;
};

// A segment of one slave: counts each datagram and sends the frame back. Implemented on separate sockets, so
// that an error in RawSocketLink is not hidden.
class Reflector {
 public:
  explicit Reflector(const std::string& interface) : socket_(socket(AF_PACKET, SOCK_RAW, 0)) {
    sockaddr_ll address{};
    address.sll_family = AF_PACKET;
    address.sll_protocol = htons(kEtherType);
    address.sll_ifindex = static_cast<int>(if_nametoindex(interface.c_str()));
    EXPECT_EQ(bind(socket_, reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
    const timeval wait{0, 20'000};
    setsockopt(socket_, SOL_SOCKET, SO_RCVTIMEO, &wait, sizeof wait);
    thread_ = std::thread([this] { run(); });
  }
  Reflector(const Reflector&) = delete;
  Reflector& operator=(const Reflector&) = delete;
  ~Reflector() {
    stop_ = true;
    thread_.join();
    close(socket_);
  }
  std::atomic<int> seen = 0;

 private:
  void run() {
    std::array<std::uint8_t, 1600> buffer{};
    while (!stop_) {
      sockaddr_ll from{};
      socklen_t from_size = sizeof from;
      const ssize_t size =
          recvfrom(socket_, buffer.data(), buffer.size(), 0, reinterpret_cast<sockaddr*>(&from), &from_size);
      if (size <= 0 || from.sll_pkttype == PACKET_OUTGOING) continue;
      ++seen;
      const auto bytes = std::span(buffer).first(static_cast<std::size_t>(size));
      (void)find_datagram(bytes, [](const Datagram& datagram) {
        ++datagram.counter[0];
        return false;
      });
      buffer[6] |= kReturnedBit;
      (void)!send(socket_, buffer.data(), static_cast<std::size_t>(size), 0);
    }
  }
  int socket_;
  std::atomic<bool> stop_ = false;
  std::thread thread_;
};

TEST_P(RawSocket, FramesGoRoundThroughASegment) {
  Reflector reflector(far_);
  RawSocketLink link(near_, GetParam());
  Transceiver transceiver(link);
  for (const std::size_t length : {std::size_t{2}, std::size_t{500}, kMaxDatagramBytes}) {
    transceiver.begin().add(Command::kBrd, transceiver.index(), 0, length);
    ASSERT_TRUE(transceiver.exchange(30s)) << length;  // long enough for a busy machine
    FrameReader answer = transceiver.answer();
    Datagram datagram;
    ASSERT_TRUE(answer.next(datagram));
    EXPECT_EQ(datagram.working_counter(), 1);
    EXPECT_EQ(datagram.data.size(), length);
  }
  EXPECT_EQ(reflector.seen, 3);
  EXPECT_EQ(transceiver.counters().malformed + transceiver.counters().late + transceiver.counters().lost, 0U);
  EXPECT_EQ(link.last_error(), 0);
  EXPECT_EQ(link.name(), near_);
}

TEST_P(RawSocket, TheKernelSaysHowLongAFrameHasWaited) {
  RawSocketLink near_link(near_, GetParam());
  RawSocketLink far_link(far_, GetParam());
  const std::chrono::nanoseconds before = near_link.now();
  ASSERT_TRUE(far_link.send(frame(7)));
  near_link.wait(20ms);
  std::array<std::uint8_t, 1522> buffer{};
  ASSERT_GT(near_link.receive(buffer, 30s), 0U);
  EXPECT_GT(near_link.frame_age(), 0ns);
  EXPECT_LE(near_link.frame_age(), near_link.now() - before);
}

TEST_P(RawSocket, OwnFramesAreNotDelivered) {
  RawSocketLink link(near_, GetParam());
  std::array<std::uint8_t, 1522> buffer{};
  ASSERT_TRUE(link.send(frame(1)));
  EXPECT_EQ(link.receive(buffer, 20ms), 0U);
}

TEST_P(RawSocket, OtherProtocolsAndInterfacesAreNotDelivered) {
  RawSocketLink near_link(near_, GetParam());
  RawSocketLink far_link(far_, GetParam());
  Bytes other = frame(1);
  other[12] = 0x88;
  other[13] = 0xB5;  // a local experiment's EtherType
  ASSERT_TRUE(far_link.send(other));
  ASSERT_TRUE(far_link.send(frame(7)));
  std::array<std::uint8_t, 1522> buffer{};
  ASSERT_EQ(near_link.receive(buffer, 30s), 60U);
  EXPECT_EQ(buffer[17], 7) << "the other protocol came first";
  EXPECT_EQ(near_link.receive(buffer, 0ms), 0U);
  EXPECT_EQ(far_link.receive(buffer, 0ms), 0U);
}

TEST_P(RawSocket, WaitsForTheGivenTime) {
  RawSocketLink link(near_, GetParam());
  std::array<std::uint8_t, 1522> buffer{};
  const auto begin = monotonic_now();
  EXPECT_EQ(link.receive(buffer, 30ms), 0U);
  EXPECT_GE(monotonic_now() - begin, 30ms);
}

// Of a bus whose replies it knows, so that it polls for a moment first.
TEST_P(RawSocket, BlockingPollsOnlyForAMoment) {
  if (GetParam() == RawSocketLink::Wait::kBusy) return;
  RawSocketLink link(near_, GetParam());
  std::array<std::uint8_t, 1522> buffer{};
  {
    Reflector reflector(far_);
    for (int i = 0; i < 20; ++i) {
      ASSERT_TRUE(link.send(frame(1)));
      ASSERT_GT(link.receive(buffer, 30s), 0U);
    }
  }
  const auto processor_time = [] {
    timespec time{};
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
    return std::chrono::seconds(time.tv_sec) + std::chrono::nanoseconds(time.tv_nsec);
  };
  ASSERT_TRUE(link.send(frame(2)));
  const std::chrono::nanoseconds begin = processor_time();
  EXPECT_EQ(link.receive(buffer, 500ms), 0U);
  EXPECT_LT(processor_time() - begin, 100ms) << "50 µs, and what interrupts add on a busy machine";
}

TEST_P(RawSocket, TakesWhatIsThereWithoutWaiting) {
  RawSocketLink near_link(near_, GetParam());
  RawSocketLink far_link(far_, GetParam());
  std::array<std::uint8_t, 1522> buffer{};
  EXPECT_EQ(near_link.receive(buffer, 0ms), 0U);
  EXPECT_EQ(near_link.receive(buffer, -1ms), 0U);
  ASSERT_TRUE(far_link.send(frame(9)));
  // veth delivers within send(), or on a busy machine later, in a kernel thread.
  std::size_t size = 0;
  for (const auto end = monotonic_now() + 60s; size == 0 && monotonic_now() < end;)
    size = near_link.receive(buffer, 0ms);
  EXPECT_EQ(size, 60U);
}

TEST_P(RawSocket, AnInterfaceThatGoesDownIsReported) {
  RawSocketLink link(near_, GetParam());
  ASSERT_TRUE(shell("ip link set " + near_ + " down"));
  EXPECT_FALSE(link.send(frame(1)));
  EXPECT_EQ(link.last_error(), ENETDOWN);
  std::array<std::uint8_t, 1522> buffer{};
  EXPECT_EQ(link.receive(buffer, 1ms), 0U);
  ASSERT_TRUE(shell("ip link set " + near_ + " up"));
  Reflector reflector(far_);
  // The peer's carrier comes back a moment after "up": as often as it takes, but not for ever.
  std::size_t size = 0;
  for (int tries = 0; tries < 1200 && size == 0; ++tries)
    if (link.send(frame(2))) size = link.receive(buffer, 50ms);
  EXPECT_EQ(size, 60U) << "the socket does not recover by itself";
}

TEST_P(RawSocket, AnInterfaceThatIsDownSaysWhatToDo) {
  ASSERT_TRUE(shell("ip link set " + near_ + " down"));
  EXPECT_EQ(error_of([&] { RawSocketLink(near_, GetParam()); }),
            near_ + ": open: the interface is down; 'ip link set " + near_ + " up'");
}

TEST_P(RawSocket, AMissingInterfaceSaysWhatToDo) {
  EXPECT_EQ(error_of([&] { RawSocketLink("nosuchif0", GetParam()); }),
            "nosuchif0: find the interface: No such device; 'ip link' lists the interfaces there are");
}

TEST_P(RawSocket, WhatCannotBeANameIsRefused) {
  for (const std::string name : {"", "a-name-of-more-than-15"})
    EXPECT_EQ(error_of([&] { RawSocketLink(name, GetParam()); }),
              "'" + name + "': open: not the name of a network interface");
}

TEST_P(RawSocket, WithoutPermissionItSaysWhatToDo) {
  // In a child, which gives its rights up for good.
  const pid_t child = fork();
  if (child == 0) {
    if (setuid(65534) != 0) _exit(3);
    const std::string error = error_of([&] { RawSocketLink(near_, GetParam()); });
    const std::string expected =
        near_ +
        ": open a raw socket: Operation not permitted; give the program CAP_NET_RAW (setcap "
        "cap_net_raw+ep) or run it as root";
    _exit(error == expected ? 0 : 1);
  }
  int status = 0;
  ASSERT_EQ(waitpid(child, &status, 0), child);
  EXPECT_TRUE(WIFEXITED(status));
  EXPECT_EQ(WEXITSTATUS(status), 0);
}

TEST_P(RawSocket, ASecondMasterIsRefusedUntilTheFirstHasEnded) {
  std::optional<RawSocketLink> first(std::in_place, near_, GetParam());
  const RawSocketLink other_end(far_, GetParam());
  const std::string refusal =
      near_ + ": lock the interface: expected no other master on this bus, found test_drivers (process " +
      std::to_string(getpid()) + " of root); two would disturb each other: end that one first";
  for (int attempt = 0; attempt < 20; ++attempt)
    EXPECT_EQ(error_of([&] { RawSocketLink(near_, GetParam()); }), refusal);
  first.reset();
  EXPECT_NO_THROW(RawSocketLink(near_, GetParam()));
}

// On the same interface its answers come to us too; at the other end of the line its frames do.
TEST_P(RawSocket, AMasterThatIsAtWorkAlreadyIsNamed) {
  for (const bool same_interface : {true, false}) {
    const Reflector segment(far_);
    const support::OtherMaster other(same_interface ? near_ : far_);
    std::string error;
    // A busy machine may not let the other program send within the time that is listened for.
    for (int attempt = 0; attempt < 100 && error.empty(); ++attempt)
      error = error_of([&] { RawSocketLink(near_, GetParam()); });
    EXPECT_TRUE(contains(error, near_ + ": listen for 0.1 s: another EtherCAT master is on this bus ("));
    EXPECT_TRUE(contains(error, "frames from 01:01:01:01:01:01)"));
  }
}

TEST_P(RawSocket, AMasterThatWasKilledLeavesTheInterface) {
  std::array<int, 2> ends{};
  ASSERT_EQ(pipe(ends.data()), 0);
  const pid_t child = fork();
  if (child == 0) {
    const RawSocketLink link(near_, GetParam());
    (void)!write(ends[1], "", 1);
    for (;;) pause();
  }
  close(ends[1]);
  char ready = 0;
  ASSERT_EQ(read(ends[0], &ready, 1), 1);
  close(ends[0]);
  EXPECT_THROW(RawSocketLink(near_, GetParam()), InterfaceInUse);
  kill(child, SIGKILL);
  ASSERT_EQ(waitpid(child, nullptr, 0), child);
  EXPECT_NO_THROW(RawSocketLink(near_, GetParam()));
}

TEST_P(RawSocket, SendAndReceiveDoNotAllocateOrLock) {
  RawSocketLink near_link(near_, GetParam());
  RawSocketLink far_link(far_, GetParam());
  const Bytes sent = frame(3);
  std::array<std::uint8_t, 1522> buffer{};
  long violations = 0;
  int received = 0;
  {
    const support::NoAllocGuard guard;
    // A busy machine may deliver some late.
    for (int i = 0; i < 10 || (received == 0 && i < 10'000); ++i) {
      far_link.send(sent);
      if (near_link.receive(buffer, 1ms) > 0) ++received;
      (void)near_link.receive(buffer, 100us);
    }
    violations = guard.violations();
  }
  EXPECT_EQ(violations, 0);
  EXPECT_GT(received, 0);
}

INSTANTIATE_TEST_SUITE_P(Waiting, RawSocket,
                         ::testing::Values(RawSocketLink::Wait::kBlock, RawSocketLink::Wait::kBusy),
                         [](const auto& test) {
                           return test.param == RawSocketLink::Wait::kBlock ? "Blocking" : "Busy";
                         });

}  // namespace ethercat_raw_socket_test
}  // namespace drivers::ethercat::test
