// SOEM, the master the youBot's official driver is built on, brings the emulated robot up over a veth pair.
#include <gtest/gtest.h>

#include <array>
#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "drivers/ethercat/registers.h"
#include "drivers/tmcl/process_data.h"
#include "drivers/tmcl/telegram.h"
#include "tests/support/skip.h"
#include "tests/support/veth.h"

extern "C" {
#include <soem/soem.h>
}

namespace soem_master_test {

using namespace std::chrono_literals;
namespace tmcl = drivers::tmcl;

constexpr int kSlaves = 11;
constexpr std::array kBoards{2, 3, 4, 5, 7, 8, 9, 10, 11};
constexpr int kCounter = 9 * 3;  // nine boards, each read (1) and written (2); power boards do not count

/// Open on the interface as long as it lives.
class Soem {
 public:
  Soem() : context_(std::make_unique<ecx_contextt>()), open_(ecx_init(context_.get(), "veth-c") > 0) {}
  Soem(const Soem&) = delete;
  Soem& operator=(const Soem&) = delete;
  ~Soem() {
    if (!open_) return;
    request(EC_STATE_INIT);
    ecx_close(context_.get());
  }
  bool open() const { return open_; }
  ecx_contextt* context() { return context_.get(); }
  const ec_slavet& slave(int position) const { return context_->slavelist[position]; }

  /// Finds, maps and takes to SAFE-OP; the number of slaves.
  int configure() {
    const int found = ecx_config_init(context());
    if (found <= 0) return found;
    // A shared machine may not run us for longer than the 100 ms that the slaves' watchdogs grant by default.
    std::uint16_t patience = 50'000;  // of 100 us
    ecx_BWR(&context_->port, 0, drivers::ethercat::reg::kWatchdogProcessData, sizeof patience, &patience,
            EC_TIMEOUTSAFE);
    ecx_config_map_group(context(), image_.data(), 0);
    ecx_statecheck(context(), 0, EC_STATE_SAFE_OP, EC_TIMEOUTSTATE);
    return found;
  }
  bool enter_op() {
    request(EC_STATE_OPERATIONAL);
    for (int i = 0; i < 200; ++i) {
      exchange();
      if (ecx_statecheck(context(), 0, EC_STATE_OPERATIONAL, 1000) == EC_STATE_OPERATIONAL) return true;
    }
    return false;
  }
  /// The working counter, or EC_NOFRAME.
  int exchange() {
    ecx_send_processdata(context());
    return ecx_receive_processdata(context(), EC_TIMEOUTRET);
  }
  int expected_counter() const {
    const ec_groupt& group = context_->grouplist[0];
    return group.outputsWKC * 2 + group.inputsWKC;
  }
  /// By register access: SOEM's own mailbox functions take the telegram's bytes for a mailbox header and drop
  /// most replies.
  std::optional<tmcl::Reply> ask(int position, const tmcl::Request& request) {
    const ec_slavet& board = slave(position);
    std::vector<std::uint8_t> mail(board.mbx_l);
    const tmcl::MailboxBytes telegram = tmcl::encode_mailbox(request);
    std::copy(telegram.begin(), telegram.end(), mail.begin());
    ecx_portt* port = &context_->port;
    if (ecx_FPWR(port, board.configadr, board.mbx_wo, board.mbx_l, mail.data(), EC_TIMEOUTSAFE) != 1)
      return std::nullopt;
    std::uint8_t status = 0;
    for (int i = 0; i < 500 && (status & 0x08) == 0; ++i) {
      std::this_thread::sleep_for(1ms);
      ecx_FPRD(port, board.configadr, ECT_REG_SM1STAT, 1, &status, EC_TIMEOUTSAFE);
    }
    std::vector<std::uint8_t> reply(board.mbx_rl);
    if (ecx_FPRD(port, board.configadr, board.mbx_ro, board.mbx_rl, reply.data(), EC_TIMEOUTSAFE) != 1)
      return std::nullopt;
    return tmcl::decode_mailbox_reply(std::span(reply).first(tmcl::kMailboxBytes));
  }

 private:
  void request(std::uint16_t state) {
    context_->slavelist[0].state = state;
    ecx_writestate(context(), 0);
  }
  std::unique_ptr<ecx_contextt> context_;
  std::array<std::uint8_t, 4096> image_{};
  bool open_;
};

class SoemMaster : public testing::TestWithParam<std::string> {};

TEST_P(SoemMaster, TakesTheRobotToOpWithTheFullCounterExchangesValuesAndReadsAMailbox) {
  const support::Namespaces namespaces;
  SKIP_UNLESS(namespaces.usable(), "needs root and network namespaces");
  const support::Simulator simulator(namespaces, "--robot base+arm --boards " + GetParam());
  ASSERT_TRUE(simulator.ready());
  Soem soem;
  ASSERT_TRUE(soem.open());

  ASSERT_EQ(soem.configure(), kSlaves);
  const std::string wheel = "TMCM-1632";
  const std::string joint = "TMCM-1610";
  const std::vector<std::string> names{"KR-845", wheel, wheel, wheel, wheel, "KR-843",
                                       joint,    joint, joint, joint, joint};
  for (int i = 1; i <= kSlaves; ++i) EXPECT_EQ(soem.slave(i).name, names[static_cast<std::size_t>(i) - 1]);
  EXPECT_EQ(soem.expected_counter(), kCounter);

  ASSERT_TRUE(soem.enter_op()) << ec_ALstatuscode2string(soem.slave(0).ALstatuscode);
  ecx_readstate(soem.context());  // of each
  for (int i = 1; i <= kSlaves; ++i) EXPECT_EQ(soem.slave(i).state, EC_STATE_OPERATIONAL) << "slave " << i;

  // Each board loads a different number into its position counter, and reports its position.
  int answered = 0;
  for (std::int32_t round = 1; round <= 5; ++round) {
    const auto number = [&](int i) { return 100'000 * round + 1000 * i; };
    for (const int i : kBoards)
      tmcl::pack({.mode = tmcl::ControllerMode::kSetPositionToReference, .value = number(i)},
                 {soem.slave(i).outputs, soem.slave(i).Obytes});
    for (int n = 0; n < 100; ++n) {
      // A machine that starves us for longer than SOEM waits gives no counter at all: only a wrong one
      // counts.
      const int counter = soem.exchange();
      std::this_thread::sleep_for(1ms);
      if (counter == EC_NOFRAME) continue;
      ++answered;
      EXPECT_EQ(counter, kCounter);
    }
    for (const int i : kBoards) {
      tmcl::DriveInput input;
      EXPECT_TRUE(tmcl::unpack(tmcl::Firmware::k148, {soem.slave(i).inputs, soem.slave(i).Ibytes}, input));
      EXPECT_NEAR(input.position_ticks, number(i), 400)
          << "slave " << i << ", which creeps as long as it takes";
    }
  }
  EXPECT_GT(answered, 400);

  const auto reply = soem.ask(kBoards[0], {.command = tmcl::Command::kGetFirmwareVersion, .type = 1});
  ASSERT_TRUE(reply);
  EXPECT_TRUE(reply->ok());
  EXPECT_EQ(static_cast<std::uint32_t>(reply->value) >> 16, 1632U) << "controller type";
}
INSTANTIATE_TEST_SUITE_P(Boards, SoemMaster, testing::Values("lenient", "strict"));

}  // namespace soem_master_test
