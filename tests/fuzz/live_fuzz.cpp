// What reaches the page's server from outside, behind HTTP and WebSocket: each line is a message of a client
// of the stream, and a Host header.
#include <unistd.h>
#include <algorithm>
#include <array>
#include <cctype>
#include <cstdint>
#include <cstring>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>

#include "live/foxglove.h"
#include "live/host_name.h"
#include "tests/fuzz/fuzz_target.h"
#include "tests/fuzz/memory_file.h"

namespace {

using fuzz::require;
using nlohmann::json;

constexpr std::size_t kFrameHead = 13;  // opcode, subscription, time

/// Checks what the stream sends.
struct Socket final : live::WebSocket {
  void send(std::string message, Format format, Need need) override {
    if (format == Format::kText) {
      const json text = json::parse(message);
      require(text.at("op").is_string());
      return;
    }
    ++frames;
    const std::string_view frame(message);
    require(frame.starts_with('\1') && frame.size() > kFrameHead);
    require(frame.substr(kFrameHead) == (need == Need::kMust ? "latched" : "fast"));
  }
  const std::string& client() const override { return name; }
  std::string name = "127.0.0.1:1";
  std::size_t frames = 0;
};

/// Without the port, in lower case.
std::string name_in(std::string_view host) {
  const bool v6 = host.starts_with('[');
  std::string name(v6 ? host.substr(1, host.find(']') - 1) : host.substr(0, host.find(':')));
  std::ranges::transform(name, name.begin(), [](unsigned char c) { return std::tolower(c); });
  return name;
}

/// No name that another person can register.
bool is_ours(const std::string& name) {
  std::array<char, 256> own{};
  require(gethostname(own.data(), own.size() - 1) == 0);
  std::string machine = name_in(own.data());
  return name == "localhost" || name == machine || name == machine + ".local" ||
         name.find_first_not_of("0123456789abcdef:.") == std::string::npos;
}

}  // namespace

std::vector<fuzz::Bytes> fuzz::seeds() {
  std::vector<Bytes> seeds;
  for (const std::string_view text :
       {R"({"op":"subscribe","subscriptions":[{"id":1,"channelId":1},{"id":2,"channelId":2}]})"
        "\n"
        R"({"op":"unsubscribe","subscriptionIds":[1,2]})",
        R"({"op":"subscribe","subscriptions":[{"id":4294967295,"channelId":2},{"id":0,"channelId":2}]})"
        "\n"
        R"({"op":"advertise","channels":[{"id":1,"topic":"/x","encoding":"json"}]})",
        R"({"op":"subscribe","subscriptions":[[[[{}]]],-1,1.5e3,"\u0000\ud83d\ude00",null,true]})",
        "localhost:8080\n127.0.0.1:8080\n[::1]:8080\nevil.example:80\n127.0.0.1.evil.example"})
    seeds.push_back(bytes_of(text));
  return seeds;
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  live::FoxgloveStream stream("fuzz");
  const std::size_t fast = stream.add({"/fast", "cdr", "std_msgs/msg/String", "string data\n", "ros2msg"});
  const std::size_t latched = stream.add({"/latched", "json", "status", "{}", "jsonschema", true});
  stream.publish(latched, 1, "latched");
  Socket socket;
  const auto client = stream.converse(socket);
  client->begin();
  std::string_view left(reinterpret_cast<const char*>(data), size);
  while (!left.empty()) {
    const std::string line(left.substr(0, left.find('\n')));
    left.remove_prefix(std::min(left.size(), line.size() + 1));
    client->hear(line);
    if (live::names_this_machine(line)) require(is_ours(name_in(line)));
  }
  socket.frames = 0;
  stream.publish(fast, 2, "fast");
  require(stream.wanted(fast) == (socket.frames > 0));
  stream.publish(latched, 2, "latched");
  require(socket.frames <= live::kMaxSubscriptions);
  return 0;
}
