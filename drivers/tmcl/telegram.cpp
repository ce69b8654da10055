#include "drivers/tmcl/telegram.h"

#include <algorithm>
#include <numeric>

#include "drivers/tmcl/firmware_version.h"

namespace drivers::tmcl {
namespace {

void store_be(std::uint8_t* bytes, std::int32_t value) noexcept {
  const auto bits = static_cast<std::uint32_t>(value);
  for (int i = 0; i < 4; ++i) bytes[i] = static_cast<std::uint8_t>(bits >> (24 - 8 * i));
}

std::int32_t load_be(const std::uint8_t* bytes) noexcept {
  std::uint32_t bits = 0;
  for (int i = 0; i < 4; ++i) bits = bits << 8 | bytes[i];
  return static_cast<std::int32_t>(bits);
}

SerialBytes with_checksum(const MailboxBytes& telegram) noexcept {
  SerialBytes bytes{};
  std::copy(telegram.begin(), telegram.end(), bytes.begin());
  bytes[kMailboxBytes] = checksum(telegram);
  return bytes;
}

bool has_checksum(std::span<const std::uint8_t> bytes) noexcept {
  return bytes.size() == kSerialBytes && checksum(bytes.first(kMailboxBytes)) == bytes[kMailboxBytes];
}

// All carriers share these seven bytes; the bytes before them differ.
CanBytes without_first(const MailboxBytes& telegram) noexcept {
  CanBytes can;
  std::copy(telegram.begin() + 1, telegram.end(), can.data.begin());
  return can;
}

std::optional<MailboxBytes> with_first(std::uint8_t first, std::span<const std::uint8_t> data) noexcept {
  if (data.size() != 7 && data.size() != 8) return std::nullopt;
  MailboxBytes telegram{first};
  std::copy_n(data.begin(), 7, telegram.begin() + 1);
  return telegram;
}

bool echoes_value(const Request& request) noexcept {
  if (request.module != kDriveModule) return false;
  switch (request.command) {
    case Command::kSetAxisParameter:
    case Command::kStoreAxisParameter:
    case Command::kRestoreAxisParameter:
    case Command::kSetGlobalParameter:
    case Command::kStoreGlobalParameter:
    case Command::kRestoreGlobalParameter: return true;
    default: return false;
  }
}

}  // namespace

const char* name(Command command) noexcept {
  switch (command) {
    case Command::kRotateRight: return "ROR";
    case Command::kRotateLeft: return "ROL";
    case Command::kMotorStop: return "MST";
    case Command::kMoveToPosition: return "MVP";
    case Command::kSetAxisParameter: return "SAP";
    case Command::kGetAxisParameter: return "GAP";
    case Command::kStoreAxisParameter: return "STAP";
    case Command::kRestoreAxisParameter: return "RSAP";
    case Command::kSetGlobalParameter: return "SGP";
    case Command::kGetGlobalParameter: return "GGP";
    case Command::kStoreGlobalParameter: return "STGP";
    case Command::kRestoreGlobalParameter: return "RSGP";
    case Command::kReferenceSearch: return "RFS";
    case Command::kSetOutput: return "SIO";
    case Command::kGetInput: return "GIO";
    case Command::kSetCoordinate: return "SCO";
    case Command::kGetCoordinate: return "GCO";
    case Command::kCaptureCoordinate: return "CCO";
    case Command::kClearError: return "clear error";
    case Command::kStopApplication: return "stop application";
    case Command::kRunApplication: return "run application";
    case Command::kResetApplication: return "reset application";
    case Command::kGetFirmwareVersion: return "get firmware version";
  }
  return "unknown command";
}

bool is_known(Status status) noexcept {
  switch (status) {
    case Status::kWrongChecksum:
    case Status::kInvalidCommand:
    case Status::kWrongType:
    case Status::kInvalidValue:
    case Status::kEepromLocked:
    case Status::kNotAvailable:
    case Status::kProtected:
    case Status::kOk:
    case Status::kStoredInProgram: return true;
  }
  return false;
}

const char* describe(Status status) noexcept {
  switch (status) {
    case Status::kWrongChecksum: return "wrong checksum";
    case Status::kInvalidCommand: return "invalid command";
    case Status::kWrongType: return "wrong type, or a parameter this firmware does not have";
    case Status::kInvalidValue: return "invalid value";
    case Status::kEepromLocked: return "configuration EEPROM locked";
    case Status::kNotAvailable: return "command not available";
    case Status::kProtected: return "write-protected, or protected by password";
    case Status::kOk: return "ok";
    case Status::kStoredInProgram: return "stored in the TMCL program instead of executed";
  }
  return "unknown status";
}

bool asks_for_text(const Request& request) noexcept {
  return request.command == Command::kGetFirmwareVersion && request.type == 0;
}

bool accepted(const Request& request, const Reply& reply) noexcept {
  FirmwareVersion version;
  return asks_for_text(request) ? parse_version(reply.text, version) == VersionText::kValid : reply.ok();
}

bool matches(const Request& request, const Reply& reply) noexcept {
  if (accepted(request, reply) && asks_for_text(request)) return true;
  if (reply.command != request.command || !is_known(reply.status)) return false;
  if (!reply.ok()) return true;
  return !asks_for_text(request) && (!echoes_value(request) || reply.value == request.value);
}

MailboxBytes encode_mailbox(const Request& request) noexcept {
  MailboxBytes bytes{request.module, static_cast<std::uint8_t>(request.command), request.type, request.motor};
  store_be(&bytes[4], request.value);
  return bytes;
}

MailboxBytes encode_mailbox(const Reply& reply) noexcept {
  MailboxBytes bytes{reply.host, reply.module, static_cast<std::uint8_t>(reply.status),
                     static_cast<std::uint8_t>(reply.command)};
  store_be(&bytes[4], reply.value);
  return bytes;
}

std::optional<Request> decode_mailbox_request(std::span<const std::uint8_t> bytes) noexcept {
  if (bytes.size() < kMailboxBytes) return std::nullopt;
  return Request{bytes[0], static_cast<Command>(bytes[1]), bytes[2], bytes[3], load_be(&bytes[4])};
}

std::optional<Reply> decode_mailbox_reply(std::span<const std::uint8_t> bytes) noexcept {
  if (bytes.size() < kMailboxBytes) return std::nullopt;
  Reply reply{bytes[0],           bytes[1], static_cast<Status>(bytes[2]), static_cast<Command>(bytes[3]),
              load_be(&bytes[4]), {}};
  std::copy_n(bytes.begin(), reply.text.size(), reply.text.begin());
  return reply;
}

std::uint8_t checksum(std::span<const std::uint8_t> bytes) noexcept {
  return static_cast<std::uint8_t>(std::accumulate(bytes.begin(), bytes.end(), 0U));
}

SerialBytes encode_serial(const Request& request) noexcept { return with_checksum(encode_mailbox(request)); }
SerialBytes encode_serial(const Reply& reply) noexcept { return with_checksum(encode_mailbox(reply)); }

std::optional<Request> decode_serial_request(std::span<const std::uint8_t> bytes) noexcept {
  if (!has_checksum(bytes)) return std::nullopt;
  return decode_mailbox_request(bytes);
}

std::optional<Reply> decode_serial_reply(std::span<const std::uint8_t> bytes) noexcept {
  if (!has_checksum(bytes)) return std::nullopt;
  return decode_mailbox_reply(bytes);
}

CanBytes encode_can(const Request& request) noexcept {
  CanBytes can = without_first(encode_mailbox(request));
  if (asks_for_text(request)) can.size = 8;
  return can;
}

CanBytes encode_can(const Reply& reply) noexcept { return without_first(encode_mailbox(reply)); }

std::optional<Request> decode_can_request(std::uint8_t module, std::span<const std::uint8_t> data) noexcept {
  const auto telegram = with_first(module, data);
  return telegram ? decode_mailbox_request(*telegram) : std::nullopt;
}

std::optional<Reply> decode_can_reply(std::uint8_t host, std::span<const std::uint8_t> data) noexcept {
  const auto telegram = with_first(host, data);
  if (!telegram) return std::nullopt;
  auto reply = decode_mailbox_reply(*telegram);
  reply->text.fill(0);
  std::copy(data.begin(), data.end(), reply->text.begin());
  return reply;
}

}  // namespace drivers::tmcl
