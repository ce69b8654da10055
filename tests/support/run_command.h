/// @file
/// Runs a program like a user and captures its output.
#pragma once
#include <string>
#include <string_view>

namespace support {

struct CommandResult {
  int exit_code = -1;    ///< -1 if it could not be started or was ended by a signal
  std::string output{};  ///< both streams, unless the command sends one elsewhere
  bool said(std::string_view part) const { return output.find(part) != std::string::npos; }
};

/// `command` is for the shell, with an empty input: a program that asks gets no answer. Blocks until it ends.
/// The program runs in the network namespace of the calling thread.
CommandResult run_command(const std::string& command);

}  // namespace support
