/// @file
/// EtherCAT frames and datagrams as bytes (ETG.1000.4, section 5).
///
/// A frame: Ethernet header (14), EtherCAT header (2: length 11 bits, type 1), then datagrams:
///   command 1 | index 1 | address 4 | length 11 bits, circulating 1, more 1 | interrupt 2 | data | counter 2
/// All little-endian except the EtherType.
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <type_traits>

namespace drivers::ethercat {

inline constexpr std::uint16_t kEtherType = 0x88A4;
inline constexpr std::size_t kEthernetHeaderBytes = 14;
inline constexpr std::size_t kFrameHeaderBytes = kEthernetHeaderBytes + 2;
inline constexpr std::size_t kDatagramHeaderBytes = 10;
inline constexpr std::size_t kCounterBytes = 2;
inline constexpr std::size_t kDatagramOverheadBytes = kDatagramHeaderBytes + kCounterBytes;
inline constexpr std::size_t kMinFrameBytes = 60;  ///< shorter ones are padded; without the check sequence
inline constexpr std::size_t kMaxFrameBytes = 1514;
inline constexpr std::size_t kMaxDatagramBytes = kMaxFrameBytes - kFrameHeaderBytes - kDatagramOverheadBytes;

enum class Command : std::uint8_t {
  kNop = 0,
  kAprd = 1,  ///< read by position on the bus
  kApwr = 2,
  kAprw = 3,
  kFprd = 4,  ///< read by configured station address
  kFpwr = 5,
  kFprw = 6,
  kBrd = 7,  ///< read all, results ORed
  kBwr = 8,
  kBrw = 9,
  kLrd = 10,  ///< read logical memory, mapped by the FMMUs
  kLwr = 11,
  kLrw = 12,
  kArmw = 13,  ///< one slave reads, all behind it write
  kFrmw = 14,
};
inline constexpr std::uint8_t kHighestCommand = 14;

using MacAddress = std::array<std::uint8_t, 6>;
/// Masters send to the broadcast address. The first slave sets kReturnedBit in the source address (ESC data
/// sheet, section I, "Frame processing"), so a master's own address must not have it.
inline constexpr MacAddress kBroadcast{0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF};
inline constexpr MacAddress kMasterMac{0x10, 0x10, 0x10, 0x10, 0x10, 0x10};
inline constexpr std::uint8_t kReturnedBit = 0x02;
inline constexpr std::size_t kSourceMacOffset = 6;

/// Setup: kMasterMac with a random end, so that a master can distinguish its own frames from those of another
/// master, even in the same program.
MacAddress unique_master_mac();

/// Register or memory `offset` of one slave; on the wire the slave's address is the lower half.
constexpr std::uint32_t address_of(std::uint16_t slave, std::uint16_t offset) noexcept {
  return static_cast<std::uint32_t>(offset) << 16 | slave;
}
/// Auto-increment address of the slave at `position`: the slave that counts it up to zero answers.
constexpr std::uint16_t position_address(std::uint16_t position) noexcept {
  return static_cast<std::uint16_t>(-position);
}

/// A view into a frame; valid as long as the frame's bytes.
struct Datagram {
  Command command = Command::kNop;
  std::uint8_t index = 0;
  std::uint32_t address = 0;
  std::uint16_t interrupt = 0;
  std::span<std::uint8_t> data;
  std::uint8_t* header = nullptr;   ///< first byte of the datagram
  std::uint8_t* counter = nullptr;  ///< working counter, little-endian

  std::uint16_t slave() const noexcept { return static_cast<std::uint16_t>(address); }
  std::uint16_t offset() const noexcept { return static_cast<std::uint16_t>(address >> 16); }
  std::uint16_t working_counter() const noexcept {
    return static_cast<std::uint16_t>(counter[0] | counter[1] << 8);
  }
};

/// Builds a frame in its own memory. Cycle-safe: no allocation.
class FrameWriter {
 public:
  explicit FrameWriter(const MacAddress& source = kMasterMac) noexcept : source_(source) { clear(); }

  void clear() noexcept;
  /// Room left for one more datagram's data.
  std::size_t free_bytes() const noexcept;
  /// Appends a datagram with zeroed data and counter and returns it for filling. If it does not fit (`length`
  /// over free_bytes()), `data` is empty and `counter` null.
  Datagram add(Command command, std::uint8_t index, std::uint32_t address, std::size_t length) noexcept;
  /// The frame for the wire, padded to the minimum; valid until clear() or add().
  std::span<const std::uint8_t> bytes() noexcept;
  bool empty() const noexcept { return last_ == 0; }
  const MacAddress& source() const noexcept { return source_; }

 private:
  MacAddress source_;
  std::array<std::uint8_t, kMaxFrameBytes> buffer_;
  std::size_t size_ = 0;
  std::size_t last_ = 0;  // offset of the last datagram, 0: none
};

enum class FrameError : std::uint8_t {
  kNone,
  kTooShort,      ///< no room for the headers
  kNotEthercat,   ///< another EtherType
  kNotDatagrams,  ///< EtherCAT, but not of type 1
  kTruncated,     ///< a length points beyond the end
  kUnknownCommand,
  kLengthMismatch,  ///< the datagrams end before or after the length in the frame header
};
const char* describe(FrameError error) noexcept;

/// Iterates over the datagrams of a frame that the master received. parse() checks all of them, so that
/// next() stays inside the buffer whatever the bytes. Emulated slaves have their own rules
/// (sim/bus/passing_frame.h). Cycle-safe.
class FrameReader {
 public:
  /// `frame` must outlive the reader and its datagrams, which may change it.
  FrameError parse(std::span<std::uint8_t> frame) noexcept;
  /// False after the last one, or if parse() failed.
  bool next(Datagram& datagram) noexcept;

 private:
  std::span<std::uint8_t> frame_;
  std::size_t position_ = 0;
  std::size_t end_ = 0;
};

/// Little-endian numbers in memory, received or to be sent.
template <typename T>
constexpr T load_le(const std::uint8_t* bytes) noexcept {
  using U = std::make_unsigned_t<T>;
  U value = 0;
  for (std::size_t i = 0; i < sizeof(T); ++i)
    value = static_cast<U>(value | static_cast<U>(U{bytes[i]} << (8 * i)));
  return static_cast<T>(value);
}
template <typename T>
constexpr void store_le(std::uint8_t* bytes, T value) noexcept {
  const auto unsigned_value = static_cast<std::make_unsigned_t<T>>(value);
  for (std::size_t i = 0; i < sizeof(T); ++i) bytes[i] = static_cast<std::uint8_t>(unsigned_value >> (8 * i));
}

}  // namespace drivers::ethercat
