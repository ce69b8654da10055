/// @file
/// TMCL telegrams: requests, replies, and their bytes on each carrier (TMCL reference manual, chapter 2; the
/// youBot's mailbox form from its official driver). Values are sent most significant byte first.
///
///   carrier         request                                         reply
///   mailbox, 8      module command type motor value[4]              host module status command value[4]
///   serial, 9       the same, then the 8-bit sum of the eight       the same, then the sum
///   CAN, 7          command type motor value[4];                    module status command value[4];
///                   identifier: module                              identifier: host
///
/// On EtherCAT the telegram is in place of the standard mailbox header: there is none. All functions are
/// cycle-safe. Received bytes are never trusted: a wrong length or sum returns nothing.
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

namespace drivers::tmcl {

enum class Command : std::uint8_t {
  kRotateRight = 1,  ///< increasing position
  kRotateLeft = 2,
  kMotorStop = 3,
  kMoveToPosition = 4,  ///< type: MoveType
  kSetAxisParameter = 5,
  kGetAxisParameter = 6,
  kStoreAxisParameter = 7,    ///< RAM to EEPROM
  kRestoreAxisParameter = 8,  ///< EEPROM to RAM
  kSetGlobalParameter = 9,
  kGetGlobalParameter = 10,
  kStoreGlobalParameter = 11,
  kRestoreGlobalParameter = 12,
  kReferenceSearch = 13,
  kSetOutput = 14,
  kGetInput = 15,
  kSetCoordinate = 30,
  kGetCoordinate = 31,
  kCaptureCoordinate = 32,
  kClearError = 36,
  kStopApplication = 128,
  kRunApplication = 129,
  kResetApplication = 131,
  kGetFirmwareVersion = 136,  ///< type 0: the reply is eight characters; type 1: an ordinary reply
};
/// The mnemonic of the TMCL manual ("SAP"), or "unknown command".
const char* name(Command command) noexcept;

enum class MoveType : std::uint8_t { kAbsolute = 0, kRelative = 1, kCoordinate = 2 };

enum class Status : std::uint8_t {
  kWrongChecksum = 1,
  kInvalidCommand = 2,
  kWrongType = 3,
  kInvalidValue = 4,
  kEepromLocked = 5,
  kNotAvailable = 6,
  kProtected = 8,  ///< an addition of the youBot's firmware
  kOk = 100,
  kStoredInProgram = 101,  ///< the module is in download mode and has executed nothing
};
bool is_known(Status status) noexcept;
const char* describe(Status status) noexcept;

inline constexpr std::uint8_t kDriveModule = 0;
inline constexpr std::uint8_t kGripperModule = 1;  ///< behind the mailbox of arm joint 5
inline constexpr std::uint8_t kUserVariableBank = 2;

struct Request {
  std::uint8_t module = kDriveModule;
  Command command = Command::kGetAxisParameter;
  std::uint8_t type = 0;   ///< parameter number or kind of motion
  std::uint8_t motor = 0;  ///< motor, or bank of a global parameter
  std::int32_t value = 0;
  friend bool operator==(const Request&, const Request&) = default;
};

struct Reply {
  std::uint8_t host = 0;
  std::uint8_t module = 0;
  Status status{};
  Command command{};
  std::int32_t value = 0;
  /// The eight bytes with the firmware version if the request was for text; see parse_version().
  std::array<std::uint8_t, 8> text{};

  bool ok() const noexcept { return status == Status::kOk; }
};

/// True if `reply` answers `request`, possibly with a refusal. The rules are the official driver's: command
/// and status, and a SET to a drive must echo the value. GET carries another value; the gripper and motion
/// commands are not known to echo. No carrier echoes the parameter number, so two GETs cannot be
/// distinguished: use one request at a time, and wait for late replies.
bool matches(const Request& request, const Reply& reply) noexcept;
/// Whether the module executed the request, for a matching reply.
bool accepted(const Request& request, const Reply& reply) noexcept;
/// The reply is bare text, without status or command.
bool asks_for_text(const Request& request) noexcept;

// Mailbox of the youBot's slaves. It is written and read in full length; only the first eight bytes are used.
inline constexpr std::size_t kMailboxBytes = 8;
using MailboxBytes = std::array<std::uint8_t, kMailboxBytes>;
MailboxBytes encode_mailbox(const Request& request) noexcept;
MailboxBytes encode_mailbox(const Reply& reply) noexcept;
std::optional<Request> decode_mailbox_request(std::span<const std::uint8_t> bytes) noexcept;
std::optional<Reply> decode_mailbox_reply(std::span<const std::uint8_t> bytes) noexcept;

// RS232, RS485, USB. A version text has no checksum: pass its bytes 1 to 8 to parse_version().
inline constexpr std::size_t kSerialBytes = 9;
using SerialBytes = std::array<std::uint8_t, kSerialBytes>;
SerialBytes encode_serial(const Request& request) noexcept;
SerialBytes encode_serial(const Reply& reply) noexcept;
std::optional<Request> decode_serial_request(std::span<const std::uint8_t> bytes) noexcept;
std::optional<Reply> decode_serial_reply(std::span<const std::uint8_t> bytes) noexcept;
/// Sum of the bytes, modulo 256.
std::uint8_t checksum(std::span<const std::uint8_t> bytes) noexcept;

/// CAN: seven data bytes. Eight are accepted too, because PyTrinamic leaves the checksum on, and sent for
/// text requests, because the module would otherwise answer with only seven of eight characters (TMCL
/// manual).
struct CanBytes {
  std::array<std::uint8_t, 8> data{};
  std::uint8_t size = 7;
};
/// `request.module` is not in the data; the CAN identifier addresses the module.
CanBytes encode_can(const Request& request) noexcept;
CanBytes encode_can(const Reply& reply) noexcept;
std::optional<Request> decode_can_request(std::uint8_t module, std::span<const std::uint8_t> data) noexcept;
std::optional<Reply> decode_can_reply(std::uint8_t host, std::span<const std::uint8_t> data) noexcept;

}  // namespace drivers::tmcl
