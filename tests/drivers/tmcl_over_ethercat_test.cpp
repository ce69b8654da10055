// Values in TMCL replies through the whole stack: client or queue, mailbox, frames, emulated slave and board.
// Replies have no header: a master that expects one would misread their first four value bytes.
#include <gtest/gtest.h>

#include <array>
#include <cstdint>
#include <limits>

#include "drivers/ethercat/pre_op_bus.h"
#include "drivers/tmcl/axis_parameters.h"
#include "drivers/tmcl/client.h"
#include "drivers/tmcl/mailbox_transport.h"
#include "drivers/tmcl/process_data.h"
#include "drivers/tmcl/request_queue.h"
#include "sim/bus/bus_link.h"
#include "sim/bus/youbot_bus.h"

namespace drivers::tmcl {
namespace tmcl_over_ethercat_test {

using namespace std::chrono_literals;

// Below 65536 the upper half is zero, between -65536 and -1 all ones.
constexpr std::array<std::int32_t, 15> kValues{0,
                                               1,
                                               -1,
                                               255,
                                               256,
                                               0x7FFF,
                                               0x8000,
                                               65535,
                                               65536,
                                               -65535,
                                               -65536,
                                               -65537,
                                               0x03000000,
                                               std::numeric_limits<std::int32_t>::max(),
                                               std::numeric_limits<std::int32_t>::min()};
constexpr std::size_t kWheel = 2;  // any slave with a motor

/// Kept by the board as it is, whatever the value: nothing turns before the commutation is known.
const AxisParameter& target() { return drive_parameter("target_position"); }

TEST(TmclOverEthercat, EveryValueArrivesDuringSetUp) {
  sim::bus::YoubotBus robot;
  sim::bus::BusLink link(robot.wire(), &robot);
  ethercat::PreOpBus setup(link, nullptr, {});
  setup.enter_pre_op();
  SetupMailboxTransport transport(setup, kWheel);
  SteadyClock clock;
  Client client(transport, clock);
  for (const std::int32_t value : kValues) {
    client.set(target(), value);
    EXPECT_EQ(client.get(target()), value);
  }
}

TEST(TmclOverEthercat, EveryValueArrivesInOperationAndNoCycleSuffers) {
  sim::bus::YoubotBus robot;
  sim::bus::BusLink link(robot.wire(), &robot);
  ethercat::PreOpBus setup(link, nullptr, {});
  setup.enter_pre_op();
  ethercat::OpBus bus = std::move(setup).start();
  const std::uint64_t lost_before = bus.counters().lost;
  MailboxTransport transport(bus.mailbox(kWheel), "wheel");
  RequestQueue queue;
  // Process data that leave the mailbox's commands alone.
  ASSERT_TRUE(pack({ControllerMode::kNoMoreAction, 0}, bus.outputs(kWheel)));

  std::chrono::nanoseconds now{};
  std::size_t answered = 0;
  for (int cycle = 0; cycle < 2000 && answered < kValues.size(); ++cycle) {
    if (queue.size() == 0) {
      ASSERT_TRUE(queue.push(set(target(), kValues[answered])));
      ASSERT_TRUE(queue.push(get(target()), 1));
    }
    const ethercat::CycleResult result = bus.exchange(now += 1ms);
    robot.advance(1ms);
    EXPECT_TRUE(result.all_operational) << "cycle " << cycle;
    queue.step(transport);
    while (const auto completion = queue.pop()) {
      EXPECT_TRUE(completion->done()) << describe(completion->outcome);
      if (completion->tag != 1) continue;
      EXPECT_EQ(completion->reply.value, kValues[answered++]);
    }
  }
  EXPECT_EQ(answered, kValues.size());
  EXPECT_EQ(bus.counters().lost, lost_before);
}

}  // namespace tmcl_over_ethercat_test
}  // namespace drivers::tmcl
