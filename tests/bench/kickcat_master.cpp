#include "tests/bench/ethercat_master.h"

#ifndef YOUBOT_HAVE_KICKCAT

namespace bench {
bool built_with_kickcat() { return false; }
std::unique_ptr<Master> make_kickcat_master(const std::string& /*interface*/) { return nullptr; }
}  // namespace bench

#else

#include <kickcat/Bus.h>
#include <kickcat/Link.h>
#include <kickcat/OS/Linux/Socket.h>
#include <kickcat/SocketNull.h>

#include <array>

namespace bench {
namespace {

using namespace std::chrono_literals;
using kickcat::State;

class KickcatMaster final : public Master {
 public:
  explicit KickcatMaster(const std::string& interface)
      : socket_(std::make_shared<kickcat::Socket>()),
        link_(std::make_shared<kickcat::Link>(socket_, std::make_shared<kickcat::SocketNull>(), [] {})),
        bus_(link_) {
    socket_->open(interface);
    link_->setTimeout(2ms);  // as SOEM waits
  }
  ~KickcatMaster() override {
    try {
      bus_.requestState(State::INIT);
    } catch (const std::exception&) {  // the frame was lost: the next master starts from any state
    }
    socket_->close();
  }

  /// As KickCAT's own examples do it.
  void bring_up() override {
    bus_.init(kStateWait);
    bus_.createMapping(image_.data(), image_.size());
    bus_.requestState(State::SAFE_OP);
    bus_.waitForState(State::SAFE_OP, kStateWait);
    bus_.requestState(State::OPERATIONAL);
    bus_.waitForState(State::OPERATIONAL, kStateWait, [this] { (void)exchange(); });
  }

  bool exchange() override {
    complete_ = true;
    bus_.processDataReadWrite([this](const kickcat::DatagramState& /*state*/) { complete_ = false; });
    return complete_;
  }

 private:
  static constexpr std::chrono::seconds kStateWait{3};

  std::shared_ptr<kickcat::Socket> socket_;
  std::shared_ptr<kickcat::Link> link_;
  kickcat::Bus bus_;
  std::array<std::uint8_t, 4096> image_{};
  bool complete_ = false;
};

}  // namespace

bool built_with_kickcat() { return true; }

std::unique_ptr<Master> make_kickcat_master(const std::string& interface) {
  return std::make_unique<KickcatMaster>(interface);
}

}  // namespace bench

#endif
