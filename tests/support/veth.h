/// @file
/// Two network namespaces joined by a veth pair, with a bus emulator in one of them: the basis of tests with
/// real raw sockets. Needs root.
#pragma once
#include <sys/types.h>

#include <cstdio>
#include <string>

namespace support {

/// A pair of namespaces joined by a veth pair: interface veth-s in the simulator's, veth-c in the other, in
/// which the calling thread runs while this exists. Threads started meanwhile run there too.
class Namespaces {
 public:
  Namespaces();
  Namespaces(const Namespaces&) = delete;
  Namespaces& operator=(const Namespaces&) = delete;
  ~Namespaces();

  /// False without root or if namespaces are forbidden: skip the test.
  bool usable() const { return usable_; }
  std::string sim_namespace() const { return "ybs" + id_; }
  std::string control_namespace() const { return "ybc" + id_; }

 private:
  std::string id_;
  int home_;
  bool usable_ = false;
};

/// A program in the simulator's namespace, from its ready message to the end of this object. Its later output
/// is not read, so it must fit into a pipe.
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
