#include "tests/support/veth.h"

#include <fcntl.h>
#include <sched.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <csignal>
#include <cstdlib>
#include <random>

#include "tests/support/built_paths.h"

namespace support {
namespace {

bool shell(const std::string& command) { return std::system(command.c_str()) == 0; }

/// The random part distinguishes the namespaces from those that a killed test with the same process id left.
std::string unique_id() { return std::to_string(getpid()) + "-" + std::to_string(std::random_device()()); }

}  // namespace

Namespaces::Namespaces() : id_(unique_id()), home_(open("/proc/thread-self/ns/net", O_RDONLY | O_CLOEXEC)) {
  usable_ = geteuid() == 0 && shell("ip netns add " + sim_namespace()) &&
            shell("ip netns add " + control_namespace()) &&
            shell("ip -n " + sim_namespace() + " link add veth-s type veth peer name veth-c netns " +
                  control_namespace()) &&
            shell("ip -n " + sim_namespace() + " link set veth-s up") &&
            shell("ip -n " + control_namespace() + " link set veth-c up");
  if (!usable_) return;
  const int there = open(("/run/netns/" + control_namespace()).c_str(), O_RDONLY | O_CLOEXEC);
  usable_ = there >= 0 && setns(there, CLONE_NEWNET) == 0;
  if (there >= 0) close(there);
}

Namespaces::~Namespaces() {
  if (usable_) (void)setns(home_, CLONE_NEWNET);
  close(home_);
  if (!usable_) return;
  shell("ip netns del " + sim_namespace());
  shell("ip netns del " + control_namespace());
}

Server::Server(const Namespaces& namespaces, const std::string& command, const std::string& ready_word) {
  std::array<int, 2> ends{};
  if (pipe2(ends.data(), O_CLOEXEC) != 0) return;
  pid_ = fork();
  if (pid_ == 0) {
    prctl(PR_SET_PDEATHSIG, SIGTERM);  // so that none is left behind by a test that crashed
    dup2(ends[1], STDOUT_FILENO);
    const std::string there = "exec ip netns exec " + namespaces.sim_namespace() + " " + command;
    execl("/bin/sh", "sh", "-c", there.c_str(), nullptr);
    _exit(127);
  }
  close(ends[1]);
  output_ = fdopen(ends[0], "r");
  std::array<char, 256> line{};
  while (!ready_ && fgets(line.data(), line.size(), output_) != nullptr)
    ready_ = std::string(line.data()).find(ready_word) != std::string::npos;
}

Server::~Server() {
  if (pid_ > 0) {
    kill(pid_, SIGTERM);
    waitpid(pid_, nullptr, 0);
  }
  if (output_ != nullptr) fclose(output_);
}

Simulator::Simulator(const Namespaces& namespaces, const std::string& arguments)
    : Server(namespaces, support::program("youbot-sim") + " --interface veth-s " + arguments, "serving") {}

}  // namespace support
