#include "tests/support/run_command.h"

#include <sys/wait.h>

#include <array>
#include <cstdio>

namespace support {

CommandResult run_command(const std::string& command) {
  CommandResult result;
  // In braces, so that the command's own redirections take effect.
  FILE* const pipe = popen(("{ " + command + "\n} 2>&1 < /dev/null").c_str(), "r");
  if (pipe == nullptr) return result;
  std::array<char, 4096> text{};
  for (std::size_t got = 0; (got = fread(text.data(), 1, text.size(), pipe)) > 0;)
    result.output.append(text.data(), got);
  const int status = pclose(pipe);
  if (WIFEXITED(status)) result.exit_code = WEXITSTATUS(status);
  return result;
}

}  // namespace support
