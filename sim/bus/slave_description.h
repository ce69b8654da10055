/// @file
/// Description of a slave: the content of its SII memory.
#pragma once
#include <cstdint>
#include <string>
#include <vector>

namespace sim::bus {

/// One object of a process data object; bits of index 0 are filler.
struct PdoEntry {
  std::uint16_t index = 0;
  std::uint8_t subindex = 0;
  std::uint8_t bits = 8;
};

/// Process data of one direction.
struct ProcessImage {
  std::uint16_t start = 0;          ///< first of three buffers in process memory, from 0x1000
  std::uint16_t bytes = 0;          ///< 0: none
  std::vector<PdoEntry> entries{};  ///< may be shorter than `bytes`: the image is padded
};

struct MailboxArea {
  std::uint16_t start = 0;
  std::uint16_t length = 0;  ///< 0: none
};

/// Mailbox protocols of the SII, word 0x1C (ETG.1000.6, table 18). A headerless TMCL mailbox has none.
namespace mailbox_protocol {
inline constexpr std::uint16_t kAoE = 0x01;
inline constexpr std::uint16_t kEoE = 0x02;
inline constexpr std::uint16_t kCoE = 0x04;
inline constexpr std::uint16_t kFoE = 0x08;
inline constexpr std::uint16_t kSoE = 0x10;
inline constexpr std::uint16_t kVoE = 0x20;
}  // namespace mailbox_protocol

/// A plain struct; build_sii_image() and EmulatedSlave check it.
struct SlaveDescription {
  std::string name;
  std::string order_code{};  ///< the first string of the SII; empty: the name
  std::string group{};       ///< of the SII's general category; empty: none
  std::uint32_t vendor = 0;
  std::uint32_t product = 0;
  std::uint32_t revision = 0;
  std::uint32_t serial = 0;
  std::uint16_t station_alias = 0;

  MailboxArea mailbox_out{};  ///< master to slave, sync manager 0
  MailboxArea mailbox_in{};   ///< slave to master, sync manager 1
  MailboxArea boot_mailbox_out{};
  MailboxArea boot_mailbox_in{};
  std::uint16_t mailbox_protocols = 0;

  ProcessImage outputs{};  ///< master to slave
  ProcessImage inputs{};   ///< slave to master

  bool has_distributed_clock = false;
  std::uint8_t fmmu_count = 8;
  std::uint8_t sync_manager_count = 8;
  std::uint8_t ram_kilobytes = 8;
};

/// Types of the SII category SYNCM (ETG.1000.6, table 23).
enum class SyncManagerUse : std::uint8_t {
  kUnused = 0,
  kMailboxOut = 1,
  kMailboxIn = 2,
  kOutputs = 3,
  kInputs = 4
};

struct SyncManagerSetting {
  SyncManagerUse use = SyncManagerUse::kUnused;
  std::uint16_t start = 0;
  std::uint16_t length = 0;
  std::uint8_t control = 0;
};

/// The sync managers in their usual order: mailbox out, mailbox in (both or none), outputs, inputs. Empty
/// outputs or inputs keep their place with length 0; a slave with neither has none.
std::vector<SyncManagerSetting> sync_managers_of(const SlaveDescription& description);

/// @throws std::invalid_argument naming the slave and everything invalid.
void validate(const SlaveDescription& description);

}  // namespace sim::bus
