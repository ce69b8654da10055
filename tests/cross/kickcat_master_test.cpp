// KickCAT's master brings the emulated robot up over a veth pair.
#include <gtest/gtest.h>
#include <kickcat/Bus.h>
#include <kickcat/Link.h>
#include <kickcat/OS/Linux/Socket.h>
#include <kickcat/SocketNull.h>

#include <array>
#include <chrono>
#include <cstdint>
#include <memory>
#include <span>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "drivers/tmcl/process_data.h"
#include "tests/support/skip.h"
#include "tests/support/veth.h"

namespace kickcat_master_test {

using namespace std::chrono_literals;
namespace tmcl = drivers::tmcl;
using kickcat::State;

constexpr std::size_t kSlaves = 11;
constexpr std::array<std::size_t, 9> kBoards{1, 2, 3, 4, 6, 7, 8, 9, 10};  // from 0

std::span<std::uint8_t> bytes_of(const kickcat::Slave::PIMapping& part) {
  return {part.data, static_cast<std::size_t>(part.bsize)};
}

/// KickCAT configures mailboxes of slaves only whose SII names a mailbox protocol; a youBot's carry telegrams
/// without header and name none. Boards that insist on theirs get it here: Bus::init() step by step, with
/// that one fact corrected.
class Bus : public kickcat::Bus {
 public:
  using kickcat::Bus::Bus;
  void init_headerless() {
    if (detectSlaves() == 0) throw std::runtime_error("no slaves");
    resetSlaves(2s);  // their watchdogs: a shared machine may not run us for a while
    setAddresses();
    fetchESC();
    fetchDL();
    requestState(State::INIT);
    waitForState(State::INIT, 5s);
    fetchEeprom();
    for (kickcat::Slave& slave : slaves())
      if (slave.sii.info.standard_recv_mbx_size > 0)
        slave.sii.info.mailbox_protocol |= kickcat::eeprom::MailboxProtocol::VoE;
    configureMailboxes();
    requestState(State::PRE_OP);
    waitForState(State::PRE_OP, 3s);
  }
};

class KickcatMaster : public testing::TestWithParam<std::string> {};

TEST_P(KickcatMaster, TakesTheRobotToOpWithTheFullCounterAndExchangesValues) {
  const support::Namespaces namespaces;
  SKIP_UNLESS(namespaces.usable(), "needs root and network namespaces");
  const support::Simulator simulator(namespaces, "--robot base+arm --boards " + GetParam());
  ASSERT_TRUE(simulator.ready());

  auto socket = std::make_shared<kickcat::Socket>();
  socket->open("veth-c");
  auto link = std::make_shared<kickcat::Link>(socket, std::make_shared<kickcat::SocketNull>(), [] {});
  link->setTimeout(10ms);
  Bus bus(link);
  if (GetParam() == "strict")
    bus.init_headerless();
  else
    bus.init(2s);
  ASSERT_EQ(bus.slaves().size(), kSlaves);
  const std::string wheel = "TMCM-1632";
  const std::string joint = "TMCM-1610";
  const std::vector<std::string> names{"KR-845", wheel, wheel, wheel, wheel, "KR-843",
                                       joint,    joint, joint, joint, joint};
  for (std::size_t i = 0; i < kSlaves; ++i) EXPECT_EQ(bus.slaves()[i].name(), names[i]);

  std::array<std::uint8_t, 4096> image{};
  bus.createMapping(image.data(), image.size());
  for (std::size_t i = 0; i < kSlaves; ++i) {
    const bool power_board = i == 0 || i == 5;
    EXPECT_EQ(bus.slaves()[i].input.bsize, power_board ? 0 : 40);
    EXPECT_EQ(bus.slaves()[i].output.bsize, power_board ? 0 : 40);
  }
  bus.requestState(State::SAFE_OP);
  bus.waitForState(State::SAFE_OP, 3s);

  int lost = 0;
  int wrong = 0;
  const auto exchange = [&] {
    bus.processDataReadWrite([&](const kickcat::DatagramState& state) {
      ++(state == kickcat::DatagramState::LOST ? lost : wrong);
    });
  };
  bus.requestState(State::OPERATIONAL);
  bus.waitForState(State::OPERATIONAL, 3s, exchange);
  for (kickcat::Slave& slave : bus.slaves()) EXPECT_EQ(bus.getCurrentState(slave), State::OPERATIONAL);

  // Each board loads a different number into its position counter, and reports its position.
  lost = wrong = 0;
  for (std::int32_t round = 1; round <= 5; ++round) {
    const auto number = [&](std::size_t i) { return 100'000 * round + 1000 * static_cast<std::int32_t>(i); };
    for (const std::size_t i : kBoards)
      tmcl::pack({.mode = tmcl::ControllerMode::kSetPositionToReference, .value = number(i)},
                 bytes_of(bus.slaves()[i].output));
    for (int n = 0; n < 100; ++n) {
      exchange();
      std::this_thread::sleep_for(1ms);
    }
    for (const std::size_t i : kBoards) {
      tmcl::DriveInput input;
      EXPECT_TRUE(tmcl::unpack(tmcl::Firmware::k148, bytes_of(bus.slaves()[i].input), input));
      EXPECT_NEAR(input.position_ticks, number(i), 20) << "slave " << i + 1 << ", which may creep a little";
    }
  }
  EXPECT_EQ(wrong, 0) << "working counters";
  EXPECT_LT(lost, 100) << "of 500";
  bus.requestState(State::INIT);
}
INSTANTIATE_TEST_SUITE_P(Boards, KickcatMaster, testing::Values("lenient", "strict"));

}  // namespace kickcat_master_test
