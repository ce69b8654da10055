/// @file
/// Reads a TOML file into plain structs and reports all its errors at once.
///
///     TomlFile file = TomlFile::parse("demo.toml");
///     TomlTable root = file.root();
///     root.number("cycle_period_s", config.cycle_period_s, {.min = 0.0005, .max = 0.01});
///     root.choice("robot", config.robot, {{"base", Robot::kBase}, {"arm", Robot::kArm}}, {.required =
///     true}); for (TomlTable& segment : root.tables("path")) segment.number("turn_rad", ...); file.finish();
///     // throws if anything above was rejected, and for keys that were not read
///
/// If a key is missing or rejected, its value is unchanged, so defaults are in the struct.
#pragma once
#include <cstddef>
#include <filesystem>
#include <initializer_list>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

namespace runtime {

class RegularFile;

/// Larger than any hand-written file. Longer files are rejected.
inline constexpr std::size_t kMaxToml_bytes = 4 << 20;

/// The file cannot be used. what() lists its problems, one per line: the first hundred and the number of the
/// rest.
class ConfigError : public std::runtime_error {
 public:
  explicit ConfigError(std::vector<std::string> problems);
  /// Each as "file:line: message" (without line if the file could not be read), sorted by line.
  const std::vector<std::string>& problems() const noexcept { return problems_; }

 private:
  std::vector<std::string> problems_;
};

struct KeyRules {
  bool required = false;
  std::size_t most = 1000;  ///< elements of an array
};
/// Both limits are allowed values. NaN and infinity are always rejected.
struct NumberRules {
  double min = -std::numeric_limits<double>::infinity();
  double max = std::numeric_limits<double>::infinity();
  bool required = false;
};

/// One table of a TomlFile, valid while that file exists. A missing table reads like an empty one.
class TomlTable {
 public:
  /// Accepts whole numbers too.
  void number(std::string_view key, double& value, const NumberRules& rules = {});
  /// Accepts whole numbers only.
  void integer(std::string_view key, int& value, const NumberRules& rules = {});
  /// Accepts an array of exactly `values.size()` numbers.
  void numbers(std::string_view key, std::span<double> values, const NumberRules& rules = {});
  /// Accepts an array of any number of numbers, up to `rules.most`.
  void list(std::string_view key, std::vector<double>& values, const KeyRules& rules = {});
  void boolean(std::string_view key, bool& value, const KeyRules& rules = {});
  void text(std::string_view key, std::string& value, const KeyRules& rules = {});
  /// Accepts an array of strings, up to `rules.most`.
  void texts(std::string_view key, std::vector<std::string>& values, const KeyRules& rules = {});

  template <typename Value>
  using Choices = std::initializer_list<std::pair<std::string_view, std::type_identity_t<Value>>>;
  template <typename Value>
  void choice(std::string_view key, Value& value, Choices<Value> choices, const KeyRules& rules = {}) {
    choice(key, value, std::span(choices), rules);
  }
  template <typename Value>
  void choice(std::string_view key, Value& value,
              std::span<const std::pair<std::string_view, std::type_identity_t<Value>>> choices,
              const KeyRules& rules = {}) {
    std::vector<std::string_view> names;
    for (const auto& [name, meaning] : choices) names.push_back(name);
    if (const auto index = choice_index(key, names, rules)) value = choices[*index].second;
  }

  /// Reports a value that is wrong only in combination with others, at the line of `key`, or of the table if
  /// the key is missing.
  void refuse(std::string_view key, const std::string& complaint);
  /// For a key that makes the whole file a wrong one. @throws ConfigError with this problem only.
  [[noreturn]] void reject(std::string_view key, const std::string& complaint) const;

  /// Accepts any content: it belongs to another program.
  void ignore(std::string_view key);
  /// All keys count as known: which ones are, depends on a value that was refused.
  void ignore_rest();

  /// Whether TomlFile::set() gave the value of this key, not the file.
  bool is_set(std::string_view key) const;
  /// Whether there is such a key or table; does not count as reading it.
  bool has(std::string_view key) const;
  /// The same for a table alone.
  bool has_table(std::string_view key) const;
  /// The value or table in a normal form, to compare two files; empty if there is none. Does not count as
  /// reading it. `without`: a key that the table is written without; empty if no other is left.
  std::string written(std::string_view key, std::string_view without = {}) const;
  /// Whether it is empty; does not count as reading it.
  bool empty() const;
  TomlTable table(std::string_view key, const KeyRules& rules = {});
  /// The elements of an array of tables, `[[key]]`: up to `rules.most`.
  std::vector<TomlTable> tables(std::string_view key, const KeyRules& rules = {});

 private:
  friend class TomlFile;
  struct Node;
  explicit TomlTable(Node& node) : node_(&node) {}
  std::optional<std::size_t> choice_index(std::string_view key, std::span<const std::string_view> names,
                                          const KeyRules& rules);
  Node* node_;
};

/// `text` quoted for TOML. Control characters, which such text cannot hold, become blanks.
std::string toml_string(std::string_view text);
/// Shortest text that reads back as the same number; always a TOML float.
std::string toml_number(double value);
/// A comment that stays on its line.
std::string toml_comment(std::string_view text);

class TomlFile {
 public:
  /// @throws ConfigError if the file cannot be read, or at its first syntax error.
  static TomlFile parse(const std::filesystem::path& path);
  /// The same for an open file; messages name it by its path.
  static TomlFile parse(const std::filesystem::path& path, const RegularFile& file);
  TomlFile(TomlFile&&) noexcept;
  TomlFile& operator=(TomlFile&&) noexcept;
  ~TomlFile();

  /// Before root(): as if the file contained `value`, in TOML syntax, for the dotted `key`.
  /// @throws ConfigError if that is not one key and its value.
  void set(const std::string& key, const std::string& value);

  TomlTable root();
  /// Call after everything has been read.
  /// @throws ConfigError with all problems, including the keys of every table that were not read.
  void finish() const;

 private:
  friend class TomlTable;
  struct State;
  explicit TomlFile(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace runtime
