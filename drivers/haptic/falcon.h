/// @file
/// The Novint Falcon: a grip that moves in three directions and pushes back, with four buttons.
///
///   usb::UsbPort& port = ...;                  // 0403:cb48, interface 0, OUT 0x02, IN 0x81
///   Falcon falcon(port, config);
///   falcon.activate(image);                    // bytes of the user's firmware file, for a cold device
///   while (...) status = falcon.exchange(force_N, sample);   // about 1 kHz is what the wire carries
///   falcon.deactivate();
///
/// Frames: F and G as in falcon_kinematics.h (z out towards the user); O, the workspace's origin, is parallel
/// to F and stands at config.p_FO_m. The force is the one that the device makes on the hand.
///
/// Until the user has pulled the grip all the way out and pushed it all the way in, the encoders count from
/// anywhere and jump when their ends are found: the light is red, there is no position, and no force is made.
/// Then the light is green, and the force fades in over config.ramp.
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

#include "drivers/haptic/falcon_boot.h"
#include "drivers/haptic/falcon_kinematics.h"
#include "drivers/haptic/falcon_packet.h"
#include "drivers/usb/usb_port.h"

namespace drivers::haptic {

struct FalconConfig {
  double force_limit_N = 8.0;  ///< magnitude, at most 12; chai3d lists 8 as the device's own
  /// Motor command per torque about the thigh, up to 5e4 either way. libnifalcon's, not calibrated: measure
  /// it per device. Its sign is the direction of the motors' winding.
  double command_per_Nm = -10000.0;
  std::array<double, 3> p_FO_m{0.0, 0.0, 0.13};  ///< others have 0.15 in the last place
  /// 3 ms to 20 ms. Half of it has to outlast a reply's usual time, 1.2 ms with the FTDI chip's latency.
  std::chrono::nanoseconds reply_deadline = std::chrono::milliseconds(5);
  int lost_after_misses = 3;  ///< 1 to 10
  /// The gain rises from 0 to 1 over this time, 0.1 s to 60 s, when there is a position after activate() or
  /// homing ...
  std::chrono::nanoseconds ramp = std::chrono::seconds(1);
  /// ... and over this time after kBadForce, kNoPosition or a pause, unless the longer ramp was not over yet.
  std::chrono::nanoseconds ramp_again = std::chrono::milliseconds(100);
  falcon::BootConfig boot = {};

  /// Setup: everything that is wrong with it, in words.
  std::vector<std::string> problems() const;
};

enum class FalconFault : std::uint8_t {
  kNone,
  kIdle,        ///< not activated
  kBadForce,    ///< not finite: zero was sent instead; `sample` is fresh
  kMissed,      ///< no reply before the deadline, or the transfer failed (detail); the next may come
  kNoPosition,  ///< counts that fit no place, or one far out of the workspace: no force until they do
  kLost,        ///< too many misses in a row. Latched
  kUnplugged,   ///< latched; the port is of no more use
};
const char* describe(FalconFault fault) noexcept;

struct [[nodiscard]] FalconStatus {
  FalconFault fault = FalconFault::kNone;
  usb::TransferStatus transfer = usb::TransferStatus::kDone;  ///< the one that failed
  int detail = 0;                                             ///< its backend's code
  bool ok() const noexcept { return fault == FalconFault::kNone; }
};

struct FalconSample {
  std::chrono::nanoseconds stamp{};  ///< UsbPort::now() when the reply was there
  bool homed = false;                ///< all axes; otherwise p_OG_m is the last one known, or zero
  std::array<bool, 3> axis_homed{};
  std::array<double, 3> p_OG_m{};
  std::array<std::int16_t, 3> counts{};
  std::uint8_t buttons = 0;         ///< bits: falcon::Button
  std::array<double, 3> f_G_F_N{};  ///< the force that was sent with this packet, after limits and ramp
  bool limited = false;  ///< smaller than asked for: force limit, or a motor at its end; not by the ramp
};

/// One device behind its port, which has to outlive it. One thread. A cycle may block for the deadline; while
/// replies are owed that were missed, for half as long again behind each; the one that ends in kLost, and
/// each in kLost, for up to five more, in which zero is written.
class Falcon {
 public:
  /// Setup. @throws SetupError listing all FalconConfig::problems().
  explicit Falcon(usb::UsbPort& port, FalconConfig config = {});
  Falcon(const Falcon&) = delete;
  Falcon& operator=(const Falcon&) = delete;
  /// As deactivate().
  ~Falcon();

  /// Setup: firmware running, motors at zero; a force of ours that may still be on is taken away first. Also
  /// the way back from kLost (from kUnplugged only a new port is). `image` may be empty when the firmware is
  /// running already. @throws SetupError see falcon::start_firmware(), once zero was sent all the same: a
  /// program that was killed may have left a force on.
  falcon::Firmware activate(std::span<const std::uint8_t> image = {});
  /// Zero force. Allowed in any state. False when a force may still be on: zero could not be written.
  bool deactivate() noexcept;

  /// Cycle: one packet out, its reply in. The force is turned into torques at the grip's latest position.
  /// `sample` is left as it is unless the status is ok or kBadForce. After a pause of more than
  /// lost_after_misses deadlines that position is too old: zero goes out, then the force fades in. In kLost
  /// each call still sends zero force, for a device that hears but is not heard.
  FalconStatus exchange(const std::array<double, 3>& f_G_F_N, FalconSample& sample) noexcept;

  /// Cycle: what the latest packet that may have gone out asked for, whether or not a reply came.
  const std::array<double, 3>& force_N() const noexcept { return sent_N_; }

 private:
  struct Drive {
    falcon::Command command;
    std::array<double, 3> force_N{};
    bool limited = false;
  };

  Drive drive(const std::array<double, 3>& wanted_N, double gain) const noexcept;
  falcon::Command at_rest() const noexcept;
  bool locate(const falcon::Reply& reply) noexcept;
  bool too_old(std::chrono::nanoseconds now) const noexcept;
  double gain(std::chrono::nanoseconds now) noexcept;
  void interrupt_ramp(std::chrono::nanoseconds now) noexcept;
  bool send_zero() noexcept;
  FalconStatus miss(const usb::TransferResult& result) noexcept;
  usb::TransferResult write(const falcon::Command& command) noexcept;
  usb::TransferResult read(std::optional<falcon::Reply>& reply, std::chrono::nanoseconds timeout) noexcept;
  usb::TransferResult discard_late_replies() noexcept;
  usb::TransferResult receive(falcon::Reply& reply, std::chrono::nanoseconds deadline) noexcept;

  usb::UsbPort& port_;
  FalconConfig config_;
  FalconStatus latched_{FalconFault::kIdle, {}, 0};
  falcon::ReplyStream stream_;
  int owed_ = 0;  // replies to commands that were sent
  falcon::Vector3 sent_N_{};
  bool may_push_ = false;  // since a command other than zero, or one that is not ours, until zero went out
  int misses_ = 0;
  std::chrono::nanoseconds reply_stamp_{};  // when the latest one was there
  bool homed_ = false;                      // all axes, as of the latest reply
  bool located_ = false;                    // homed, and p_FG_m_ is from the latest reply: else no force
  falcon::Vector3 p_FG_m_ = falcon::kMiddle_m;
  falcon::Vector3 p_OG_m_{};
  std::optional<std::chrono::nanoseconds> ramp_begin_;  // empty: begins with the next force
  std::chrono::nanoseconds ramp_time_{};
};

}  // namespace drivers::haptic
