#include "tests/udev/rules_file.h"

#include <fnmatch.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cstddef>
#include <regex>
#include <set>
#include <sstream>
#include <stdexcept>

namespace udev {
namespace {

/// One of several patterns between bars.
bool matches_pattern(const std::string& patterns, const std::string& text) {
  std::istringstream rest(patterns);
  for (std::string pattern; std::getline(rest, pattern, '|');)
    if (fnmatch(pattern.c_str(), text.c_str(), 0) == 0) return true;
  return false;
}

bool has(const std::map<std::string, std::string>& level, const std::string& key,
         const std::string& patterns) {
  const auto found = level.find(key);
  return found != level.end() && matches_pattern(patterns, found->second);
}

/// KERNELS is KERNEL on any level, ATTRS{x} is ATTR{x}; empty: the key is for the device alone.
std::string key_of_parents(const std::string& key) {
  for (const char* name : {"KERNEL", "SUBSYSTEM"})
    if (key == std::string(name) + "S") return name;
  return key.starts_with("ATTRS{") ? "ATTR" + key.substr(5) : "";
}

/// The ids of a USB device, or those in the name of a HID device, in each of the patterns.
bool names_vendor(const Term& term) {
  if (term.op != "==") return false;
  if (term.key == "ATTR{idVendor}") return std::regex_match(term.value, std::regex("[0-9a-f]{4}"));
  const std::string one = R"(\*:[0-9A-F]{4}:([0-9A-F]{4}\.\*|\*\.\*))";
  return term.key == "KERNELS" && std::regex_match(term.value, std::regex(one + "(\\|" + one + ")*"));
}

}  // namespace

Rule parse_rule(std::string_view line) {
  static const std::regex kTerm(R"re(\s*([A-Z]+(\{[A-Za-z_]+\})?)(==|\+=|=)"([^"]*)"\s*)re");
  Rule rule;
  for (std::string_view rest = line;;) {
    std::match_results<std::string_view::const_iterator> term;
    if (!std::regex_search(rest.begin(), rest.end(), term, kTerm, std::regex_constants::match_continuous))
      throw std::runtime_error("no rule: " + std::string(rest));
    rule.push_back({term[1], term[3], term[4]});
    rest.remove_prefix(static_cast<std::size_t>(term.length()));
    if (rest.empty()) return rule;
    if (rest.front() != ',') throw std::runtime_error("a comma is missing: " + std::string(rest));
    rest.remove_prefix(1);
  }
}

std::vector<Rule> parse_rules(std::string_view text) {
  std::vector<Rule> rules;
  std::istringstream lines{std::string(text)};
  for (std::string line; std::getline(lines, line);)
    if (!line.empty() && line.front() != '#') rules.push_back(parse_rule(line));
  return rules;
}

std::vector<std::string> problems(const Rule& rule) {
  static const std::map<std::string, std::string> kKeys{
      {"SUBSYSTEM", "=="},       {"KERNEL", "=="}, {"KERNELS", "=="}, {"ATTR{idVendor}", "=="},
      {"ATTR{idProduct}", "=="}, {"MODE", "="},    {"GROUP", "="},    {"TAG", "+="}};
  static const std::map<std::string, std::string> kOnce{
      {"MODE", "0660"}, {"GROUP", "plugdev"}, {"TAG", "uaccess"}};
  std::vector<std::string> found;
  std::multiset<std::string> keys;
  for (const Term& term : rule) {
    keys.insert(term.key);
    const auto known = kKeys.find(term.key);
    if (known == kKeys.end())
      found.push_back(term.key + " is not known");
    else if (known->second != term.op)
      found.push_back(term.key + " wants " + known->second);
    const auto only = kOnce.find(term.key);
    if (only != kOnce.end() && only->second != term.value)
      found.push_back(term.key + " is " + term.value + " instead of " + only->second);
  }
  for (const auto& [key, value] : kOnce)
    if (keys.count(key) != 1) found.push_back(key + " has to stand there once");
  if (keys.count("SUBSYSTEM") != 1) found.emplace_back("SUBSYSTEM has to stand there once");
  if (std::ranges::none_of(rule, names_vendor)) found.emplace_back("no vendor is named");
  return found;
}

bool matches(const Rule& rule, const Device& device) {
  std::vector<const Term*> for_parents;
  for (const Term& term : rule) {
    if (term.op != "==") continue;
    if (!key_of_parents(term.key).empty())
      for_parents.push_back(&term);
    else if (device.empty() || !has(device.front(), term.key, term.value))
      return false;
  }
  return for_parents.empty() || std::ranges::any_of(device, [&](const auto& level) {
           return std::ranges::all_of(for_parents, [&](const Term* term) {
             return has(level, key_of_parents(term->key), term->value);
           });
         });
}

}  // namespace udev
