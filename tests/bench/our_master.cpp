#include <optional>
#include <stdexcept>

#include "drivers/ethercat/monotonic_clock.h"
#include "drivers/ethercat/pre_op_bus.h"
#include "drivers/ethercat/raw_socket_link.h"
#include "drivers/tmcl/telegram.h"
#include "tests/bench/ethercat_master.h"

namespace bench {
namespace {

using namespace std::chrono_literals;
namespace ethercat = drivers::ethercat;
namespace tmcl = drivers::tmcl;

class OurMaster final : public Master {
 public:
  OurMaster(const std::string& interface, Waiting waiting, MailboxLoad load)
      : link_(interface, waiting == Waiting::kBusy ? ethercat::RawSocketLink::Wait::kBusy
                                                   : ethercat::RawSocketLink::Wait::kBlock),
        load_(load) {}
  ~OurMaster() override {
    if (bus_) bus_->leave_op();
  }

  void bring_up() override {
    ethercat::PreOpBus::Options options;
    options.cyclic.frame_timeout = 2ms;  // as SOEM waits
    ethercat::PreOpBus setup(link_, nullptr, options);
    setup.enter_pre_op();
    bus_.emplace(std::move(setup).start());
  }

  bool exchange() override {
    if (load_ == MailboxLoad::kAll) keep_mailboxes_busy();
    const ethercat::CycleResult result = bus_->exchange(ethercat::monotonic_now());
    // Brings slaves back that a starved simulator dropped out of OP, as an operator would.
    for (std::size_t i = 0; !result.all_operational && i < bus_->size(); ++i) bus_->resume(i);
    return result.answered && result.working_counter == result.expected_working_counter;
  }

  std::uint64_t mailbox_replies() const override { return replies_; }

 private:
  void keep_mailboxes_busy() {
    constexpr std::uint8_t kActualPosition = 1;
    const tmcl::MailboxBytes request =
        tmcl::encode_mailbox({.command = tmcl::Command::kGetAxisParameter, .type = kActualPosition});
    for (std::size_t i = 0; i < bus_->size(); ++i) {
      ethercat::MailboxLine& line = bus_->mailbox(i);
      if (!line.exists() || line.status() == ethercat::MailboxLine::Status::kBusy) continue;
      if (line.status() == ethercat::MailboxLine::Status::kReplied) ++replies_;
      (void)line.post(request, 500ms);
    }
  }

  ethercat::RawSocketLink link_;
  MailboxLoad load_;
  std::optional<ethercat::OpBus> bus_;
  std::uint64_t replies_ = 0;
};

}  // namespace

std::unique_ptr<Master> make_our_master(const std::string& interface, Waiting waiting, MailboxLoad load) {
  return std::make_unique<OurMaster>(interface, waiting, load);
}

}  // namespace bench
