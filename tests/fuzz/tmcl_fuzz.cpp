// Telegrams on each carrier, the version text, and process data.
#include <algorithm>
#include <array>
#include <string_view>

#include "drivers/tmcl/firmware_version.h"
#include "drivers/tmcl/process_data.h"
#include "drivers/tmcl/telegram.h"
#include "tests/fuzz/fuzz_target.h"

namespace {

using drivers::tmcl::CanBytes;
using drivers::tmcl::Command;
using drivers::tmcl::CurrentSign;
using drivers::tmcl::DriveInput;
using drivers::tmcl::DriveOutput;
using drivers::tmcl::Firmware;
using drivers::tmcl::FirmwareVersion;
using drivers::tmcl::kMailboxBytes;
using drivers::tmcl::Reply;
using drivers::tmcl::Request;
using drivers::tmcl::Status;
using drivers::tmcl::VersionText;
using fuzz::require;

bool starts_with(const fuzz::Bytes& bytes, std::span<const std::uint8_t> start) {
  return bytes.size() >= start.size() && std::equal(start.begin(), start.end(), bytes.begin());
}

void use(const Request& request, const Reply& reply) {
  require(*name(request.command) != '\0' && *describe(reply.status) != '\0');
  require(is_known(reply.status) == (describe(reply.status) != std::string_view("unknown status")));
  if (matches(request, reply) && accepted(request, reply)) require(asks_for_text(request) || reply.ok());
}

/// A drive's inputs, and the outputs as read by an emulated board: reading returns the written values.
void read_process_data(const fuzz::Bytes& bytes) {
  for (const Firmware firmware : {Firmware::k148, Firmware::k200}) {
    DriveInput input;
    const std::size_t length = input_bytes(firmware);
    require(unpack(firmware, bytes, input) == (bytes.size() >= length));
    if (bytes.size() < length) {
      require(input == DriveInput{});
      continue;
    }
    fuzz::Bytes again(length);
    require(pack(firmware, input, again) && starts_with(bytes, again));
    for (const CurrentSign sign : {CurrentSign::kSigned, CurrentSign::kAbsolute})
      (void)signed_current_mA(sign, input, {});
  }
  DriveOutput output;
  require(unpack(bytes, output) == (bytes.size() >= drivers::tmcl::kOutputBytes));
  fuzz::Bytes again(drivers::tmcl::kOutputBytes);
  require(pack(output, again) && (bytes.size() < again.size() || starts_with(bytes, again)));
}

}  // namespace

std::vector<fuzz::Bytes> fuzz::seeds() {
  const Request request{0, Command::kGetAxisParameter, 150, 0, -1000};
  const Reply reply{1, 0, Status::kOk, Command::kGetAxisParameter, 65'535, {}};
  const auto bytes = [](const auto& array) { return Bytes(array.begin(), array.end()); };
  std::vector<Bytes> result{bytes(encode_mailbox(request)), bytes(encode_mailbox(reply)),
                            bytes(encode_serial(request)), bytes(encode_serial(reply))};
  const CanBytes can = encode_can(request);
  result.emplace_back(can.data.begin(), can.data.begin() + can.size);
  for (const std::string_view text : {"1610V148", "174V1.48", "KR842V20", "1610V200"})
    result.emplace_back(text.begin(), text.end());
  DriveInput input;
  input.position_ticks = -1000;
  input.current_mA = 700;
  input.velocity_rpm = -156;
  for (const Firmware firmware : {Firmware::k148, Firmware::k200}) {
    result.emplace_back(input_bytes(firmware));
    require(pack(firmware, input, result.back()));
  }
  return result;
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const fuzz::Bytes bytes(data, data + size);
  read_process_data(bytes);

  // Reading returns the written values.
  const auto request = drivers::tmcl::decode_mailbox_request(bytes);
  const auto reply = drivers::tmcl::decode_mailbox_reply(bytes);
  require(request.has_value() == (size >= kMailboxBytes) && reply.has_value() == request.has_value());
  if (request) {
    require(starts_with(bytes, encode_mailbox(*request)));
    require(starts_with(bytes, encode_mailbox(*reply)));
    use(*request, *reply);
  }
  if (const auto serial = drivers::tmcl::decode_serial_request(bytes))
    require(starts_with(bytes, encode_serial(*serial)));
  if (const auto serial = drivers::tmcl::decode_serial_reply(bytes))
    require(starts_with(bytes, encode_serial(*serial)));
  if (const auto can = drivers::tmcl::decode_can_request(3, bytes)) {
    require(can->module == 3);
    const CanBytes again = encode_can(*can);
    require(starts_with(bytes, std::span(again.data).first(7)));
  }
  if (const auto can = drivers::tmcl::decode_can_reply(2, bytes)) {
    require(can->host == 2);
    const CanBytes again = encode_can(*can);
    require(starts_with(bytes, std::span(again.data).first(7)));
  }

  constexpr FirmwareVersion kUntouched{-1, -1};
  FirmwareVersion version = kUntouched;
  const VersionText text = parse_version(bytes, version);
  require((text == VersionText::kValid) == (version != kUntouched));
  if (text == VersionText::kValid) require(version.controller >= 0 && version.version >= 0);
  return 0;
}
