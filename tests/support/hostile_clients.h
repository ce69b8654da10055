/// @file
/// Clients of a control socket that behave like broken or hostile programs for as long as they exist.
#pragma once
#include <fcntl.h>
#include <sys/socket.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <chrono>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include "runtime/program/control_socket.h"

namespace support {

/// A connection without protocol rules.
class RawClient {
 public:
  explicit RawClient(const std::filesystem::path& path)
      : socket_(::socket(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC | SOCK_NONBLOCK, 0)) {
    const sockaddr_un address = runtime::control_address(path);
    connected_ = connect(socket_, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0;
  }
  RawClient(const RawClient&) = delete;
  RawClient& operator=(const RawClient&) = delete;
  ~RawClient() { close(socket_); }

  bool connected() const { return connected_; }
  bool say(const std::string& text) const {
    return send(socket_, text.data(), text.size(), MSG_NOSIGNAL | MSG_DONTWAIT) >= 0;
  }
  /// False if the other end is closed; an answer is not required.
  bool hear() {
    const ssize_t size = recv(socket_, answer_.data(), answer_.size(), MSG_DONTWAIT);
    return size > 0 || (size < 0 && errno == EAGAIN);
  }

 private:
  int socket_;
  bool connected_ = false;
  std::string answer_ = std::string(runtime::kLongestAnswer, '\0');
};

/// One thread for each kind of attack, none of which waits.
class HostileClients {
 public:
  explicit HostileClients(std::filesystem::path socket) : socket_(std::move(socket)) {
    for (int i = 0; i < 3; ++i) begin([this] { flood([] { return "status"; }, /*reads=*/true); });
    begin([this] { flood([] { return "status"; }, /*reads=*/false); });
    begin([this] { flood([] { return "set path.rest_s 1"; }, /*reads=*/true); });
    begin([this] { flood([] { return "set path.re"; }, /*reads=*/true); });  // the half of a request
    begin([this] {
      std::minstd_rand random;
      flood(
          [&random] {
            std::string text(1 + random() % (runtime::kLongestRequest + 10), '\0');
            for (char& c : text) c = static_cast<char>(random());
            return text;
          },
          /*reads=*/false);
    });
    begin([this] { come_and_go(); });
    begin([this] { crowd(); });
  }
  HostileClients(const HostileClients&) = delete;
  HostileClients& operator=(const HostileClients&) = delete;
  ~HostileClients() {
    stop_ = true;
    for (std::thread& thread : threads_) thread.join();
  }

  std::size_t threads() const { return threads_.size(); }
  std::uint64_t requests() const { return requests_; }
  std::uint64_t connections() const { return connections_; }

 private:
  void begin(const std::function<void()>& nuisance) {
    threads_.emplace_back([this, nuisance] {
      while (!stop_) nuisance();
    });
  }
  /// Until youbotd disconnects.
  void flood(const std::function<std::string()>& text, bool reads) {
    RawClient client(socket_);
    if (!client.connected()) return std::this_thread::yield();
    ++connections_;
    while (!stop_) {
      if (client.say(text()))
        ++requests_;
      else if (errno != EAGAIN)
        return;
      if (reads && !client.hear()) return;
    }
  }
  void come_and_go() { connections_ += RawClient(socket_).connected() ? 1 : 0; }
  /// Three times as many silent connections as youbotd keeps.
  void crowd() {
    std::vector<std::unique_ptr<RawClient>> silent;
    for (int i = 0; i < 50 && !stop_; ++i) {
      silent.push_back(std::make_unique<RawClient>(socket_));
      connections_ += silent.back()->connected() ? 1 : 0;
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
  }

  std::filesystem::path socket_;
  std::atomic<bool> stop_{false};
  std::atomic<std::uint64_t> requests_{0};
  std::atomic<std::uint64_t> connections_{0};
  std::vector<std::thread> threads_;
};

}  // namespace support
