#include "apps/youbotd/control_server.h"

#include <poll.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <thread>
#include <utility>

#include "drivers/uninterrupted.h"
#include "hal/setup_error.h"
#include "runtime/log.h"
#include "runtime/program/control_socket.h"

namespace youbotd {
namespace {

constexpr std::size_t kMaxConnections = 16;
constexpr std::chrono::milliseconds kRetry{200};
/// A waiting client may want to stop the robot.
constexpr std::chrono::milliseconds kAcceptRetry{20};

hal::SetupError refused(const std::filesystem::path& path, const std::string& hint) {
  return {"control socket " + path.string(), "open", hint};
}

/// errno of a connection attempt; 0 if a program answers.
int error_of_calling(const sockaddr_un& address) {
  const int probe = socket(AF_UNIX, SOCK_SEQPACKET | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
  if (probe < 0) return errno;
  const bool reached = drivers::uninterrupted([&] {
                         return connect(probe, reinterpret_cast<const sockaddr*>(&address), sizeof address);
                       }) == 0;
  const int error = reached ? 0 : errno;
  close(probe);
  return error;
}

/// A socket without a server was left by a killed daemon. Anything else is not ours to remove.
void remove_leftover(const std::filesystem::path& path, const sockaddr_un& address) {
  struct stat found {};
  if (lstat(path.c_str(), &found) != 0) return;
  if (!S_ISSOCK(found.st_mode)) throw refused(path, "there is something else of that name");
  const int error = error_of_calling(address);
  if (error == 0 || error == EAGAIN)
    throw refused(path, "another youbotd serves it; stop that one, or name another path");
  if (error != ECONNREFUSED)
    throw refused(path, std::string("there is another program's socket: ") + std::strerror(error));
  unlink(path.c_str());
}

/// Members of the daemon's group, by primary or supplementary group.
bool in_our_group(int socket, const ucred& peer) {
  if (peer.gid == getegid()) return true;
  // The kernel returns their number if they do not fit: up to NGROUPS_MAX, 65536.
  std::vector<gid_t> groups;
  socklen_t size = 0;
  int result = getsockopt(socket, SOL_SOCKET, SO_PEERGROUPS, groups.data(), &size);
  if (result != 0 && errno == ERANGE) {
    groups.resize(size / sizeof(gid_t));
    result = getsockopt(socket, SOL_SOCKET, SO_PEERGROUPS, groups.data(), &size);
  }
  return result == 0 && std::find(groups.cbegin(), groups.cend(), getegid()) != groups.cend();
}

/// Without a query of the user database, which may be remote and slow.
std::string name_of(const ucred& peer) {
  return (peer.uid == 0 ? "root" : "user " + std::to_string(peer.uid)) + " (process " +
         std::to_string(peer.pid) + ")";
}

int listen_at(const std::filesystem::path& path) {
  const sockaddr_un address = runtime::control_address(path);
  remove_leftover(path, address);
  const int listening = socket(AF_UNIX, SOCK_SEQPACKET | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
  if (listening < 0 || bind(listening, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0) {
    const int why = errno;
    if (listening >= 0) close(listening);
    throw refused(path, why == ENOENT ? "there is no directory " + path.parent_path().string()
                                      : std::string(std::strerror(why)));
  }
  // Before any client can connect.
  if (chmod(path.c_str(), 0660) != 0 || listen(listening, kMaxConnections) != 0) {
    const std::string why = std::strerror(errno);
    close(listening);
    unlink(path.c_str());
    throw refused(path, why);
  }
  return listening;
}

/// 0: there is no such file.
std::uint64_t inode_of(const std::filesystem::path& path) {
  struct stat found {};
  return lstat(path.c_str(), &found) == 0 ? found.st_ino : 0;
}

}  // namespace

ControlServer::ControlServer(const std::filesystem::path& path, Listener& listener)
    : path_(path), listener_(listener), listening_(listen_at(path)), made_(inode_of(path)) {}

ControlServer::~ControlServer() {
  for (const Connection& connection : connections_) close(connection.socket);
  // While it listens, no other file has our inode number.
  if (is_ours()) unlink(path_.c_str());
  close(listening_);
}

bool ControlServer::is_ours() const { return made_ != 0 && inode_of(path_) == made_; }

/// A clean-up of directories must not remove the way to stop the robot.
void ControlServer::restore() {
  const auto now = std::chrono::steady_clock::now();
  if (is_ours()) lost_ = false;
  if (is_ours() || (lost_ && now - tried_ < kRetry)) return;
  tried_ = now;
  try {
    const int again = listen_at(path_);
    while (accept()) {
    }  // clients connected before its removal
    close(listening_);
    listening_ = again;
    made_ = inode_of(path_);
    lost_ = false;
    spdlog::warn("control socket {} was removed, and is there again", path_.string());
  } catch (const hal::SetupError& error) {
    if (!lost_)
      spdlog::error("the control socket was removed and cannot be made again yet: {}", error.what());
    lost_ = true;
  }
}

void ControlServer::serve(std::chrono::milliseconds patience, int wake) {
  restore();
  // A client that could not be accepted still waits: it would end each poll() at once. poll() ignores
  // negative descriptors.
  const auto pause =
      std::chrono::ceil<std::chrono::milliseconds>(accept_again_ - std::chrono::steady_clock::now());
  const bool accepts = pause.count() <= 0;
  std::vector<pollfd> watched{{accepts ? listening_ : -1, POLLIN, 0}};
  for (const Connection& connection : connections_) watched.push_back({connection.socket, POLLIN, 0});
  watched.push_back({wake, POLLIN, 0});
  const auto wait = accepts ? patience : std::min(patience, pause);
  const int ready = poll(watched.data(), watched.size(), static_cast<int>(wait.count()));
  if (ready < 0 && errno != EINTR) {
    complain("look for requests", errno);
    std::this_thread::sleep_for(patience);
  }
  if (ready <= 0) return;
  std::vector<Connection> alive;
  std::vector<Connection> dead;
  for (std::size_t i = 0; i < connections_.size(); ++i) {
    Connection& connection = connections_[i];
    const bool asked = watched[i + 1].revents != 0;
    (asked && !hear(connection) ? dead : alive).push_back(connection);
  }
  connections_ = std::move(alive);
  for (const Connection& connection : dead) {
    close(connection.socket);
    listener_.gone(connection.peer);
  }
  if (watched[0].revents != 0) (void)accept();
}

/// No client may be able to reach the service then: the log reports each problem once.
void ControlServer::complain(const char* step, int error) {
  const std::string problem =
      std::string(step) + ": " + std::strerror(error) + "; what is connected is still served";
  if (std::exchange(complaint_, problem) != problem)
    spdlog::error("control socket {}: cannot {}", path_.string(), problem);
}

bool ControlServer::accept() {
  const int socket = drivers::uninterrupted(
      [this] { return accept4(listening_, nullptr, nullptr, SOCK_NONBLOCK | SOCK_CLOEXEC); });
  if (socket < 0) {
    if (errno == EAGAIN || errno == ECONNABORTED) return false;
    complain("accept a connection", errno);
    accept_again_ = std::chrono::steady_clock::now() + kAcceptRetry;
    return false;
  }
  ucred peer{};
  socklen_t size = sizeof peer;
  if (getsockopt(socket, SOL_SOCKET, SO_PEERCRED, &peer, &size) != 0) {
    complain("learn who connects", errno);
    close(socket);
    return true;
  }
  if (connections_.size() >= kMaxConnections) drop_one();
  const bool may_command = peer.uid == 0 || peer.uid == geteuid() || in_our_group(socket, peer);
  connections_.push_back({socket,
                          {.connection = ++accepted_,
                           .pid = peer.pid,
                           .uid = peer.uid,
                           .name = name_of(peer),
                           .may_command = may_command,
                           .heard = std::chrono::steady_clock::now()}});
  return true;
}

/// A full list must not keep out a client that wants to stop the robot. The commanding client stays
/// connected, and so does every other process as long as another one has more connections: the most silent
/// one of that process is dropped.
void ControlServer::drop_one() {
  const auto of_its_process = [this](const Connection& connection) {
    return std::count_if(connections_.begin(), connections_.end(),
                         [&](const Connection& other) { return other.peer.pid == connection.peer.pid; });
  };
  const auto goes_before = [&](const Connection& a, const Connection& b) {
    const bool a_commands = listener_.commands(a.peer);
    const bool b_commands = listener_.commands(b.peer);
    if (a_commands != b_commands) return b_commands;
    const auto a_has = of_its_process(a);
    const auto b_has = of_its_process(b);
    return a_has != b_has ? a_has > b_has : a.peer.heard < b.peer.heard;
  };
  const auto dropped = std::min_element(connections_.begin(), connections_.end(), goes_before);
  const Peer peer = dropped->peer;
  close(dropped->socket);
  connections_.erase(dropped);
  listener_.gone(peer);
}

bool ControlServer::hear(Connection& connection) {
  std::array<char, runtime::kLongestRequest> request{};
  const ssize_t size = recv(connection.socket, request.data(), request.size(), MSG_TRUNC);
  if (size < 0) return errno == EAGAIN || errno == EINTR;
  // No request is that long.
  if (size == 0 || static_cast<std::size_t>(size) > request.size()) return false;
  connection.peer.heard = std::chrono::steady_clock::now();
  const std::string answer =
      listener_.answer(connection.peer, std::string(request.data(), static_cast<std::size_t>(size)));
  if (drivers::uninterrupted(
          [&] { return send(connection.socket, answer.data(), answer.size(), MSG_NOSIGNAL); }) >= 0)
    return true;
  // A client that does not read its answers is not waited for; a disconnected one needs none.
  if (errno != EAGAIN && errno != EPIPE && errno != ECONNRESET) complain("answer", errno);
  return false;
}

}  // namespace youbotd
