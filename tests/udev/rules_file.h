/// @file
/// A subset of udev rules (udev(7)): checks their syntax, and which devices they match.
#pragma once
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace udev {

/// KEY OPERATOR "VALUE"
struct Term {
  std::string key;  ///< including the part in braces: ATTR{idVendor}
  std::string op;   ///< ==, = or +=
  std::string value;
};
using Rule = std::vector<Term>;

/// A line that is not a comment. Throws std::runtime_error, with the position, if it is not a valid rule.
Rule parse_rule(std::string_view line);
/// Throws as parse_rule().
std::vector<Rule> parse_rules(std::string_view text);

/// Violations of the requirements for a rule of this project; empty: none.
std::vector<std::string> problems(const Rule& rule);

/// Keys as in a rule (SUBSYSTEM, KERNEL, ATTR{...}), the device first, then its parents.
using Device = std::vector<std::map<std::string, std::string>>;
/// By the rule's == terms: KEY on the device, KEYS on it or one of its parents, all on the same one.
bool matches(const Rule& rule, const Device& device);

}  // namespace udev
