/// @file
/// A program that runs in parallel to the test, with its output on a pipe.
#pragma once
#include <fcntl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <csignal>
#include <cstdio>
#include <string>
#include <utility>
#include <vector>

#include "tests/support/run_command.h"

namespace support {

/// The program and its arguments, without a shell. Killed with this object if it still runs.
class Process {
 public:
  explicit Process(std::vector<std::string> words) {
    std::array<int, 2> out{};
    std::array<int, 2> in{};
    std::signal(SIGPIPE, SIG_IGN);  // say() returns false when the process has ended
    // Another child process that inherits an end would keep the pipe open after this one has closed it.
    if (pipe2(out.data(), O_CLOEXEC) != 0 || pipe2(in.data(), O_CLOEXEC) != 0) return;
    std::vector<char*> argv;
    for (std::string& word : words) argv.push_back(word.data());
    argv.push_back(nullptr);
    pid_ = fork();
    if (pid_ == 0) {
      dup2(in[0], STDIN_FILENO);
      dup2(out[1], STDOUT_FILENO);
      dup2(out[1], STDERR_FILENO);
      execv(argv[0], argv.data());
      _exit(127);
    }
    close(out[1]);
    close(in[0]);
    input_ = in[1];
    output_ = fdopen(out[0], "r");
  }
  Process(const Process&) = delete;
  Process& operator=(const Process&) = delete;
  ~Process() {
    if (pid_ > 0) {
      kill(pid_, SIGKILL);
      waitpid(pid_, nullptr, 0);
    }
    if (input_ >= 0) close(input_);
    if (output_ != nullptr) fclose(output_);
  }

  /// Reads until a line contains `text`; false if the output ends before.
  bool wait_for(const std::string& text) {
    std::array<char, 4096> line{};
    while (fgets(line.data(), line.size(), output_) != nullptr) {
      result_.output += line.data();
      if (std::string(line.data()).find(text) != std::string::npos) return true;
    }
    return false;
  }
  /// What wait_for() has read.
  const std::string& output() const { return result_.output; }
  bool say(const std::string& line) const {
    const std::string text = line + "\n";
    return write(input_, text.data(), text.size()) == static_cast<ssize_t>(text.size());
  }
  /// The end of its input.
  void hang_up() {
    close(input_);
    input_ = -1;
  }
  /// From now on a few unread lines fill its output pipe.
  bool shrink_output() const { return fcntl(fileno(output_), F_SETPIPE_SZ, 4096) == 4096; }
  void signal(int number) const { kill(pid_, number); }
  /// Whether it has ended by itself; finish() still returns how.
  bool ended() const {
    siginfo_t info{};
    return waitid(P_PID, static_cast<id_t>(pid_), &info, WEXITED | WNOHANG | WNOWAIT) == 0 &&
           info.si_pid == pid_;
  }
  pid_t pid() const { return pid_; }
  /// Waits for its end.
  CommandResult finish() {
    std::array<char, 4096> line{};
    while (fgets(line.data(), line.size(), output_) != nullptr) result_.output += line.data();
    int status = 0;
    waitpid(pid_, &status, 0);
    pid_ = -1;
    if (WIFEXITED(status)) result_.exit_code = WEXITSTATUS(status);
    return result_;
  }

 private:
  pid_t pid_ = -1;
  int input_ = -1;
  FILE* output_ = nullptr;
  CommandResult result_;
};

}  // namespace support
