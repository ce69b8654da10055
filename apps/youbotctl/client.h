/// @file
/// The client's end of the control socket.
#pragma once
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>

namespace youbotctl {

class Client {
 public:
  /// @throws hal::SetupError with advice if there is no server or no permission to connect.
  explicit Client(const std::filesystem::path& socket);
  Client(const Client&) = delete;
  Client& operator=(const Client&) = delete;
  ~Client();

  /// The answer, whatever it contains. @throws hal::SetupError if youbotd has ended or does not answer;
  /// std::invalid_argument for a request longer than runtime::kLongestRequest.
  nlohmann::json ask(const std::string& request);

 private:
  std::filesystem::path path_;
  int socket_ = -1;
};

}  // namespace youbotctl
