#include "apps/youbotctl/client.h"

#include <sys/socket.h>
#include <sys/time.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <stdexcept>
#include <string>

#include "drivers/uninterrupted.h"
#include "hal/setup_error.h"
#include "runtime/program/control_socket.h"

namespace youbotctl {
namespace {

/// youbotd answers between two checks of its robot; later while it prepares a run or opens a haptic device.
constexpr timeval kPatience{60, 0};

std::string hint(int error) {
  switch (error) {
    case ENOENT:
    case ECONNREFUSED: return "no youbotd serves there: start one with --control, or name its --socket";
    case EACCES: return "permission denied: join the group of youbotd";
    default: return std::strerror(error);
  }
}

}  // namespace

Client::Client(const std::filesystem::path& socket) : path_(socket) {
  const sockaddr_un address = runtime::control_address(path_);
  socket_ = ::socket(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0);
  const auto connected = [&] {
    return drivers::uninterrupted([&] {
             return connect(socket_, reinterpret_cast<const sockaddr*>(&address), sizeof address);
           }) == 0;
  };
  if (socket_ < 0 || !connected()) {
    const int error = errno;
    if (socket_ >= 0) close(socket_);
    throw hal::SetupError(path_.string(), "connect", hint(error));
  }
  setsockopt(socket_, SOL_SOCKET, SO_RCVTIMEO, &kPatience, sizeof kPatience);
}

Client::~Client() { close(socket_); }

nlohmann::json Client::ask(const std::string& request) {
  // youbotd would disconnect, and a commanded robot come to rest.
  if (request.size() > runtime::kLongestRequest)
    throw std::invalid_argument("the request has " + std::to_string(request.size()) + " bytes, at most " +
                                std::to_string(runtime::kLongestRequest) + " are possible");
  std::string answer(runtime::kLongestAnswer, '\0');
  ssize_t size =
      drivers::uninterrupted([&] { return send(socket_, request.data(), request.size(), MSG_NOSIGNAL); });
  if (size >= 0)
    size = drivers::uninterrupted([&] { return recv(socket_, answer.data(), answer.size(), 0); });
  if (size < 0 && errno == EAGAIN) throw hal::SetupError(path_.string(), "ask youbotd", "it does not answer");
  if (size < 0)
    throw hal::SetupError(path_.string(), "ask youbotd",
                          std::strerror(errno) + std::string("; is it still running?"));
  if (size == 0) throw hal::SetupError(path_.string(), "ask youbotd", "it has gone");
  answer.resize(static_cast<std::size_t>(size));
  nlohmann::json reply = nlohmann::json::parse(answer, nullptr, /*allow_exceptions=*/false);
  if (!reply.is_object() || !reply.contains("ok") || !reply["ok"].is_boolean() || !reply.contains("status"))
    throw hal::SetupError(path_.string(), "ask youbotd", "what answers there is no youbotd of this version");
  return reply;
}

}  // namespace youbotctl
