/// @file
/// Text from outside on a terminal and in a log: a name in a file, a request, a string of a device.
#pragma once
#include <string>
#include <string_view>

namespace runtime {

bool is_utf8(std::string_view text);

/// `text` with `\x1b` and so on for bytes that are not UTF-8, for control characters, except line breaks and
/// tabs, which could move the cursor, change colours or hide text, and for U+FFFE and U+FFFF, which no XML
/// file may contain.
std::string printable(std::string_view text);

/// The same for a log or a table, where a text cannot begin a line: those after its first are indented by two
/// blanks.
std::string printable_entry(std::string_view text);

}  // namespace runtime
