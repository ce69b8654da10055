// Delays calculated by hand, then trees of slaves through a model of the cable, then emulated slaves.
#include <gtest/gtest.h>

#include <memory>
#include <random>
#include <vector>

#include "drivers/ethercat/bus_error.h"
#include "drivers/ethercat/bus_scan.h"
#include "drivers/ethercat/distributed_clocks.h"
#include "drivers/ethercat/pre_op_bus.h"
#include "drivers/ethercat/registers.h"
#include "sim/bus/bus_link.h"
#include "tests/support/no_alloc_guard.h"

namespace drivers::ethercat {
namespace ethercat_distributed_clocks_test {

using std::chrono::nanoseconds;
using namespace std::chrono_literals;

constexpr std::uint16_t kClock = 0x000C;       // distributed clock, 64 bits
constexpr std::uint16_t kShortClock = 0x0004;  // 32 bits

Slave slave(std::uint16_t position, std::uint16_t parent, std::uint8_t parent_port,
            std::initializer_list<int> open_ports, std::uint16_t features = kClock) {
  Slave result;
  result.position = position;
  result.station = static_cast<std::uint16_t>(0x1000 + position);
  result.parent = parent;
  result.parent_port = parent_port;
  result.features = features;
  result.sii.name = "EL" + std::to_string(position);
  for (const int port : open_ports)
    result.dl_status = static_cast<std::uint16_t>(result.dl_status | 1 << (9 + 2 * port));
  return result;
}

std::vector<std::uint32_t> delays_of(const ClockPlan& plan) {
  std::vector<std::uint32_t> delays;
  for (const ClockSetting& setting : plan.slaves) delays.push_back(setting.delay_ns);
  return delays;
}

TEST(ClockPlan, ALineByHand) {
  // 1 sees the frame again after 1800 ns, 2 after 900, 3 turns it round: 450 ns per hop.
  const std::vector<Slave> slaves{slave(1, 0, 0, {0, 1}), slave(2, 1, 1, {0, 1}), slave(3, 2, 1, {0})};
  const std::vector<ClockLatch> latches{
      {{1'000, 2'800, 0, 0}, 1'000}, {{500'000, 500'900, 0, 0}, 0x1'0007'A120}, {{7, 0, 0, 0}, 7}};
  const ClockPlan plan = plan_clocks(slaves, latches, 10'000);
  EXPECT_EQ(plan.reference, 0U);
  EXPECT_EQ(delays_of(plan), (std::vector<std::uint32_t>{0, 450, 900}));
  EXPECT_EQ(plan.slaves[0].offset_ns, 9'000U);
  EXPECT_EQ(plan.slaves[1].offset_ns, 10'450 - std::uint64_t{0x1'0007'A120});
  EXPECT_EQ(plan.slaves[2].offset_ns, 10'893U);
  EXPECT_TRUE(plan.doubts.empty());
}

TEST(ClockPlan, ABranchByHand) {
  // 1 has 2 at port 3, served first (hop 300, out and back 600), and 3 at port 1 behind it (hop 500).
  const std::vector<Slave> slaves{slave(1, 0, 0, {0, 3, 1}), slave(2, 1, 3, {0}), slave(3, 1, 1, {0})};
  const std::vector<ClockLatch> latches{{{100, 100 + 600 + 1000, 0, 100 + 600}, 100}, {{0}, 0}, {{0}, 0}};
  EXPECT_EQ(delays_of(plan_clocks(slaves, latches, 0)), (std::vector<std::uint32_t>{0, 300, 600 + 500}));
}

TEST(ClockPlan, LocalClocksMayWrapWithinTheFrame) {
  const std::vector<Slave> slaves{slave(1, 0, 0, {0, 1}), slave(2, 1, 1, {0})};
  const std::vector<ClockLatch> latches{{{0xFFFF'FF00, 0x0000'0100, 0, 0}, 0xFFFF'FF00}, {{5}, 5}};
  EXPECT_EQ(delays_of(plan_clocks(slaves, latches, 0)), (std::vector<std::uint32_t>{0, 256}));
}

TEST(ClockPlan, TheFirstClockIsTheReferenceAndOthersAreLeftAlone) {
  const std::vector<Slave> slaves{slave(1, 0, 0, {0, 1}, 0), slave(2, 1, 1, {0, 1}),
                                  slave(3, 2, 1, {0, 1}, 0), slave(4, 3, 1, {0})};
  const std::vector<ClockLatch> latches{{}, {{0, 1800, 0, 0}, 0}, {}, {{0}, 0}};
  const ClockPlan plan = plan_clocks(slaves, latches, 0);
  EXPECT_EQ(plan.reference, 1U);
  EXPECT_EQ(delays_of(plan), (std::vector<std::uint32_t>{0, 0, 0, 900}));  // through slave 3, in a line
  EXPECT_EQ(plan.slaves[0], ClockSetting{});
  EXPECT_EQ(plan.slaves[2], ClockSetting{});
  ASSERT_EQ(plan.doubts.size(), 1U);
  EXPECT_NE(plan.doubts[0].find("slave 4 (EL4): slaves without clock"), std::string::npos);
}

TEST(ClockPlan, WithoutAClockThereIsNothingToDo) {
  const std::vector<Slave> slaves{slave(1, 0, 0, {0}, 0)};
  const ClockPlan plan = plan_clocks(slaves, std::vector<ClockLatch>(1), 5);
  EXPECT_FALSE(plan.reference);
  EXPECT_TRUE(register_writes(plan).empty());
  EXPECT_FALSE(plan_clocks({}, {}, 0).reference);
}

TEST(ClockPlan, AShortClockGetsAShortOffset) {
  const std::vector<Slave> slaves{slave(1, 0, 0, {0, 1}), slave(2, 1, 1, {0}, kShortClock)};
  const std::vector<ClockLatch> latches{{{0, 200, 0, 0}, 0}, {{50}, 50}};
  EXPECT_EQ(plan_clocks(slaves, latches, 0x1'2345'6789).slaves[1].offset_ns, 0x2345'6789U + 100 - 50);
}

TEST(ClockPlan, AnImpossibleMeasurementIsDoubtedAndNotUsed) {
  const std::vector<Slave> slaves{slave(1, 0, 0, {0, 1}), slave(2, 1, 1, {0, 1}), slave(3, 2, 1, {0})};
  // The inner loop takes longer than the outer one.
  const std::vector<ClockLatch> latches{{{0, 900, 0, 0}, 0}, {{0, 1800, 0, 0}, 0}, {{0}, 0}};
  const ClockPlan plan = plan_clocks(slaves, latches, 0);
  EXPECT_EQ(plan.slaves[1].delay_ns, 0U);
  ASSERT_EQ(plan.doubts.size(), 1U);
  EXPECT_NE(plan.doubts[0].find("slave 2 (EL2): -450 ns from slave 1 (EL1) port 1 cannot be"),
            std::string::npos);
}

TEST(ClockPlan, CablingThatPointsAtItselfIsHarmless) {
  const std::vector<Slave> slaves{slave(1, 2, 1, {0, 1}), slave(2, 2, 1, {0}), slave(3, 9, 1, {0})};
  EXPECT_EQ(plan_clocks(slaves, std::vector<ClockLatch>(3), 0).doubts.size(), 2U);
}

TEST(ClockPlan, WritesOffsetDelayAndSpeedCounter) {
  ClockPlan plan;
  plan.slaves = {{}, {true, 0x01020304, 0x1122334455667788}};
  const std::vector<ClockWrite> writes = register_writes(plan);
  ASSERT_EQ(writes.size(), 3U);
  EXPECT_EQ(writes[0].slave, 1U);
  EXPECT_EQ(writes[0].address, 0x0920);
  EXPECT_EQ(writes[0].length, 8);
  EXPECT_EQ(writes[0].data, (std::array<std::uint8_t, 8>{0x88, 0x77, 0x66, 0x55, 0x44, 0x33, 0x22, 0x11}));
  EXPECT_EQ(writes[1].address, 0x0928);
  EXPECT_EQ(writes[1].length, 4);
  EXPECT_EQ(writes[1].data, (std::array<std::uint8_t, 8>{4, 3, 2, 1}));
  EXPECT_EQ(writes[2].address, 0x0930);
  EXPECT_EQ(writes[2].length, 2);
  EXPECT_EQ(writes[2].data, (std::array<std::uint8_t, 8>{0x00, 0x10}));
}

TEST(ClockPlan, ReadsTheTimeDifferenceAsSignAndMagnitude) {
  EXPECT_EQ(decode_time_difference(25), 25ns);
  EXPECT_EQ(decode_time_difference(0x8000'0019), -25ns);
  EXPECT_EQ(decode_time_difference(0x8000'0000), 0ns);
}

/// A tree of slaves and cables; every slave takes as long to pass a frame on.
class Tree {
 public:
  explicit Tree(std::uint32_t seed) : random_(seed) {}

  std::vector<Slave> slaves;
  std::vector<ClockLatch> latches;
  std::vector<std::int64_t> arrival;  // true time at port 0

  void grow(int most) {
    most_ = most;
    now_ = 1'000'000;
    (void)visit(0, 0);
  }

 private:
  static constexpr std::int64_t kPass = 310;

  std::int64_t below(std::int64_t limit) {
    return static_cast<std::int64_t>(random_() % static_cast<std::uint64_t>(limit));
  }

  /// The frame comes in at port 0 of a new slave at now_ and leaves it there. Returns the slave's position.
  std::uint16_t visit(std::uint16_t parent, std::uint8_t parent_port) {
    const std::size_t i = slaves.size();
    const auto position = static_cast<std::uint16_t>(i + 1);
    slaves.push_back(slave(position, parent, parent_port, {0}));
    latches.emplace_back();
    arrival.push_back(now_);
    const auto start = static_cast<std::uint64_t>(random_()) << 32 | random_();  // of the local clock
    const auto local = [&] { return static_cast<std::uint64_t>(now_) + start; };
    latches[i].local_time_ns = local();
    latches[i].port_time_ns[0] = static_cast<std::uint32_t>(local());
    for (const std::uint8_t port : {std::uint8_t{3}, std::uint8_t{1}, std::uint8_t{2}}) {
      if (static_cast<int>(slaves.size()) >= most_ || below(3) == 0) continue;
      const std::int64_t cable = 5 * (1 + below(100));  // up to 100 m
      slaves[i].dl_status = static_cast<std::uint16_t>(slaves[i].dl_status | 1 << (9 + 2 * port));
      now_ += kPass + cable;
      (void)visit(position, port);
      now_ += cable;
      latches[i].port_time_ns[port] = static_cast<std::uint32_t>(local());
    }
    now_ += kPass;
    return position;
  }

  std::mt19937 random_;
  int most_ = 0;
  std::int64_t now_ = 0;
};

TEST(ClockPlan, IsExactForAnyTreeOfEqualSlaves) {
  std::size_t largest = 0;
  for (std::uint32_t seed = 0; seed < 300; ++seed) {
    Tree tree(seed);
    tree.grow(20);
    largest = std::max(largest, tree.slaves.size());
    const ClockPlan plan = plan_clocks(tree.slaves, tree.latches, 77'000'000'000);
    EXPECT_TRUE(plan.doubts.empty());
    for (std::size_t i = 0; i < tree.slaves.size(); ++i) {
      const std::int64_t delay = tree.arrival[i] - tree.arrival[0];
      EXPECT_EQ(plan.slaves[i].delay_ns, delay) << "seed " << seed << ", slave " << i + 1;
      EXPECT_EQ(tree.latches[i].local_time_ns + plan.slaves[i].offset_ns,
                77'000'000'000 + static_cast<std::uint64_t>(delay));
    }
  }
  EXPECT_EQ(largest, 20U);
}

/// Four emulated slaves in a line, the second without a clock; every clock has a different time and rate.
class ClocksOnTheBus : public ::testing::Test {
 protected:
  static constexpr nanoseconds kHop = sim::bus::EmulatedBus::kCableDelay + sim::bus::EmulatedBus::kPassDelay;

  void build(double drift_ppm) {
    for (int i = 0; i < 4; ++i) {
      sim::bus::SlaveDescription description;
      description.name = "EL" + std::to_string(i + 1);
      description.has_distributed_clock = i != 1;
      sim::bus::SlaveOptions options;
      options.crystal = {.start_ns = 123'456'789'012LL * i + 4'294'967'000LL,
                         .drift_ppm = drift_ppm * (i - 1.5)};
      bus.add(description, options);
    }
    wire = std::make_unique<sim::bus::EmulatedWire>(bus, sim::bus::WireOptions{.timed = true});
    link = std::make_unique<sim::bus::BusLink>(*wire);
    transceiver = std::make_unique<Transceiver>(*link);
    access = std::make_unique<RegisterAccess>(*transceiver, RegisterAccess::Options{});
    slaves = scan_bus(*access, "emulated");
  }
  /// System times of slaves 1, 3 and 4 as one frame passes them: alike, as the delays are taken off.
  std::vector<std::int64_t> system_times() {
    FrameWriter& writer = transceiver->begin();
    for (const std::uint16_t station : {std::uint16_t{0x1001}, std::uint16_t{0x1003}, std::uint16_t{0x1004}})
      (void)writer.add(Command::kFprd, transceiver->index(), address_of(station, reg::kDcSystemTime), 8);
    EXPECT_TRUE(transceiver->exchange(1ms));
    std::vector<std::int64_t> times;
    FrameReader answer = transceiver->answer();
    for (Datagram datagram; answer.next(datagram);)
      times.push_back(load_le<std::int64_t>(datagram.data.data()));
    return times;
  }

  sim::bus::EmulatedBus bus;
  std::unique_ptr<sim::bus::EmulatedWire> wire;
  std::unique_ptr<sim::bus::BusLink> link;
  std::unique_ptr<Transceiver> transceiver;
  std::unique_ptr<RegisterAccess> access;
  std::vector<Slave> slaves;
};

TEST_F(ClocksOnTheBus, AllShowTheSameTimeAfterSetUp) {
  build(0.0);
  const DistributedClocks clocks(*access, slaves, 1'000'000'000'000);
  EXPECT_EQ(clocks.plan().reference, 0U);
  EXPECT_EQ(clocks.plan().slaves[2].delay_ns, 2 * kHop.count());
  EXPECT_EQ(clocks.plan().slaves[3].delay_ns, 3 * kHop.count());
  const std::vector<std::int64_t> times = system_times();
  ASSERT_EQ(times.size(), 3U);
  EXPECT_GE(times[0], 1'000'000'000'000);
  EXPECT_LT(times[0], 1'000'001'000'000);  // a few frames later
  EXPECT_EQ(times[1], times[0]);
  EXPECT_EQ(times[2], times[0]);
}

TEST_F(ClocksOnTheBus, DriftIsCompensatedByOneDatagramACycle) {
  build(40.0);
  DistributedClocks clocks(*access, slaves, 0);
  bus.advance(100ms);
  // Left alone, slave 3 gains 80 ppm on slave 1: 8 us in 100 ms.
  std::vector<std::int64_t> times = system_times();
  EXPECT_NEAR(static_cast<double>(times[1] - times[0]), 8000.0, 100.0);
  clocks.settle(*access, 100);
  for (int cycle = 0; cycle < 3000; ++cycle) {
    FrameWriter& writer = transceiver->begin();
    ASSERT_TRUE(clocks.add(writer, transceiver->index()));
    ASSERT_TRUE(transceiver->exchange(1ms));
    FrameReader answer = transceiver->answer();
    Datagram datagram;
    ASSERT_TRUE(answer.next(datagram));
    ASSERT_TRUE(clocks.answer(datagram));
    bus.advance(1ms);
  }
  EXPECT_GT(clocks.system_time_ns(), 3'000'000'000U);
  // The clocks count whole nanoseconds; each correction and each reading may be one off.
  EXPECT_LE(clocks.worst_difference(*access), 3ns);
  times = system_times();
  EXPECT_NEAR(static_cast<double>(times[1] - times[0]), 0.0, 3.0);
  EXPECT_NEAR(static_cast<double>(times[2] - times[0]), 0.0, 3.0);
}

TEST_F(ClocksOnTheBus, InOperationTheCyclicFrameKeepsThemTogether) {
  build(40.0);
  PreOpBus setup(*link, nullptr, {.distributed_clocks = true});
  setup.enter_pre_op();
  OpBus operation = std::move(setup).start();
  ASSERT_TRUE(operation.clocks());
  const std::uint64_t begin = operation.clocks()->system_time_ns();
  for (int cycle = 0; cycle < 3000; ++cycle) {
    EXPECT_TRUE(operation.exchange(wire->now()).all_operational);
    bus.advance(1ms);
  }
  const std::vector<std::int64_t> times = system_times();
  // 3 s, plus the time of the frames and the reference's own 60 ppm.
  EXPECT_NEAR(static_cast<double>(operation.clocks()->system_time_ns() - begin), 3e9, 0.1e9);
  EXPECT_NEAR(static_cast<double>(times[1] - times[0]), 0.0, 80.0) << "a cycle of drift is 80 ns";
  EXPECT_NEAR(static_cast<double>(times[2] - times[0]), 0.0, 120.0);
}

TEST_F(ClocksOnTheBus, OffUnlessAskedFor) {
  build(0.0);
  PreOpBus setup(*link, nullptr, {});
  setup.enter_pre_op();
  EXPECT_FALSE(std::move(setup).start().clocks());
}

TEST_F(ClocksOnTheBus, WithoutClocksNothingIsAdded) {
  build(0.0);
  for (Slave& each : slaves) each.features = 0;
  DistributedClocks clocks(*access, slaves, 0);
  EXPECT_FALSE(clocks.active());
  FrameWriter writer;
  EXPECT_FALSE(clocks.add(writer, 1));
  EXPECT_TRUE(writer.empty());
  EXPECT_FALSE(clocks.answer(Datagram{}));
  clocks.settle(*access, 10);
  EXPECT_EQ(clocks.worst_difference(*access), 0ns);
}

TEST_F(ClocksOnTheBus, ASlaveThatIsGoneIsNamed) {
  build(0.0);
  bus.set_cable(3, false);
  try {
    const DistributedClocks clocks(*access, slaves, 0);
    FAIL();
  } catch (const BusError& error) {
    EXPECT_STREQ(error.what(), "slave 4 (EL4): read its receive times: it does not answer");
  }
}

TEST_F(ClocksOnTheBus, TheCycleDoesNotAllocateOrLock) {
  build(10.0);
  DistributedClocks clocks(*access, slaves, 0);
  bool good = true;
  const support::NoAllocGuard guard;
  for (int cycle = 0; cycle < 100; ++cycle) {
    FrameWriter& writer = transceiver->begin();
    good = good && clocks.add(writer, transceiver->index()) && transceiver->exchange(1ms);
    FrameReader answer = transceiver->answer();
    Datagram datagram;
    good = good && answer.next(datagram) && clocks.answer(datagram);
  }
  const long violations = guard.violations();
  EXPECT_TRUE(good);
  EXPECT_EQ(violations, 0);
}

}  // namespace ethercat_distributed_clocks_test
}  // namespace drivers::ethercat
