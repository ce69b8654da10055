/// @file
#pragma once
#include <string>

namespace CLI {  // NOLINT(readability-identifier-naming): the library calls itself so
class App;
}

namespace runtime {

/// The manual page of a program (man(7), section 1), from the options and commands that its --help lists.
std::string manual_page(const CLI::App& app);

}  // namespace runtime
