/// @file
/// Common type of youbot-bench's subcommands.
#pragma once
#include <functional>

namespace CLI {  // NOLINT(readability-identifier-naming): the library calls itself so
class App;
}

namespace youbot_bench {

/// A subcommand: its options, owned by the application, and its function. Each is added by its own file.
struct Subcommand {
  CLI::App* app;
  std::function<int()> run;  ///< returns the exit code (exit_code.h)
};

}  // namespace youbot_bench
