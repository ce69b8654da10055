/// @file
/// The answers of the examples in tests/data/README.md against those that others found in the same data with
/// other methods. The README.md of each data set has their numbers.
#pragma once
#include <functional>
#include <map>
#include <string>

#include "tests/documents/commands.h"

namespace documents {

/// By the heading of an example: expects the published numbers in what it wrote.
const std::map<std::string, std::function<void(const Checkout&)>>& published_numbers();

}  // namespace documents
