/// @file
/// What youbot-bench is made of.
#pragma once
#include <functional>

namespace CLI {  // NOLINT(readability-identifier-naming): the library calls itself so
class App;
}

namespace youbot_bench {

/// A subcommand: its options, which belong to the application, and what it does with them. Each is added by
/// its own file.
struct Subcommand {
  CLI::App* app;
  std::function<int()> run;  ///< returns the exit code (exit_code.h)
};

}  // namespace youbot_bench
