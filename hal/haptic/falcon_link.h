/// @file
/// hal::HapticLink over the Novint Falcon.
#pragma once
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "drivers/haptic/falcon.h"
#include "drivers/usb/usb_port.h"
#include "hal/haptic_link.h"

namespace hal {

/// An exchange waits for the reply, at most FalconConfig::reply_deadline. Buttons as in
/// drivers::haptic::falcon::Button.
class FalconLink final : public HapticLink {
 public:
  /// Setup: finds and claims the device. @throws drivers::SetupError.
  using OpenPort = std::function<std::unique_ptr<drivers::usb::UsbPort>()>;

  /// `image`: the user's firmware file, for a device that was switched on since; may be empty.
  FalconLink(OpenPort open_port, drivers::haptic::FalconConfig config, std::vector<std::uint8_t> image);
  ~FalconLink() override { close(); }

  const HapticInfo& info() const noexcept override { return info_; }
  void open() override;
  bool close() noexcept override;
  HapticStatus exchange(const HapticCommand& command, std::chrono::nanoseconds now,
                        HapticSample& sample) noexcept override;
  std::string describe(const HapticStatus& status) const override;

 private:
  OpenPort open_port_;
  drivers::haptic::FalconConfig config_;
  std::vector<std::uint8_t> image_;
  HapticInfo info_;
  std::unique_ptr<drivers::usb::UsbPort> port_;
  std::optional<drivers::haptic::Falcon> falcon_;  // uses port_
  bool force_off_ = true;                          // as of the latest close()
};

}  // namespace hal
