/// @file
/// udev rules as far as ours need them (udev(7)): which are written wrongly, and which devices they are for.
#pragma once
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace udev {

/// KEY OPERATOR "VALUE"
struct Term {
  std::string key;  ///< with what stands in braces: ATTR{idVendor}
  std::string op;   ///< ==, = or +=
  std::string value;
};
using Rule = std::vector<Term>;

/// A line that is no comment. Throws std::runtime_error, with the place, when it is not written as rules are.
Rule parse_rule(std::string_view line);
/// Throws as parse_rule().
std::vector<Rule> parse_rules(std::string_view text);

/// What a rule of this project may not be without, or may not have; empty: nothing.
std::vector<std::string> problems(const Rule& rule);

/// Keys as in a rule (SUBSYSTEM, KERNEL, ATTR{...}), the device first, then what it hangs from.
using Device = std::vector<std::map<std::string, std::string>>;
/// By the rule's == terms: KEY on the device, KEYS on it or one of its parents, the same one for all of them.
bool matches(const Rule& rule, const Device& device);

}  // namespace udev
