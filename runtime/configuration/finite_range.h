/// @file
/// Range check for every number on a command line.
#pragma once
#include <CLI/CLI.hpp>

namespace runtime {

/// Check for numeric options: from `least` to `most`. The library's own ranges accept "nan", which is neither
/// below nor above anything, and a negative number for an unsigned option.
CLI::Validator finite_range(double least, double most);

}  // namespace runtime
