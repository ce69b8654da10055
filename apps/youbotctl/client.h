/// @file
/// A caller's end of the control socket.
#pragma once
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>

namespace youbotctl {

class Client {
 public:
  /// @throws hal::SetupError when nobody serves there or one may not connect, with what to do about it.
  explicit Client(const std::filesystem::path& socket);
  Client(const Client&) = delete;
  Client& operator=(const Client&) = delete;
  ~Client();

  /// The answer, whatever it says. @throws hal::SetupError when youbotd has gone or does not answer;
  /// std::invalid_argument for a request longer than runtime::kLongestRequest.
  nlohmann::json ask(const std::string& request);

 private:
  std::filesystem::path path_;
  int socket_ = -1;
};

}  // namespace youbotctl
