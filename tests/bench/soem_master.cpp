#include "tests/bench/ethercat_master.h"

#ifndef YOUBOT_HAVE_SOEM

namespace bench {
bool built_with_soem() { return false; }
std::unique_ptr<Master> make_soem_master(const std::string& /*interface*/) { return nullptr; }
}  // namespace bench

#else

#include <array>
#include <stdexcept>

extern "C" {
#include <soem/soem.h>
}

namespace bench {
namespace {

class SoemMaster final : public Master {
 public:
  explicit SoemMaster(const std::string& interface) : context_(std::make_unique<ecx_contextt>()) {
    if (ecx_init(context_.get(), interface.c_str()) <= 0) throw std::runtime_error("SOEM: no raw socket");
  }
  ~SoemMaster() override {
    request(EC_STATE_INIT);
    ecx_close(context_.get());
  }

  /// As SOEM's own samples do it, without their waiting for a human eye.
  void bring_up() override {
    ecx_contextt* context = context_.get();
    if (ecx_config_init(context) <= 0) throw std::runtime_error("SOEM: no slaves");
    ecx_config_map_group(context, image_.data(), 0);
    ecx_statecheck(context, 0, EC_STATE_SAFE_OP, EC_TIMEOUTSTATE);
    const ec_groupt& group = context->grouplist[0];
    expected_ = group.outputsWKC * 2 + group.inputsWKC;
    request(EC_STATE_OPERATIONAL);
    for (int i = 0; i < 200; ++i) {
      (void)exchange();
      if (ecx_statecheck(context, 0, EC_STATE_OPERATIONAL, kStateWait_us) == EC_STATE_OPERATIONAL) return;
    }
    throw std::runtime_error("SOEM: OP not reached");
  }

  bool exchange() override {
    ecx_send_processdata(context_.get());
    return ecx_receive_processdata(context_.get(), EC_TIMEOUTRET) == expected_;
  }

 private:
  static constexpr int kStateWait_us = 500;

  void request(std::uint16_t state) {
    context_->slavelist[0].state = state;
    ecx_writestate(context_.get(), 0);
  }
  std::unique_ptr<ecx_contextt> context_;
  std::array<std::uint8_t, 4096> image_{};
  int expected_ = 0;
};

}  // namespace

bool built_with_soem() { return true; }

std::unique_ptr<Master> make_soem_master(const std::string& interface) {
  return std::make_unique<SoemMaster>(interface);
}

}  // namespace bench

#endif
