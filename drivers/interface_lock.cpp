#include "drivers/interface_lock.h"

#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <cerrno>
#include <cstddef>
#include <cstring>
#include <fstream>
#include <utility>

namespace drivers {
namespace {

struct Address {
  sockaddr_un name{};
  socklen_t size = 0;
};

const char* name(InterfaceLock::End end) {
  switch (end) {
    case InterfaceLock::End::kEthercatMaster: return "ethercat-master";
    case InterfaceLock::End::kEthercatSlaves: return "ethercat-slaves";
    case InterfaceLock::End::kCanMaster: break;
  }
  return "can-master";
}

/// By index, because an interface may have several names. The leading zero byte makes it abstract.
Address address_of(int index, InterfaceLock::End end) {
  const std::string name = std::string("youbot-hal/") + drivers::name(end) + "/" + std::to_string(index);
  Address address;
  address.name.sun_family = AF_UNIX;
  std::memcpy(address.name.sun_path + 1, name.data(), name.size());
  address.size = static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + 1 + name.size());
  return address;
}

int open_socket() { return socket(AF_UNIX, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0); }

const sockaddr* generic(const Address& address) { return reinterpret_cast<const sockaddr*>(&address.name); }

/// "youbotd (process 4711 of user 1000)", if known: not for a holder in another container, nor for one that
/// does not listen.
std::string holder_of(const Address& address) {
  ucred holder{};
  const int caller = open_socket();
  if (caller >= 0 && connect(caller, generic(address), address.size) == 0) {
    socklen_t size = sizeof holder;
    getsockopt(caller, SOL_SOCKET, SO_PEERCRED, &holder, &size);
  }
  if (caller >= 0) close(caller);
  if (holder.pid == 0) return "another program, which 'ss --unix --all --processes' shows to root";
  std::ifstream comm("/proc/" + std::to_string(holder.pid) + "/comm");
  std::string name;
  std::getline(comm, name);
  return (name.empty() ? "a program" : name) + " (process " + std::to_string(holder.pid) + " of " +
         (holder.uid == 0 ? "root" : "user " + std::to_string(holder.uid)) + ")";
}

}  // namespace

InterfaceLock::InterfaceLock(const std::string& interface, int index, End end) {
  const Address address = address_of(index, end);
  socket_ = open_socket();
  // Listening lets the kernel identify this process to others; connections are never accepted. So each
  // connection attempt waits until the holder ends, and after SOMAXCONN of them (4096) the next one sees
  // "another program".
  if (socket_ >= 0 && bind(socket_, generic(address), address.size) == 0 && listen(socket_, SOMAXCONN) == 0)
    return;
  const int error = errno;
  if (socket_ >= 0) close(socket_);
  if (error != EADDRINUSE)
    throw SetupError({interface, "lock the interface", "success", std::strerror(error),
                      "in a container, allow the address family AF_UNIX"});
  if (end == End::kEthercatSlaves)
    throw InterfaceInUse({interface, "lock the interface", "no other emulator of slaves on it",
                          holder_of(address), "end that one first, or name another interface"});
  throw InterfaceInUse({interface, "lock the interface", "no other master on this bus", holder_of(address),
                        "two would disturb each other: end that one first"});
}

InterfaceLock::InterfaceLock(InterfaceLock&& other) noexcept : socket_(std::exchange(other.socket_, -1)) {}

InterfaceLock& InterfaceLock::operator=(InterfaceLock&& other) noexcept {
  std::swap(socket_, other.socket_);
  return *this;
}

InterfaceLock::~InterfaceLock() {
  if (socket_ >= 0) close(socket_);
}

}  // namespace drivers
