// Settings that `set` may change: the table in docs/safety.md compared with what load_config() accepts.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <map>
#include <regex>
#include <string>

#include "operation/config.h"
#include "runtime/configuration/toml_reader.h"
#include "tests/support/built_paths.h"
#include "tests/support/temporary_directory.h"

namespace operation {
namespace setting_bounds_test {

const std::filesystem::path kRoot = support::source_dir();
const std::filesystem::path kDemo = kRoot / "apps/youbotd/demo.toml";
const std::filesystem::path kTeleop = kRoot / "apps/youbotd/teleop.toml";

/// For each key with its table: the range that the document gives for `set`.
std::map<std::string, std::string> documented() {
  std::map<std::string, std::string> rules;
  std::ifstream page(kRoot / "docs/safety.md");
  const std::regex row(R"(^\| `([a-z.]+)` \| ([^|]+) \| (.*) \|$)");
  const std::regex key(R"(`([A-Za-z0-9_]+)`)");
  std::smatch parts;
  bool in_section = false;
  for (std::string line; std::getline(page, line);) {
    if (line.starts_with("## ")) in_section = line == "## What `set` may change";
    if (!in_section || !std::regex_match(line, parts, row)) continue;
    const std::string keys = parts[3];
    for (std::sregex_iterator one(keys.begin(), keys.end(), key); one != std::sregex_iterator(); ++one) {
      const std::string name = parts[1].str() + '.' + (*one)[1].str();
      EXPECT_TRUE(rules.emplace(name, parts[2]).second) << name << " is there twice";
    }
  }
  return rules;
}

/// The keys of a file that `set` may name, also those that a comment shows, with their values.
std::map<std::string, std::string> settable(const std::filesystem::path& file) {
  std::map<std::string, std::string> values;
  std::ifstream in(file);
  const std::regex header(R"(^\[([a-z.]+)\].*)");
  const std::regex array(R"(^\[\[([a-z.]+)\.([a-z]+)\]\].*)");
  const std::regex key(R"(^(# )?([A-Za-z0-9_]+) = (\[[^\]]*\]|[^ #]+).*)");
  const std::regex may(R"(limits|workspace|controller|plausibility|compensation|path|teleoperation\..*)");
  std::smatch parts;
  std::string table;
  for (std::string line; std::getline(in, line);) {
    if (std::regex_match(line, parts, array)) {
      table = parts[1];
      if (std::regex_match(table, may)) values[table + '.' + parts[2].str()];
      table.clear();
    } else if (std::regex_match(line, parts, header)) {
      table = parts[1];
    } else if (std::regex_match(line, parts, key) && std::regex_match(table, may)) {
      values[table + '.' + parts[2].str()] = parts[3];
    }
  }
  return values;
}

bool takes(const std::filesystem::path& file, const std::string& key, const std::string& value) {
  try {
    (void)load_config(file, {{key, value}});
    return true;
  } catch (const runtime::ConfigError& error) {
    EXPECT_TRUE(std::string(error.what()).starts_with("set: '" + key)) << error.what();
    return false;
  }
}

/// Each number of `value`, or the one that it is, a little larger or smaller.
std::string moved(const std::string& value, double by) {
  std::string text;
  const std::regex number(R"(-?[0-9][0-9.e-]*)");
  auto end = value.cbegin();
  for (std::sregex_iterator one(value.begin(), value.end(), number); one != std::sregex_iterator(); ++one) {
    text.append(end, (*one)[0].first);
    text += std::to_string(std::stod(one->str()) + by);
    end = (*one)[0].second;
  }
  return text.append(end, value.cend());
}

TEST(SettingBounds, TheDocumentListsEachKeyOfTheFiles) {
  const std::map<std::string, std::string> rules = documented();
  std::map<std::string, std::string> keys = settable(kDemo);
  keys.merge(settable(kTeleop));
  for (const auto& [key, value] : keys)
    EXPECT_TRUE(rules.contains(key)) << key << " is not in docs/safety.md";
  for (const auto& [key, rule] : rules) EXPECT_TRUE(keys.contains(key)) << key << ": " << rule;
  EXPECT_GT(keys.size(), 100U);
}

TEST(SettingBounds, EachNumberMovesAsTheDocumentSays) {
  const std::map<std::string, std::string> demo = settable(kDemo);
  const std::map<std::string, std::string> teleop = settable(kTeleop);
  int tried = 0;
  for (const auto& [key, rule] : documented()) {
    if (rule != "no more" && rule != "no less" && rule != "the same") continue;
    const bool by_hand = key.starts_with("teleoperation.");
    const std::filesystem::path& file = by_hand ? kTeleop : kDemo;
    const std::string& value = (by_hand ? teleop : demo).at(key);
    EXPECT_EQ(takes(file, key, moved(value, 1e-4)), rule == "no less") << key;
    const bool at_its_least = key == "teleoperation.arm.payload_kg";
    if (!at_its_least) {
      EXPECT_EQ(takes(file, key, moved(value, -1e-4)), rule == "no more") << key;
    }
    ++tried;
  }
  EXPECT_GT(tried, 90);
}

TEST(SettingBounds, ASwitchGoesOneWay) {
  const support::TemporaryDirectory directory;
  for (const auto& [key, rule] : documented()) {
    if (rule != "not on" && rule != "not off") continue;
    const std::size_t dot = key.rfind('.');
    const std::string line = '[' + key.substr(0, dot) + "]\n" + key.substr(dot + 1) + " = ";
    const auto file_with = [&](const char* value) {
      return directory.write("file.toml", line + value + '\n');
    };
    EXPECT_EQ(takes(file_with("false"), key, "true"), rule == "not off") << key;
    EXPECT_EQ(takes(file_with("true"), key, "false"), rule == "not on") << key;
  }
}

TEST(SettingBounds, WallsComeNoFurtherApart) {
  const support::TemporaryDirectory directory;
  for (const auto& [key, rule] : documented()) {
    if (rule != "no wider") continue;
    const auto file =
        directory.write("file.toml", "[workspace]\n" + key.substr(key.rfind('.') + 1) + " = [-1, 2]\n");
    EXPECT_TRUE(takes(file, key, "[-0.9, 1.9]")) << key;
    EXPECT_THROW((void)load_config(file, {{key, "[-1.1, 2]"}}), runtime::ConfigError) << key;
    EXPECT_THROW((void)load_config(file, {{key, "[-1, 2.1]"}}), runtime::ConfigError) << key;
  }
}

TEST(SettingBounds, AnOldSetPointIsFollowedForNoLongerThanASilentCommanderIsWaitedFor) {
  const support::TemporaryDirectory directory;
  const auto load = [&](const char* commander_timeout_s) {
    return load_config(directory.write(
        "file.toml",
        std::string("[loop]\ncommand_timeout_s = 0.6\ncommander_timeout_s = ") + commander_timeout_s));
  };
  EXPECT_NO_THROW((void)load("0.6"));
  try {
    (void)load("0.5");
    FAIL() << "accepted";
  } catch (const runtime::ConfigError& error) {
    EXPECT_NE(std::string(error.what())
                  .find("file.toml:2: 'loop.command_timeout_s' is more than 'loop.commander_timeout_s'"),
              std::string::npos)
        << error.what();
  }
}

}  // namespace setting_bounds_test
}  // namespace operation
