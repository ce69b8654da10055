// Requests to a running service with a simulated base. Each line is a request; after a zero byte it comes
// from another connection. A byte 2 stands for a thousand bytes: every prefix of each seed is an input, and
// those of a long request would differ in its length only.
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <chrono>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <sstream>
#include <string>
#include <string_view>
#include <thread>

#include "apps/youbotd/serve.h"
#include "runtime/configuration/toml_reader.h"
#include "runtime/log.h"
#include "runtime/program/control_socket.h"
#include "tests/fuzz/ceilings.h"
#include "tests/fuzz/fuzz_target.h"
#include "tests/fuzz/memory_file.h"
#include "tests/support/temporary_directory.h"

namespace {

using fuzz::require;
using nlohmann::json;
using namespace std::chrono_literals;

class Connection {
 public:
  explicit Connection(const std::filesystem::path& path)
      : socket_(socket(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0)) {
    const sockaddr_un address = runtime::control_address(path);
    // Refused while the service starts.
    while (connect(socket_, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0)
      std::this_thread::sleep_for(1ms);
  }
  Connection(const Connection&) = delete;
  Connection& operator=(const Connection&) = delete;
  ~Connection() { close(socket_); }

  /// Empty: the service disconnected, as for clients that send nothing or too much.
  std::optional<std::string> ask(std::string_view request) const {
    static std::array<char, 2 * runtime::kLongestAnswer> answer;
    if (send(socket_, request.data(), request.size(), MSG_NOSIGNAL) < 0) return std::nullopt;
    const ssize_t size = recv(socket_, answer.data(), answer.size(), MSG_TRUNC);
    if (size <= 0) return std::nullopt;
    require(static_cast<std::size_t>(size) <= runtime::kLongestAnswer);
    return std::string(answer.data(), static_cast<std::size_t>(size));
  }

 private:
  int socket_;
};

/// Runs until the process ends.
class RunningService {
 public:
  RunningService() {
    file_.hold(
        "robot = \"loopback\"\n[loop]\nperiod_s = 0.005\ncommander_timeout_s = 10\n[limits]\nforce_N = 5\n"
        "wheel_speed_rad_per_s = 12\n[path]\nspeed_m_per_s = 0.1\n[[path.leg]]\nforward_m = 1\n");
    file_limits_ = configuration({});
    thread_ = std::thread([this] {
      youbotd::serve(
          {.service = {.config_file = file_.path(),
                       .configuration = [this](const auto& settings) { return configuration(settings); }},
           .control_socket = path(),
           .allow_non_real_time = true},
          stop_);
    });
    const Connection started(path());
    spdlog::set_level(spdlog::level::off);
  }
  RunningService(const RunningService&) = delete;
  RunningService& operator=(const RunningService&) = delete;
  ~RunningService() {
    stop_ = true;
    thread_.join();
  }

  std::filesystem::path path() const { return folder_ / "control"; }

  /// The status in an answer that keeps its format.
  json check(const std::string& answer, std::string_view request) const {
    json parsed = json::parse(answer);
    require(parsed.at("ok").is_boolean() && parsed.contains("error") != parsed.at("ok").get<bool>());
    if (request == "status" || request == "alive" || request == "stop") require(parsed.at("ok").get<bool>());
    json& status = parsed.at("status");
    require(status.at("format") == "youbotd-status/1" && status.at("enabled").is_boolean());
    // Without an order to enable there is no commanding client.
    require(status.at("enabled").get<bool>() || status.at("commander").is_null());
    check_settings(status.at("settings"));
    return status;
  }

 private:
  operation::Config configuration(const std::map<std::string, std::string>& settings) const {
    return operation::load_config(file_.path(), settings);
  }
  void check_settings(const json& settings) const {
    if (!settings.is_object()) return;  // too long for an answer
    try {
      fuzz::check_ceilings(configuration(settings.get<std::map<std::string, std::string>>()), file_limits_);
    } catch (const runtime::ConfigError&) {
      // The settings after an unset need not be usable: enable reports it.
    }
  }

  fuzz::MemoryFile file_;
  support::TemporaryDirectory folder_;
  operation::Config file_limits_;
  std::atomic<bool> stop_{false};
  std::thread thread_;
};

constexpr char kThousandBytes = '\x02';

std::string expanded(std::string_view request) {
  std::string text;
  for (const char byte : request)
    text.append(byte == kThousandBytes ? 1000 : 1, byte == kThousandBytes ? 'x' : byte);
  return text;
}

/// Drives off, nothing set: as the next input wants it.
void tidy_up(const RunningService& service, const std::set<std::string>& keys) {
  const Connection connection(service.path());
  require(connection.ask("disable").has_value());
  for (;;) {
    const auto answer = connection.ask("status");
    require(answer.has_value());
    if (!service.check(*answer, "status").at("enabled").get<bool>()) break;
    std::this_thread::sleep_for(1ms);
  }
  // A key too long for that was too long to be set.
  for (const std::string& key : keys)
    if (const std::string unset = "unset " + key; unset.size() <= runtime::kLongestRequest)
      require(connection.ask(unset).has_value());
  require(connection.ask("mode path").has_value());
  require(json::parse(connection.ask("status").value()).at("status").at("settings").empty());
}

}  // namespace

std::vector<fuzz::Bytes> fuzz::seeds() {
  using namespace std::string_literals;
  // With it a request is a little too long: its prefixes have all lengths around the limit.
  const std::string longest = "\x02\x02\x02\x02" + std::string(runtime::kLongestRequest - 4000, 'x');
  std::vector<Bytes> seeds;
  for (
      const std::string& text :
      {"status\nset limits.force_N 4\nunset limits.force_N\nset limits.force_N 6\nalive"s,
       "mode velocity\nenable\nset velocity 0.05 0 0.1\nalive\n\0stop\n\0status\ndisable"s,
       "enable\n\0enable\nset path.rest_s 1\n\0disable\nstop"s,
       "set velocity nan 0 0\nset velocity 1 2 3 4\nmode x"s,
       "set limits.wheel_speed_rad_per_s 11 # " + longest, "set path.rest_s 2 # \x01\xFF" + longest + longest,
       "set path.leg [{forward_m = 2}]\nset robot \"wire\"\nset path 5\nset compensation.margin 0.5\nunset path"s})
    seeds.push_back(bytes_of(text));
  return seeds;
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const RunningService service;
  std::optional<Connection> connections[2];
  std::set<std::string> keys;
  std::string_view left(reinterpret_cast<const char*>(data), size);
  while (!left.empty()) {
    std::string_view line = left.substr(0, left.find('\n'));
    left.remove_prefix(std::min(left.size(), line.size() + 1));
    const bool other = line.starts_with('\0');
    if (other) line.remove_prefix(1);
    const std::string request = expanded(line);
    std::istringstream words(request);
    std::string command;
    std::string key;
    if (words >> command >> key && command == "set") keys.insert(key);
    std::optional<Connection>& connection = connections[other ? 1 : 0];
    if (!connection) connection.emplace(service.path());
    if (const auto answer = connection->ask(request)) {
      require(!request.empty() && request.size() <= runtime::kLongestRequest);
      (void)service.check(*answer, request);
    } else {
      require(request.empty() || request.size() > runtime::kLongestRequest);
      connection.reset();
    }
  }
  for (auto& connection : connections) connection.reset();
  tidy_up(service, keys);
  return 0;
}
