/// @file
/// hal::HapticLink over an omega.6 and the vendor's library.
#pragma once
#include <cstdint>
#include <functional>
#include <memory>

#include "drivers/haptic/force_dimension.h"
#include "drivers/haptic/force_dimension_library.h"
#include "hal/haptic_link.h"

namespace hal {

/// What communicates with the device.
enum class ForceDimensionTransport : std::uint8_t {
  kSdk,  ///< the vendor's library, loaded when the device is opened
  /// This program, over USB. Not supported: neither packets nor calibration data are public, so open()
  /// refuses. See drivers/haptic/README.md.
  kUsb,
};

struct ForceDimensionLinkConfig {
  ForceDimensionTransport transport = ForceDimensionTransport::kSdk;
  drivers::haptic::SdkSearch sdk;
  drivers::haptic::ForceDimensionConfig device;
  /// Setup: asks the bus before the library, which only says "no device". Throws drivers::SetupError when the
  /// device is not there or may not be opened; empty: does not ask.
  std::function<void()> look_at_bus = {};
};

class ForceDimensionLink final : public HapticLink {
 public:
  explicit ForceDimensionLink(ForceDimensionLinkConfig config);
  ~ForceDimensionLink() override { close(); }

  const HapticInfo& info() const noexcept override { return info_; }
  void open() override;
  bool close() noexcept override;
  HapticStatus exchange(const HapticCommand& command, std::chrono::nanoseconds now,
                        HapticSample& sample) noexcept override;
  std::string describe(const HapticStatus& status) const override;

 private:
  ForceDimensionLinkConfig config_;
  HapticInfo info_;
  std::unique_ptr<drivers::haptic::ForceDimension> device_;  // null: closed
  bool force_off_ = true;                                    // as of the latest close()
};

}  // namespace hal
