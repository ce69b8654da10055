/// @file
/// A Novint Falcon behind its USB port: FTDI chip, boot loader, firmware, encoders and motors, byte for byte.
#pragma once
#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "drivers/usb/usb_port.h"
#include "sim/devices/falcon_legs.h"

namespace sim::devices {

struct EmulatedFalconOptions {
  bool powered = true;  ///< without its power supply only the FTDI chip works, on USB power, and nothing
                        ///< answers
  bool firmware_running = false;  ///< left by an earlier program
  /// The image that the processor accepts; empty: any. Another image is echoed too, but then nothing replies.
  std::vector<std::uint8_t> image = {};
  bool zero_before_query_answer = false;                             ///< seen on macOS
  std::array<std::int16_t, 3> counts_before_homing{1234, -777, 42};  ///< initial offset
};

/// States: cold, then boot loader after DTR has risen; the query is answered only at 9600 Bd with DTR high;
/// load mode at 142 857 Bd echoes every byte; 1.5 MBd with an accepted image starts the firmware. Another
/// rise of DTR leads back to the boot loader.
///
/// Output of the processor waits in the FTDI chip for 62 bytes, which leave at once, or for the latency
/// timer; if that finds nothing, two bytes of modem status leave. [G] The timer runs freely from when it was
/// set: in run mode a host that answers at once gets a reply each millisecond. If it started with the first
/// waiting byte, it would be one every 1.2 ms.
///
/// Its time is its own: it advances by the duration of the bytes on the wire and by the wait of read(), so
/// that a time-out is over at once. A read that waits less than the latency never gets an empty packet. One
/// thread. Nothing allocates once the firmware runs.
class EmulatedFalcon final : public drivers::usb::UsbPort {
 public:
  enum class State : std::uint8_t { kCold, kBoot, kLoad, kRun };

  explicit EmulatedFalcon(EmulatedFalconOptions options = {});

  // ---- the host's side ----

  drivers::usb::TransferResult control_out(std::uint8_t request, std::uint16_t value,
                                           std::uint16_t index) noexcept override;
  drivers::usb::TransferResult write(std::span<const std::uint8_t> bytes,
                                     std::chrono::nanoseconds timeout) noexcept override;
  drivers::usb::TransferResult read(std::span<std::uint8_t> buffer,
                                    std::chrono::nanoseconds timeout) noexcept override;
  std::chrono::nanoseconds now() noexcept override { return now_; }

  // ---- the user's hand ----

  /// Within the reach of the legs; frame as in falcon_legs.h. At 0.17 m on the axis all legs are at their
  /// outer ends, at 0.09 m at their inner ones.
  void move_grip(const FalconVector& place_m) noexcept;
  /// Fully out, then in, as far as the firmware requires; ends where it was.
  void pull_and_push() noexcept;
  void press(std::uint8_t buttons) noexcept { buttons_ = buttons; }
  /// Force of the motors on the hand from the latest command.
  FalconVector force_N() const noexcept;
  bool red() const noexcept { return (state_byte_ & 8U) != 0; }
  bool green() const noexcept { return (state_byte_ & 2U) != 0; }

  // ---- for tests ----

  void pass(std::chrono::nanoseconds time) noexcept { now_ += time; }
  State state() const noexcept { return state_; }
  bool homed() const noexcept { return homed_ == 0b111; }
  unsigned homed_axes() const noexcept { return homed_; }  ///< bit of each axis
  const std::array<std::int16_t, 3>& motors() const noexcept { return motors_; }
  const std::vector<std::uint8_t>& loaded() const noexcept { return loaded_; }
  int commands() const noexcept { return commands_; }
  int commands_without_homing() const noexcept { return commands_without_homing_; }
  int malformed_commands() const noexcept { return malformed_commands_; }
  int boots() const noexcept { return boots_; }
  int queries() const noexcept { return queries_; }

  // ---- faults: each of the next `count` times ----

  void drop_replies(int count) noexcept { drop_ = count; }
  void delay_replies(int count, std::chrono::nanoseconds delay) noexcept {
    late_ = count;
    delay_ = delay;
  }
  /// In two USB packets, the first of `first_bytes`.
  void split_replies(int count, std::size_t first_bytes) noexcept {
    split_ = count;
    split_at_ = first_bytes;
  }
  /// An extra byte at this place of the reply; 0: before it, 16: after it.
  void insert_into_replies(int count, std::size_t place, std::uint8_t byte) noexcept {
    insert_ = count;
    insert_at_ = place;
    inserted_ = byte;
  }
  /// Replaces the true encoders.
  void send_counts(int count, const std::array<std::int16_t, 3>& counts) noexcept {
    false_ = count;
    false_counts_ = counts;
  }
  enum class Echo : std::uint8_t { kWrongByte, kByteMissing, kByteTooMany };
  /// In `loads` loads, the echo of chunk `chunk` (from 0; -1: of the request to load).
  void spoil_echo(int loads, int chunk, Echo how = Echo::kWrongByte) noexcept {
    spoilt_loads_ = loads;
    spoilt_chunk_ = chunk;
    spoilt_how_ = how;
  }
  void stall(int transfers) noexcept { stalls_ = transfers; }
  void unplug() noexcept { unplugged_ = true; }

 private:
  static constexpr std::size_t kData = 62;  // of a USB packet, after the modem status
  struct Received {
    std::chrono::nanoseconds at{};  ///< its end on the wire
    std::uint8_t byte = 0;
  };

  drivers::usb::TransferStatus trouble() noexcept;
  bool at_baud(double baud) const noexcept;
  void raise_dtr() noexcept;
  void start_if_loaded() noexcept;
  void boot_loader(std::span<const std::uint8_t> bytes) noexcept;
  void load(std::span<const std::uint8_t> bytes) noexcept;
  void echo(std::span<const std::uint8_t> bytes) noexcept;
  void firmware(std::uint8_t byte) noexcept;
  void command() noexcept;
  void reply() noexcept;
  void answer(std::span<const std::uint8_t> bytes, std::chrono::nanoseconds delay = {}) noexcept;
  std::chrono::nanoseconds byte_time() const noexcept;
  std::chrono::nanoseconds timer_behind(std::chrono::nanoseconds time) const noexcept;
  std::chrono::nanoseconds departure() const noexcept;

  EmulatedFalconOptions options_;
  State state_ = State::kCold;
  std::chrono::nanoseconds now_{};

  // The FTDI chip, as after power-on.
  std::vector<Received> received_;  // not yet sent on, or still to come
  double baud_ = 9600;
  std::chrono::nanoseconds latency_ = std::chrono::milliseconds(16);
  std::chrono::nanoseconds timer_set_{};
  bool dtr_ = false;

  // Boot loader.
  std::vector<std::uint8_t> query_;
  bool query_answered_ = false;
  std::vector<std::uint8_t> loaded_;
  int chunk_ = -1;
  int boots_ = 0;
  int queries_ = 0;

  // Firmware.
  std::array<std::uint8_t, 16> packet_{};
  std::size_t packet_size_ = 0;
  std::uint8_t state_byte_ = 0;
  std::array<std::int16_t, 3> motors_{};
  unsigned seen_out_ = 0;  // bit of each axis
  unsigned homed_ = 0;
  int commands_ = 0;
  int commands_without_homing_ = 0;
  int malformed_commands_ = 0;

  // Mechanics.
  FalconVector grip_m_{0.0, 0.0, 0.12};
  std::uint8_t buttons_ = 0;

  // Faults.
  int drop_ = 0;
  int late_ = 0;
  std::chrono::nanoseconds delay_{};
  int split_ = 0;
  std::size_t split_at_ = 0;
  int insert_ = 0;
  std::size_t insert_at_ = 0;
  std::uint8_t inserted_ = 0;
  int false_ = 0;
  std::array<std::int16_t, 3> false_counts_{};
  int spoilt_loads_ = 0;
  int spoilt_chunk_ = 0;
  Echo spoilt_how_ = Echo::kWrongByte;
  int stalls_ = 0;
  bool unplugged_ = false;
};

}  // namespace sim::devices
