/// @file
#pragma once
#include <string>

namespace CLI {  // NOLINT(readability-identifier-naming): the library calls itself so
class App;
}

namespace runtime {

/// A script that bash completes a program's command line by: commands, options and the values that an option
/// has a list of; files everywhere else.
std::string bash_completion(const CLI::App& app);

}  // namespace runtime
