/// @file
/// The operator's haptic device, at the robot's station: what arrives over the link, as a hal::HapticLink.
#pragma once
#include <functional>
#include <memory>
#include <optional>

#include "control/delayed_port.h"
#include "drivers/station/endpoint.h"
#include "hal/haptic_link.h"
#include "runtime/station/link_options.h"

namespace runtime {

/// Not ready until the operator's station is connected and its device is ready. Samples have the time of
/// their arrival: hal::HapticServo ends the force, and the robot stops, when none arrives for its
/// stale_after. A fault of the operator's device is one of this device. Position and force are those of the
/// link's robot port; the force that acted on the hand is in the sample.
class RemoteHapticLink final : public hal::HapticLink {
 public:
  using OpenPort = std::function<std::unique_ptr<drivers::station::DatagramPort>()>;

  struct Limits {
    double force_N = 0.0;        ///< that is sent; the operator's station limits it to its device's
    double speed_m_per_s = 1.0;  ///< at which hal::HapticServo faults; the position stays below it
  };
  /// `monitor` may be null.
  RemoteHapticLink(OpenPort open_port, const drivers::station::Key& key, const LinkOptions& options,
                   const Limits& limits, std::shared_ptr<LinkMonitor> monitor);

  const hal::HapticInfo& info() const noexcept override { return info_; }
  void open() override;
  bool close() noexcept override;
  hal::HapticStatus exchange(const hal::HapticCommand& command, std::chrono::nanoseconds now,
                             hal::HapticSample& sample) noexcept override;
  std::string describe(const hal::HapticStatus& status) const override;

 private:
  hal::HapticStatus read(std::chrono::nanoseconds now, hal::HapticSample& sample) noexcept;
  void take_states(hal::HapticSample& sample, std::chrono::nanoseconds now) noexcept;

  OpenPort open_port_;
  drivers::station::Key key_;
  LinkOptions options_;
  hal::HapticInfo info_;
  double following_m_per_s_;
  std::shared_ptr<LinkMonitor> monitor_;
  std::unique_ptr<drivers::station::DatagramPort> port_;
  std::optional<drivers::station::RobotEndpoint> endpoint_;
  control::RobotPort passivity_;
  std::uint64_t sessions_ = 0;                     // at the last message
  std::optional<std::chrono::nanoseconds> taken_;  // arrival of the last sample
  Eigen::Vector3d commanded_N_ = Eigen::Vector3d::Zero();
};

}  // namespace runtime
