#include "apps/common/toml_reader.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <cstdint>
#include <deque>
#include <fstream>
#include <functional>
#include <iterator>
#include <map>
#include <numeric>
#include <set>
#include <system_error>

// toml++ 3.3 (Debian 12) takes what it has not checked in its input for granted where NDEBUG is defined,
// which is undefined behaviour on a broken file; here such a file is refused. Nobody else includes it.
#include <stdexcept>
namespace {
struct ParserLost : std::runtime_error {
  ParserLost() : std::runtime_error("the parser lost its way") {}
};
constexpr void take_for_granted(bool condition) {
  if (!condition) throw ParserLost();
}
}  // namespace
#undef NDEBUG
#define TOML_ASSERT(expression) take_for_granted(static_cast<bool>(expression))
#include <toml++/toml.h>

namespace apps {
namespace {

using Names = std::set<std::string, std::less<>>;

/// The words that units are made of in key names. Not `min` and `W`: mostly minimum and the world frame.
constexpr auto kUnitWords = std::to_array<std::string_view>(
    {"per", "s",  "ms", "us", "ns", "s2", "Hz", "kHz", "rpm", "rad", "mrad",  "deg",     "rev",
     "m",   "mm", "cm", "um", "km", "m2", "N",  "mN",  "kN",  "Nm",  "mNm",   "kg",      "g",
     "A",   "mA", "V",  "mV", "J",  "K",  "C",  "Ohm", "mH",  "uH",  "ticks", "percent", "permille"});

std::string_view without_unit(std::string_view name) {
  const auto cut = name.rfind('_');
  if (cut == name.npos || cut == 0) return name;
  const bool is_unit = std::ranges::find(kUnitWords, name.substr(cut + 1)) != kUnitWords.end();
  return is_unit ? without_unit(name.substr(0, cut)) : name;
}

/// Levenshtein: how many letters to insert, delete or replace.
std::size_t edit_distance(std::string_view from, std::string_view to) {
  std::vector<std::size_t> row(to.size() + 1);
  std::iota(row.begin(), row.end(), std::size_t{0});
  for (std::size_t i = 0; i < from.size(); ++i) {
    std::size_t diagonal = std::exchange(row[0], i + 1);
    for (std::size_t j = 0; j < to.size(); ++j) {
      const std::size_t replaced = diagonal + (from[i] == to[j] ? 0 : 1);
      diagonal = row[j + 1];
      row[j + 1] = std::min({replaced, row[j] + 1, row[j + 1] + 1});
    }
  }
  return row.back();
}

/// What the writer of an unknown key may have meant.
std::string hint(std::string_view key, const Names& known) {
  if (known.empty()) return "no keys are expected here";
  const auto closest = [key](const Names& names) {
    return *std::ranges::min_element(names, {},
                                     [key](const std::string& name) { return edit_distance(key, name); });
  };
  Names same_quantity;
  for (const std::string& name : known) {
    const std::string_view quantity = without_unit(name);
    if (quantity != name && quantity == without_unit(key)) same_quantity.insert(name);
  }
  if (!same_quantity.empty()) return fmt::format("wrong unit: expected '{}'", closest(same_quantity));
  const std::string name = closest(known);
  if (3 * edit_distance(key, name) <= key.size()) return fmt::format("did you mean '{}'?", name);
  return fmt::format("known keys are '{}'", fmt::join(known, "', '"));
}

std::string_view describe(toml::node_type type) {
  switch (type) {
    case toml::node_type::string: return "a string";
    case toml::node_type::integer: return "an integer";
    case toml::node_type::floating_point: return "a number";
    case toml::node_type::boolean: return "a boolean";
    case toml::node_type::table: return "a table";
    case toml::node_type::array: return "an array";
    case toml::node_type::date:
    case toml::node_type::time:
    case toml::node_type::date_time: return "a date or time";
    case toml::node_type::none: break;
  }
  return "nothing";
}

std::string describe(const NumberRules& rules) {
  if (std::isinf(rules.max)) return fmt::format("at least {}", rules.min);
  if (std::isinf(rules.min)) return fmt::format("at most {}", rules.max);
  return fmt::format("{} to {}", rules.min, rules.max);
}

std::string read(const std::filesystem::path& path) {
  std::error_code ignored;
  if (std::filesystem::is_directory(path, ignored)) {
    throw ConfigError({fmt::format("{}: is a directory, expected a file", path.string())});
  }
  std::ifstream stream(path, std::ios::binary);
  if (!stream) {
    const std::string reason = std::generic_category().message(errno);
    throw ConfigError({fmt::format("{}: cannot be opened: {}", path.string(), reason)});
  }
  return {std::istreambuf_iterator<char>(stream), {}};
}

/// Where a byte beyond ASCII stands outside strings and comments: TOML has no use for one there, and toml++
/// 3.3 (Debian 12) runs into undefined behaviour on most of them.
std::optional<std::size_t> stray_character(std::string_view text) {
  std::size_t line = 1;
  std::string_view closing;  // of the string or comment we are in
  bool escapes = false;      // in a string that knows them
  constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";
  for (std::size_t i = text.starts_with(kByteOrderMark) ? kByteOrderMark.size() : 0; i < text.size(); ++i) {
    const std::string_view rest = text.substr(i);
    if (text[i] == '\n') ++line;
    if (closing.empty()) {
      const auto byte = static_cast<unsigned char>(text[i]);
      const bool blank = byte == '\t' || byte == '\n' || byte == '\r';
      if (byte >= 0x7F || (byte < 0x20 && !blank)) return line;
      for (const std::string_view quote : {R"(""")", "'''", R"(")", "'"}) {
        if (!rest.starts_with(quote)) continue;
        closing = quote;
        escapes = quote[0] == '"';
        i += quote.size() - 1;
        break;
      }
      if (text[i] == '#' && closing.empty()) {
        closing = "\n";
        escapes = false;
      }
    } else if (escapes && text[i] == '\\') {
      ++i;
      if (i < text.size() && text[i] == '\n') ++line;
    } else if (rest.starts_with(closing)) {
      i += closing.size() - 1;
      closing = {};
    } else if (text[i] == '\n' && closing.size() == 1) {
      closing = {};  // an open string ends with its line: toml++ says so
    }
  }
  return std::nullopt;
}

}  // namespace

ConfigError::ConfigError(std::vector<std::string> problems)
    : std::runtime_error(fmt::format("{}", fmt::join(problems, "\n"))), problems_(std::move(problems)) {}

struct TomlFile::State {
  std::string name;
  toml::table root;
  std::map<const toml::table*, TomlTable::Node> nodes;       // of every table that was asked for
  std::deque<toml::table> absent;                            // empty stand-ins
  std::set<std::pair<std::uint32_t, std::string>> problems;  // line and message

  TomlTable handle(const toml::table& table, std::string prefix, std::uint32_t line);
};

struct TomlTable::Node {
  TomlFile::State& file;
  const toml::table& table;
  std::string prefix;  // of its keys in messages: "wrench." or "path[2]."
  std::uint32_t line;
  Names known;

  /// What the file holds under that key, which is known from now on.
  const toml::node* find(std::string_view key, bool required) {
    known.emplace(key);
    const toml::node* found = table.get(key);
    if (found == nullptr && required) {
      file.problems.emplace(line, fmt::format("'{}{}' is missing", prefix, key));
    }
    return found;
  }

  void refuse(const toml::node& value, std::string_view key, std::string_view complaint) {
    file.problems.emplace(value.source().begin.line, fmt::format("'{}{}' {}", prefix, key, complaint));
  }
  void refuse_type(const toml::node& value, std::string_view key, std::string_view expected) {
    refuse(value, key, fmt::format("should be {}, found {}", expected, describe(value.type())));
  }

  /// The number, or nothing after having said why not.
  std::optional<double> number(const toml::node& value, std::string_view key, const NumberRules& rules) {
    std::optional<double> number;
    if (const auto* whole = value.as_integer()) number = static_cast<double>(whole->get());
    if (const auto* real = value.as_floating_point()) number = real->get();
    if (!number) {
      refuse_type(value, key, "a number");
    } else if (!std::isfinite(*number)) {
      refuse(value, key, fmt::format("is {}, should be finite", *number));
    } else if (*number < rules.min || *number > rules.max) {
      refuse(value, key, fmt::format("is {}, allowed is {}", *number, describe(rules)));
    } else {
      return number;
    }
    return std::nullopt;
  }

  template <typename Value>
  void assign(std::string_view key, Value& value, std::string_view expected, const KeyRules& rules) {
    const toml::node* found = find(key, rules.required);
    if (found == nullptr) return;
    if (const auto* typed = found->as<Value>()) {
      value = typed->get();
    } else {
      refuse_type(*found, key, expected);
    }
  }
};

TomlTable TomlFile::State::handle(const toml::table& table, std::string prefix, std::uint32_t line) {
  TomlTable::Node fresh{*this, table, std::move(prefix), line, {}};
  return TomlTable(nodes.emplace(&table, std::move(fresh)).first->second);
}

void TomlTable::number(std::string_view key, double& value, const NumberRules& rules) {
  const toml::node* found = node_->find(key, rules.required);
  if (found != nullptr) value = node_->number(*found, key, rules).value_or(value);
}

void TomlTable::integer(std::string_view key, int& value, const NumberRules& rules) {
  const toml::node* found = node_->find(key, rules.required);
  if (found == nullptr) return;
  if (!found->is_integer()) return node_->refuse_type(*found, key, "an integer");
  using Limits = std::numeric_limits<int>;
  const NumberRules narrowed{.min = std::max<double>(rules.min, Limits::min()),
                             .max = std::min<double>(rules.max, Limits::max())};
  if (const auto number = node_->number(*found, key, narrowed)) value = static_cast<int>(*number);
}

void TomlTable::numbers(std::string_view key, std::span<double> values, const NumberRules& rules) {
  const toml::node* found = node_->find(key, rules.required);
  if (found == nullptr) return;
  const toml::array* array = found->as_array();
  if (array == nullptr) return node_->refuse_type(*found, key, fmt::format("{} numbers", values.size()));
  if (array->size() != values.size()) {
    return node_->refuse(*found, key,
                         fmt::format("should have {} numbers, found {}", values.size(), array->size()));
  }
  std::vector<double> numbers;
  for (std::size_t i = 0; i < array->size(); ++i) {
    const auto number = node_->number((*array)[i], fmt::format("{}[{}]", key, i), rules);
    if (number) numbers.push_back(*number);
  }
  if (numbers.size() == values.size()) std::ranges::copy(numbers, values.begin());
}

void TomlTable::boolean(std::string_view key, bool& value, const KeyRules& rules) {
  node_->assign(key, value, "a boolean", rules);
}

void TomlTable::text(std::string_view key, std::string& value, const KeyRules& rules) {
  node_->assign(key, value, "a string", rules);
}

std::optional<std::size_t> TomlTable::choice_index(std::string_view key,
                                                   std::span<const std::string_view> names,
                                                   const KeyRules& rules) {
  const toml::node* found = node_->find(key, rules.required);
  if (found == nullptr) return std::nullopt;
  const auto* text = found->as_string();
  if (text == nullptr) {
    node_->refuse_type(*found, key, "a string");
    return std::nullopt;
  }
  const auto name = std::ranges::find(names, text->get());
  if (name == names.end()) {
    node_->refuse(*found, key,
                  fmt::format("is '{}', allowed is '{}'", text->get(), fmt::join(names, "', '")));
    return std::nullopt;
  }
  return static_cast<std::size_t>(name - names.begin());
}

void TomlTable::refuse(std::string_view key, const std::string& complaint) {
  const toml::node* found = node_->table.get(key);
  const std::uint32_t line = found != nullptr ? found->source().begin.line : node_->line;
  node_->file.problems.emplace(line, fmt::format("'{}{}' {}", node_->prefix, key, complaint));
}

TomlTable TomlTable::table(std::string_view key, const KeyRules& rules) {
  const std::string prefix = fmt::format("{}{}.", node_->prefix, key);
  if (const toml::node* found = node_->find(key, rules.required)) {
    if (const toml::table* table = found->as_table()) {
      return node_->file.handle(*table, prefix, found->source().begin.line);
    }
    node_->refuse_type(*found, key, "a table");
  }
  return node_->file.handle(node_->file.absent.emplace_back(), prefix, node_->line);
}

std::vector<TomlTable> TomlTable::tables(std::string_view key, const KeyRules& rules) {
  std::vector<TomlTable> result;
  const toml::node* found = node_->find(key, rules.required);
  if (found == nullptr) return result;
  const toml::array* array = found->as_array();
  if (array == nullptr) {
    node_->refuse_type(*found, key, "an array of tables");
    return result;
  }
  for (std::size_t i = 0; i < array->size(); ++i) {
    const toml::node& element = (*array)[i];
    const std::string name = fmt::format("{}[{}]", key, i);
    if (const toml::table* table = element.as_table()) {
      result.push_back(node_->file.handle(*table, node_->prefix + name + ".", element.source().begin.line));
    } else {
      node_->refuse_type(element, name, "a table");
    }
  }
  return result;
}

TomlFile::TomlFile(std::unique_ptr<State> state) : state_(std::move(state)) {}
TomlFile::TomlFile(TomlFile&&) noexcept = default;
TomlFile& TomlFile::operator=(TomlFile&&) noexcept = default;
TomlFile::~TomlFile() = default;

TomlFile TomlFile::parse(const std::filesystem::path& path) {
  auto state = std::make_unique<State>();
  state->name = path.string();
  try {
    const std::string text = read(path);
    if (const auto line = stray_character(text))
      throw ConfigError(
          {fmt::format("{}:{}: a letter beyond ASCII outside quotes; put the key or value in quotes",
                       state->name, *line)});
    state->root = toml::parse(text);
  } catch (const ParserLost&) {
    throw ConfigError({state->name + ": is not TOML: look for brackets or quotes that do not match"});
  } catch (const toml::parse_error& error) {
    throw ConfigError(
        {fmt::format("{}:{}: {}", state->name, error.source().begin.line, error.description())});
  }
  return TomlFile(std::move(state));
}

TomlTable TomlFile::root() { return state_->handle(state_->root, "", 1); }

void TomlFile::finish() const {
  auto problems = state_->problems;
  for (const auto& [table, node] : state_->nodes) {
    for (const auto& [key, value] : *table) {
      if (node.known.contains(key.str())) continue;
      problems.emplace(key.source().begin.line, fmt::format("unknown key '{}{}': {}", node.prefix, key.str(),
                                                            hint(key.str(), node.known)));
    }
  }
  if (problems.empty()) return;
  std::vector<std::string> lines;
  for (const auto& [line, message] : problems) {
    lines.push_back(fmt::format("{}:{}: {}", state_->name, line, message));
  }
  throw ConfigError(std::move(lines));
}

}  // namespace apps
