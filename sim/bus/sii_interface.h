/// @file
/// The controller's access to its SII EEPROM: registers 0x0500 to 0x050F (ESC data sheet section I, 11.2).
#pragma once
#include <chrono>
#include <cstdint>
#include <span>
#include <vector>

namespace sim::bus {

/// The content survives power cycles, as in an EEPROM.
class SiiInterface {
 public:
  struct Timing {
    bool reads_8_bytes = true;             ///< otherwise 4 at a time
    std::chrono::nanoseconds read_time{};  ///< busy for this time; 0: done at the end of the frame
    std::chrono::nanoseconds write_time{};
  };

  /// `registers`: the 16 bytes from 0x0500, which must outlive this.
  SiiInterface(std::vector<std::uint8_t> image, Timing timing, std::span<std::uint8_t> registers);

  /// Power-up: registers to their defaults, configuration area checked.
  void reset() noexcept;
  /// The master wrote `bytes` at 0x0500 + `offset`.
  void write(std::size_t offset, std::span<const std::uint8_t> bytes) noexcept;
  void advance(std::chrono::nanoseconds step) noexcept;

  /// Whether the configuration area was loaded with a correct checksum.
  bool loaded() const noexcept { return loaded_; }
  std::uint16_t word(std::uint32_t address) const noexcept;  ///< 0xFFFF beyond the end
  /// To damage or inspect it; has the effect of an EEPROM programmer.
  std::span<std::uint8_t> image() noexcept { return image_; }

 private:
  void load_configuration() noexcept;
  void start(std::uint16_t control) noexcept;
  void finish() noexcept;
  void set_status(std::uint16_t bits) noexcept;

  std::vector<std::uint8_t> image_;
  Timing timing_;
  std::span<std::uint8_t> registers_;
  std::chrono::nanoseconds busy_for_{};
  std::uint16_t command_ = 0;  // running
  std::uint16_t errors_ = 0;   // bits 13 and 14, until a command 0 clears them
  bool loaded_ = false;
};

}  // namespace sim::bus
