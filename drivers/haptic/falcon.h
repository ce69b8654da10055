/// @file
/// The Novint Falcon: a handle that moves in three directions and pushes back, with four buttons.
///
///   usb::UsbPort& port = ...;                  // 0403:cb48, interface 0, OUT 0x02, IN 0x81
///   Falcon falcon(port, config);
///   falcon.activate(image);                    // bytes of the user's firmware file, for a cold device
///   while (...) status = falcon.exchange(force_N, sample);   // about 1 kHz is what the wire carries
///   falcon.deactivate();
///
/// Frames as in device_exchange.h; the origin of H stands at config.p_FO_m, in the frame F of
/// falcon_kinematics.h. The handle never turns.
///
/// Until the user has pulled the handle all the way out and pushed it all the way in, the encoders count from
/// an unknown position and jump when their ends are found: the light is red, the status is kNotReady, and the
/// force is zero. Then the light is green.
///
/// No watchdog of the firmware is known: when the process is killed or hangs, or the USB cable is pulled, the
/// motors may keep the last force for as long as the device has power. Keep a hand on its supply.
#pragma once
#include <array>
#include <chrono>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "drivers/haptic/device_exchange.h"
#include "drivers/haptic/falcon_boot.h"
#include "drivers/haptic/falcon_kinematics.h"
#include "drivers/haptic/falcon_packet.h"
#include "drivers/usb/usb_port.h"

namespace drivers::haptic {

struct FalconConfig {
  double force_limit_N = 8.0;  ///< magnitude, at most 12; chai3d lists 8 as the device's own
  /// Motor command per torque about the thigh, up to 5e4 either way. From libnifalcon, not calibrated:
  /// measure it per device. Its sign is the direction of the motors' winding.
  double command_per_Nm = -10000.0;
  Vector3 p_FO_m{0.0, 0.0, 0.13};  ///< others have 0.15 in the last place
  /// 3 ms to 20 ms. Half of it has to outlast the usual time of a reply, 1.2 ms with the FTDI chip's latency.
  std::chrono::nanoseconds reply_deadline = std::chrono::milliseconds(5);
  int lost_after_misses = 3;  ///< 1 to 10
  falcon::BootConfig boot = {};

  /// Setup: everything that is wrong with it, in words.
  std::vector<std::string> problems() const;
};

/// One device behind its port, which has to outlive it. One thread. A cycle blocks for the deadline at most;
/// with replies outstanding, for half a deadline more behind each. The cycle that ends in kLost, and each one
/// after it, writes zero up to five times.
class Falcon {
 public:
  /// Setup. @throws SetupError listing all FalconConfig::problems().
  explicit Falcon(usb::UsbPort& port, FalconConfig config = {});
  Falcon(const Falcon&) = delete;
  Falcon& operator=(const Falcon&) = delete;
  /// As deactivate().
  ~Falcon();

  /// Setup: firmware running, motors at zero; a force that this object left on ends first. Also the way back
  /// from kLost; kUnplugged needs a new port. `image` may be empty when the firmware is running already.
  /// @throws SetupError see falcon::start_firmware(), after zero was sent: a program that was killed may have
  /// left a force on.
  falcon::Firmware activate(std::span<const std::uint8_t> image = {});
  /// Zero force. Allowed in any state. False when a force may still be on: zero could not be written.
  bool deactivate() noexcept;

  /// Cycle: one packet out, its reply in. The latest position turns the force into torques; it is too old
  /// after a pause of more than lost_after_misses deadlines. Without a position the packet carries zero.
  /// kLost and kUnplugged stay until activate(). In kLost each call sends zero, for a device that receives
  /// but whose replies are lost. DeviceStatus::detail: the usb::TransferStatus that failed.
  DeviceStatus exchange(const Vector3& f_D_H_N, DeviceSample& sample) noexcept;

 private:
  struct Drive {
    falcon::Command command;
    Vector3 f_D_H_N{};
    bool saturated = false;
  };

  Drive drive(Vector3 f_D_H_N) const noexcept;
  falcon::Command at_rest() const noexcept;
  bool locate(const falcon::Reply& reply) noexcept;
  bool too_old(std::chrono::nanoseconds now) const noexcept;
  bool send_zero() noexcept;
  DeviceStatus miss(const usb::TransferResult& result) noexcept;
  usb::TransferResult write(const falcon::Command& command) noexcept;
  usb::TransferResult read(std::optional<falcon::Reply>& reply, std::chrono::nanoseconds timeout) noexcept;
  usb::TransferResult discard_late_replies() noexcept;
  usb::TransferResult receive(falcon::Reply& reply, std::chrono::nanoseconds deadline) noexcept;

  usb::UsbPort& port_;
  FalconConfig config_;
  DeviceStatus latched_{.fault = HapticFault::kNotActive};
  falcon::ReplyStream stream_;
  int owed_ = 0;  // replies to commands that were sent
  Vector3 sent_N_{};
  bool may_push_ = false;  // since a command other than zero, or an unknown one, until zero went out
  int misses_ = 0;
  std::chrono::nanoseconds reply_stamp_{};  // when the latest one arrived
  bool homed_ = false;                      // all axes, as of the latest reply
  bool located_ = false;                    // homed, and p_FG_m_ is from the latest reply: else no force
  Vector3 p_FG_m_ = falcon::kMiddle_m;
};

}  // namespace drivers::haptic
