/// @file
/// Common frame of all commands.
#pragma once
#include <functional>

namespace CLI {  // NOLINT(readability-identifier-naming): the library calls itself so
class App;
}

namespace runtime {

/// Parses the command line, then calls `body`. A failure becomes a message on standard error, "NAME: error:
/// …", and an exit code (exit_code.h): 2 for the command line, a configuration file or an invalid value, 3
/// for everything else.
int run_app(CLI::App& app, int argc, char** argv, const std::function<int()>& body);

}  // namespace runtime
