/// @file
/// The daemon's end of the control socket: who is connected, and what each of them asks.
#pragma once
#include <sys/types.h>

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace youbotd {

/// Who is at the other end, as the kernel knows it.
struct Peer {
  std::uint64_t connection = 0;  ///< never the same twice
  pid_t pid = 0;
  uid_t uid = 0;
  std::string name;                               ///< "user 1000 (process 4711)"
  bool may_command = false;                       ///< root, the daemon's own user, or a member of its group
  std::chrono::steady_clock::time_point heard{};  ///< last word of it
};

/// One thread.
class ControlServer {
 public:
  class Listener {
   public:
    Listener() = default;
    Listener(const Listener&) = delete;
    Listener& operator=(const Listener&) = delete;
    virtual ~Listener() = default;
    virtual std::string answer(const Peer& peer, const std::string& request) = 0;
    virtual void gone(const Peer& peer) = 0;
    /// Whether this peer commands the robot; its connection is then never dropped for another.
    virtual bool commands(const Peer& peer) const = 0;
  };

  /// Makes the socket, for its owner and group. One that a dead daemon left is replaced.
  /// @throws hal::SetupError when another daemon serves it, or naming what is in the way;
  ///         std::invalid_argument for a path that is too long.
  ControlServer(const std::filesystem::path& path, Listener& listener);
  ControlServer(const ControlServer&) = delete;
  ControlServer& operator=(const ControlServer&) = delete;
  /// Removes the socket; no client gets an answer any more.
  ~ControlServer();

  /// Answers what has been asked, waiting for it no longer than this. A socket that was removed from
  /// its directory is made again.
  void serve(std::chrono::milliseconds patience);

 private:
  struct Connection {
    int socket;
    Peer peer;
  };
  bool is_ours() const;
  void restore();
  /// False when no client waited, or it could not be accepted.
  bool accept();
  void drop_one();
  void complain(const char* step, int error);
  /// False when the other end is gone.
  bool hear(Connection& connection);

  std::filesystem::path path_;
  Listener& listener_;
  int listening_ = -1;
  std::uint64_t made_ = 0;  // inode of the socket that is ours
  std::chrono::steady_clock::time_point tried_{};
  std::chrono::steady_clock::time_point accept_again_{};  // after one that failed
  bool lost_ = false;                                     // removed, and could not be made again yet
  std::string complaint_;                                 // the last one
  std::uint64_t accepted_ = 0;
  std::vector<Connection> connections_;
};

}  // namespace youbotd
