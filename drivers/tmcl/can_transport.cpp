#include "drivers/tmcl/can_transport.h"

#include <algorithm>
#include <system_error>
#include <utility>

#include "drivers/setup_error.h"

namespace drivers::tmcl {
namespace {

// Frames examined in one poll(): error frames may flood.
constexpr int kMaxFrames = 8;

}  // namespace

CanTransport::CanTransport(can::SocketCan socket, const CanIdentifiers& identifiers)
    : socket_(std::move(socket)),
      identifiers_(identifiers),
      name_(socket_.name() + ", module " + std::to_string(identifiers.module)) {
  const bool sound = identifiers.module <= CAN_SFF_MASK && identifiers.reply <= CAN_SFF_MASK &&
                     identifiers.module != identifiers.reply;
  if (!sound) {
    throw SetupError({name_, "choose CAN identifiers", "two different ones from 0 to 2047",
                      std::to_string(identifiers.module) + " and " + std::to_string(identifiers.reply),
                      "use the module's global parameters 71 (its own) and 70 (reply); 1 and 2 by default"});
  }
}

bool CanTransport::post(const Request& request) noexcept {
  if (request.module != kDriveModule) return false;
  const CanBytes bytes = encode_can(request);
  can_frame frame{};
  frame.can_id = identifiers_.module;
  frame.can_dlc = bytes.size;
  std::copy(bytes.data.begin(), bytes.data.end(), frame.data);
  return socket_.send(frame, std::chrono::nanoseconds(0));
}

std::optional<Reply> CanTransport::poll() noexcept {
  for (int i = 0; i < kMaxFrames; ++i) {
    can_frame frame{};
    switch (socket_.receive(frame, std::chrono::nanoseconds(0))) {
      case can::Received::kNothing:
      case can::Received::kFailed: return std::nullopt;
      case can::Received::kBusError: break;
      case can::Received::kFrame:
        // The flags of extended and remote frames are part of can_id, so those differ too.
        if (frame.can_id != identifiers_.reply) break;
        if (auto reply =
                decode_can_reply(static_cast<std::uint8_t>(frame.can_id), {frame.data, frame.can_dlc})) {
          socket_.clear_errors();
          return reply;
        }
        break;
    }
  }
  return std::nullopt;
}

std::string CanTransport::transport_fault() const {
  if (socket_.bus_error().any()) return describe(socket_.bus_error());
  if (socket_.last_error() != 0)
    return "last error: " + std::generic_category().message(socket_.last_error());
  return {};
}

}  // namespace drivers::tmcl
