#include <optional>
#include <string>

#include "apps/youbotd/check_parts.h"
#include "apps/youbotd/control_server.h"
#include "hal/setup_error.h"
#include "live/web_server.h"
#include "ros2/node.h"

namespace youbotd {
namespace {

using Mark = Finding::Mark;

struct NoListener final : ControlServer::Listener {
  std::string answer(const Peer& /*peer*/, const std::string& /*request*/) override { return {}; }
  void gone(const Peer& /*peer*/) override {}
  bool commands(const Peer& /*peer*/) const override { return false; }
};

struct EmptySite final : live::Site {
  live::Response answer(const live::Request& /*request*/) override { return {.status = 404}; }
  std::optional<Opening> open(const live::Request& /*request*/) override { return std::nullopt; }
  void tick() override {}
};

}  // namespace

Finding check_control(const std::filesystem::path& socket) {
  NoListener listener;
  try {
    const ControlServer tried(socket, listener);
  } catch (const hal::SetupError& error) {
    return {Mark::kFail, error.what()};
  }
  return {Mark::kOk, "control: " + socket.string() + " can be served"};
}

Finding check_page(const std::string& where) {
  EmptySite site;
  try {
    const live::WebServer tried(where, site);
    return {Mark::kOk, "page: " + tried.url() + " can be served"};
  } catch (const hal::SetupError& error) {
    return {Mark::kFail, error.what()};
  }
}

Finding check_ros2(std::uint32_t domain) {
  try {
    const ros2::Node tried(domain, "youbotd");
  } catch (const hal::SetupError& error) {
    return {Mark::kFail, error.what()};
  }
  return {Mark::kOk, "ros2: domain " + std::to_string(domain) + " can be joined"};
}

}  // namespace youbotd
