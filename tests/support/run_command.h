/// @file
/// Runs a program as a user does and listens to it.
#pragma once
#include <string>
#include <string_view>

namespace support {

struct CommandResult {
  int exit_code = -1;    ///< -1 when it could not be started or was ended by a signal
  std::string output{};  ///< both streams, unless the command sends one elsewhere
  bool said(std::string_view part) const { return output.find(part) != std::string::npos; }
};

/// `command` is the shell's, with an empty input: a program that asks gets no answer. Blocks until it ends.
/// The program lives in the network namespace of the calling thread.
CommandResult run_command(const std::string& command);

}  // namespace support
