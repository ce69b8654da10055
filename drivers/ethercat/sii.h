/// @file
/// The slave information interface: a slave's description in its EEPROM (ETG.2010).
#pragma once
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace drivers::ethercat {

enum class SyncManagerUse : std::uint8_t {
  kUnused = 0,
  kMailboxOut = 1,
  kMailboxIn = 2,
  kOutputs = 3,
  kInputs = 4
};

struct SyncManagerInfo {
  std::uint16_t start = 0;
  std::uint16_t length = 0;
  std::uint8_t control = 0;
  std::uint8_t enable = 0;
  SyncManagerUse use = SyncManagerUse::kUnused;
};

struct PdoInfo {
  std::uint16_t index = 0;
  std::uint8_t sync_manager = 0xFF;  ///< 0xFF: not assigned
  std::uint16_t bits = 0;
};

struct MailboxWindow {
  std::uint16_t start = 0;
  std::uint16_t length = 0;  ///< 0: no mailbox
};

/// Bits of the mailbox protocols (ETG.1000.6, table 18).
namespace mailbox_protocol {
inline constexpr std::uint16_t kAoe = 0x0001;
inline constexpr std::uint16_t kEoe = 0x0002;
inline constexpr std::uint16_t kCoe = 0x0004;
inline constexpr std::uint16_t kFoe = 0x0008;
inline constexpr std::uint16_t kSoe = 0x0010;
inline constexpr std::uint16_t kVoe = 0x0020;
}  // namespace mailbox_protocol

/// Word addresses of the identity.
inline constexpr std::uint16_t kSiiVendorWord = 0x08;
inline constexpr std::uint16_t kSiiProductWord = 0x0A;
inline constexpr std::uint16_t kSiiSerialWord = 0x0E;

struct SiiInfo {
  std::uint32_t vendor = 0;
  std::uint32_t product = 0;
  std::uint32_t revision = 0;
  std::uint32_t serial = 0;
  std::uint16_t alias = 0;
  MailboxWindow mailbox_out;  ///< master to slave, sync manager 0
  MailboxWindow mailbox_in;   ///< slave to master, sync manager 1
  std::uint16_t mailbox_protocols = 0;
  std::string name;  ///< from the general category: "EL1008 8K. Dig. Eingang 24V, 3ms"
  /// Usually the order code, "EL1008": SOEM, and drivers based on it, use it as the name.
  std::string first_string;
  std::string group;  ///< from the general category; simulated_bus.h lists its possible meanings
  std::vector<SyncManagerInfo> sync_managers;
  std::vector<PdoInfo> output_pdos;  ///< RxPDOs
  std::vector<PdoInfo> input_pdos;   ///< TxPDOs

  bool is_called(std::string_view text) const noexcept { return name == text || first_string == text; }
  bool has_mailbox() const noexcept { return mailbox_out.length > 0 && mailbox_in.length > 0; }
  bool speaks_coe() const noexcept { return (mailbox_protocols & mailbox_protocol::kCoe) != 0; }
};

/// Collects an image word by word, reading only what it needs: the fixed area, then, along the chain of
/// categories, those that SiiInfo needs. Garbage ends in an error, never in an endless chain.
class SiiReader {
 public:
  /// Address of the next word needed; empty if complete or failed.
  std::optional<std::uint16_t> next_word() const noexcept;
  /// Stores `bytes` (4 or 8) read at next_word().
  void store(std::span<const std::uint8_t> bytes);

  /// Empty: still reading, or well-formed.
  const std::string& error() const noexcept { return error_; }
  /// Call after next_word() returned empty. Damaged categories are left out and named in error().
  SiiInfo info();

 private:
  void begin_header();
  void take_header();
  void give_up(const std::string& error);
  void parse_strings(std::span<const std::uint8_t> category);
  void parse_sync_managers(std::span<const std::uint8_t> category, SiiInfo& info) const;
  void parse_pdos(std::span<const std::uint8_t> category, std::vector<PdoInfo>& pdos);

  struct Category {
    std::uint16_t type = 0;
    std::size_t begin_bytes = 0;
    std::size_t size_bytes = 0;
  };
  std::vector<std::uint8_t> image_;
  std::vector<Category> categories_;
  std::vector<std::string> strings_;
  std::uint32_t next_word_ = 0;
  std::uint32_t goal_word_ = 0x40;    // needed before the next decision
  std::uint32_t header_word_ = 0x40;  // of the next category
  bool reading_header_ = false;
  std::size_t categories_seen_ = 0;
  bool complete_ = false;
  std::string error_;
};

}  // namespace drivers::ethercat
