/// @file
/// What every number on a command line must be.
#pragma once
#include <CLI/CLI.hpp>

namespace runtime {

/// A check for options whose value is a number: from `least` to `most`. The library's own ranges let "nan"
/// pass, which is neither below nor above anything, and a negative number for an unsigned option.
CLI::Validator finite_range(double least, double most);

}  // namespace runtime
