/// @file
/// The daemon's end of the control socket: connected clients and their requests.
#pragma once
#include <sys/types.h>

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace youbotd {

/// The client at the other end, identified by the kernel.
struct Peer {
  std::uint64_t connection = 0;  ///< unique
  pid_t pid = 0;
  uid_t uid = 0;
  std::string name;                               ///< "user 1000 (process 4711)"
  bool may_command = false;                       ///< root, the daemon's own user, or a member of its group
  bool may_steer = false;                         ///< the network's velocities: `steer`, and nothing else
  std::chrono::steady_clock::time_point heard{};  ///< time of its last request
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

  /// Creates the socket, for its owner and group. Replaces one left by a dead daemon.
  /// @throws hal::SetupError if another daemon serves it, or naming what is in the way; std::invalid_argument
  /// for a path that is too long.
  ControlServer(const std::filesystem::path& path, Listener& listener);
  ControlServer(const ControlServer&) = delete;
  ControlServer& operator=(const ControlServer&) = delete;
  /// Removes the socket; clients no longer get answers.
  ~ControlServer();

  /// Answers pending requests, waiting for them at most this long. Recreates a socket that was removed from
  /// its directory.
  /// `wake`: a descriptor that ends the wait when it is readable; -1: none.
  void serve(std::chrono::milliseconds patience, int wake = -1);

 private:
  struct Connection {
    int socket;
    Peer peer;
  };
  bool is_ours() const;
  void restore();
  /// False if no client was waiting, or it could not be accepted.
  bool accept();
  void drop_one();
  void complain(const char* step, int error);
  /// False if the other end is closed.
  bool hear(Connection& connection);

  std::filesystem::path path_;
  Listener& listener_;
  int listening_ = -1;
  std::uint64_t made_ = 0;  // inode of our socket
  std::chrono::steady_clock::time_point tried_{};
  std::chrono::steady_clock::time_point accept_again_{};  // time of the next attempt after a failure
  bool lost_ = false;                                     // removed, and could not be recreated yet
  std::string complaint_;                                 // the last one
  std::uint64_t accepted_ = 0;
  std::vector<Connection> connections_;
};

}  // namespace youbotd
