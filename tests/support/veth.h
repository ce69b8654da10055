/// @file
/// Two network namespaces joined by a veth pair, and a bus emulator in one of them: what tests with real raw
/// sockets stand on. Needs root.
#pragma once
#include <sys/types.h>

#include <cstdio>
#include <string>

namespace support {

/// A pair of namespaces joined by a veth pair: interface veth-s in the one of the simulator, veth-c in the
/// other, in which the calling thread lives while this exists. Threads started meanwhile live there too.
class Namespaces {
 public:
  Namespaces();
  Namespaces(const Namespaces&) = delete;
  Namespaces& operator=(const Namespaces&) = delete;
  ~Namespaces();

  /// False without root or where namespaces are forbidden: skip the test.
  bool usable() const { return usable_; }
  std::string sim_namespace() const { return "ybs" + id_; }
  std::string control_namespace() const { return "ybc" + id_; }

 private:
  std::string id_;
  int home_;
  bool usable_ = false;
};

/// A program in the simulator's namespace, from the line on its output that says it is ready to the end of
/// this object. It is not listened to afterwards, so it must not say more than a pipe holds.
class Server {
 public:
  Server(const Namespaces& namespaces, const std::string& command, const std::string& ready_word);
  Server(const Server&) = delete;
  Server& operator=(const Server&) = delete;
  ~Server();
  bool ready() const { return ready_; }

 private:
  pid_t pid_ = -1;
  FILE* output_ = nullptr;
  bool ready_ = false;
};

/// youbot-sim on veth-s, ready to answer.
class Simulator : public Server {
 public:
  Simulator(const Namespaces& namespaces, const std::string& arguments);
};

}  // namespace support
