#include "runtime/configuration/toml_reader.h"

#include <gtest/gtest.h>

#include <array>
#include <filesystem>
#include <functional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "tests/support/temporary_directory.h"

namespace toml_reader_test {

using runtime::ConfigError;
using runtime::TomlFile;
using runtime::TomlTable;

class TomlReader : public testing::Test {
 protected:
  TomlFile parse(std::string_view text) const { return TomlFile::parse(directory_.write(kName, text)); }

  /// The problems of parsing `text`, of `ask` and of finish(), without the path in front of ":line: message".
  std::vector<std::string> problems(std::string_view text,
                                    const std::function<void(TomlTable)>& ask = {}) const {
    try {
      TomlFile file = parse(text);
      if (ask) ask(file.root());
      file.finish();
    } catch (const ConfigError& error) {
      std::vector<std::string> result;
      for (const std::string& problem : error.problems()) {
        EXPECT_EQ(problem.substr(0, path_.string().size()), path_.string());
        result.push_back(problem.substr(path_.string().size()));
      }
      return result;
    }
    return {};
  }

  void expect_refused(std::string_view reason) const {
    try {
      TomlFile::parse(path_);
      FAIL();
    } catch (const ConfigError& error) {
      EXPECT_EQ(error.what(), path_.string().append(reason));
    }
  }

  static constexpr std::string_view kName = "read.toml";
  const support::TemporaryDirectory directory_;
  const std::filesystem::path path_ = directory_ / kName;
};

using Lines = std::vector<std::string>;
enum class Robot { kNone, kBase, kArm };

TEST_F(TomlReader, ReadsEveryKindOfValue) {
  double number = 0;
  double whole = 0;
  int integer = 0;
  std::array<double, 3> numbers{};
  bool boolean = false;
  std::string text;
  Robot robot = Robot::kNone;
  double nested = 0;
  std::vector<double> turns_rad;

  constexpr std::string_view kText = R"(number = 1.5
whole = 2
integer = -3
numbers = [1, 2.5, -3]
boolean = true
text = "word"
robot = "arm"
[outer.inner]
nested = 4.0
[[path]]
turn_rad = 5.0
[[path]]
turn_rad = 6.0
)";
  const Lines found = problems(kText, [&](TomlTable root) {
    root.number("number", number);
    root.number("whole", whole);
    root.integer("integer", integer);
    root.numbers("numbers", numbers);
    root.boolean("boolean", boolean);
    root.text("text", text);
    root.choice("robot", robot, {{"base", Robot::kBase}, {"arm", Robot::kArm}});
    root.table("outer").table("inner").number("nested", nested);
    for (TomlTable& segment : root.tables("path")) {
      segment.number("turn_rad", turns_rad.emplace_back());
    }
  });
  EXPECT_EQ(found, Lines{});

  EXPECT_EQ(number, 1.5);
  EXPECT_EQ(whole, 2.0);
  EXPECT_EQ(integer, -3);
  EXPECT_EQ(numbers, (std::array{1.0, 2.5, -3.0}));
  EXPECT_TRUE(boolean);
  EXPECT_EQ(text, "word");
  EXPECT_EQ(robot, Robot::kArm);
  EXPECT_EQ(nested, 4.0);
  EXPECT_EQ(turns_rad, (std::vector{5.0, 6.0}));
}

TEST_F(TomlReader, AbsentKeysKeepTheirDefaults) {
  double number = 1.5;
  int integer = 2;
  std::array numbers{3.0, 4.0};
  bool boolean = true;
  std::string text = "default";
  Robot robot = Robot::kBase;

  const Lines found = problems("", [&](TomlTable root) {
    for (TomlTable table : {root, root.table("absent"), root.table("absent").table("inner")}) {
      table.number("number", number, {.min = 1});
      table.integer("integer", integer);
      table.numbers("numbers", numbers);
      table.boolean("boolean", boolean);
      table.text("text", text);
      table.choice("robot", robot, {{"arm", Robot::kArm}});
      EXPECT_TRUE(table.tables("path").empty());
    }
  });
  EXPECT_EQ(found, Lines{});

  EXPECT_EQ(number, 1.5);
  EXPECT_EQ(integer, 2);
  EXPECT_EQ(numbers, (std::array{3.0, 4.0}));
  EXPECT_TRUE(boolean);
  EXPECT_EQ(text, "default");
  EXPECT_EQ(robot, Robot::kBase);
}

TEST_F(TomlReader, RefusedKeysKeepTheirDefaults) {
  double number = 1.5;
  int integer = 2;
  std::array numbers{3.0, 4.0};
  Robot robot = Robot::kBase;

  const Lines found =
      problems("number = 9\ninteger = 9\nnumbers = [0, 9]\nrobot = 'leg'\n", [&](TomlTable root) {
        root.number("number", number, {.max = 5});
        root.integer("integer", integer, {.max = 5});
        root.numbers("numbers", numbers, {.max = 5});
        root.choice("robot", robot, {{"arm", Robot::kArm}});
      });
  EXPECT_EQ(found.size(), 4u);

  EXPECT_EQ(number, 1.5);
  EXPECT_EQ(integer, 2);
  EXPECT_EQ(numbers, (std::array{3.0, 4.0}));
  EXPECT_EQ(robot, Robot::kBase);
}

TEST_F(TomlReader, AllProblemsComeAtOnceSortedByLine) {
  double number = 0;
  bool boolean = false;
  std::string text;
  Robot robot = Robot::kNone;

  // Asked for in another order than written.
  constexpr std::string_view kText = R"(# a comment
unknown = 1
compensation = "yes"

[wrench]
mass_kg = 7
[robot]
kind = "leg"

[[path]]
turn_rad = 1.0
[[path]]
turn_rad = inf
speed = 1
)";
  const Lines found = problems(kText, [&](TomlTable root) {
    for (TomlTable& segment : root.tables("path")) segment.number("turn_rad", number);
    TomlTable wrench = root.table("wrench");
    wrench.text("name", text, {.required = true});
    wrench.number("mass_kg", number, {.max = 5});
    root.table("robot").choice("kind", robot, {{"base", Robot::kBase}, {"arm", Robot::kArm}});
    root.boolean("compensation", boolean);
  });
  EXPECT_EQ(found,
            (Lines{":2: unknown key 'unknown': known keys are 'compensation', 'path', 'robot', 'wrench'",
                   ":3: 'compensation' should be a boolean, found a string", ":5: 'wrench.name' is missing",
                   ":6: 'wrench.mass_kg' is 7, allowed is at most 5",
                   ":8: 'robot.kind' is 'leg', allowed is 'base', 'arm'",
                   ":13: 'path[1].turn_rad' is inf, should be finite",
                   ":14: unknown key 'path[1].speed': known keys are 'turn_rad'"}));
}

TEST_F(TomlReader, WhatHoldsTheProblemsOnePerLine) {
  TomlFile file = parse("a = 1\nb = 2\n");
  file.root();
  try {
    file.finish();
    FAIL();
  } catch (const std::runtime_error& error) {
    const std::string path = path_.string();
    EXPECT_EQ(error.what(), path + ":1: unknown key 'a': no keys are expected here\n" + path +
                                ":2: unknown key 'b': no keys are expected here");
  }
}

TEST_F(TomlReader, WrongTypesNameExpectedAndFound) {
  constexpr std::string_view kText = R"(number = "1.5"
integer = 1.0
numbers = 1
boolean = 1
text = false
choice = [1]
table = 2020-01-01
tables = 07:30:00
[not_an_array]
)";
  const Lines found = problems(kText, [](TomlTable root) {
    double number = 0;
    int integer = 0;
    std::array<double, 4> numbers{};
    bool boolean = false;
    std::string text;
    root.number("number", number);
    root.integer("integer", integer);
    root.numbers("numbers", numbers);
    root.boolean("boolean", boolean);
    root.text("text", text);
    root.choice("choice", number, {{"one", 1.0}});
    root.table("table").number("of_it", number);
    EXPECT_TRUE(root.tables("tables").empty());
    EXPECT_TRUE(root.tables("not_an_array").empty());
  });
  EXPECT_EQ(found, (Lines{":1: 'number' should be a number, found a string",
                          ":2: 'integer' should be an integer, found a number",
                          ":3: 'numbers' should be 4 numbers, found an integer",
                          ":4: 'boolean' should be a boolean, found an integer",
                          ":5: 'text' should be a string, found a boolean",
                          ":6: 'choice' should be a string, found an array",
                          ":7: 'table' should be a table, found a date or time",
                          ":8: 'tables' should be an array of tables, found a date or time",
                          ":9: 'not_an_array' should be an array of tables, found a table"}));
}

TEST_F(TomlReader, RangesIncludeTheirLimits) {
  const auto ask = [](TomlTable root) {
    double number = 0;
    root.number("period_s", number, {.min = 0.0005, .max = 0.01});
    root.number("mass_kg", number, {.min = 0});
    root.number("slope", number, {.max = -1});
  };
  EXPECT_EQ(problems("period_s = 0.0005\nmass_kg = 0\nslope = -1", ask), Lines{});
  EXPECT_EQ(problems("period_s = 0.01", ask), Lines{});
  EXPECT_EQ(
      problems("period_s = 0.0101\nmass_kg = -0.5\nslope = 0", ask),
      (Lines{":1: 'period_s' is 0.0101, allowed is 0.0005 to 0.01",
             ":2: 'mass_kg' is -0.5, allowed is at least 0", ":3: 'slope' is 0, allowed is at most -1"}));
}

TEST_F(TomlReader, NotANumberAndInfinityAreNeverNumbers) {
  const Lines found = problems("a = nan\nb = -inf\nc = [0, +inf, 0]\n", [](TomlTable root) {
    double number = 0;
    std::array<double, 3> numbers{};
    root.number("a", number);
    root.number("b", number);
    root.numbers("c", numbers);
  });
  EXPECT_EQ(found, (Lines{":1: 'a' is nan, should be finite", ":2: 'b' is -inf, should be finite",
                          ":3: 'c[1]' is inf, should be finite"}));
}

TEST_F(TomlReader, IntegersStayInTheRangeOfInt) {
  int value = 0;
  EXPECT_EQ(problems("a = 2147483647", [&](TomlTable root) { root.integer("a", value, {.min = 0}); }),
            Lines{});
  EXPECT_EQ(value, 2147483647);
  EXPECT_EQ(problems("a = 2147483648", [&](TomlTable root) { root.integer("a", value, {.min = 0}); }),
            Lines{":1: 'a' is 2147483648, allowed is 0 to 2147483647"});
  // More digits than a double holds.
  EXPECT_EQ(problems("a = 9223372036854775807", [&](TomlTable root) { root.integer("a", value); }).size(),
            1u);
}

TEST_F(TomlReader, ArraysOfNumbersHaveExactlyTheAskedLength) {
  const auto ask = [](TomlTable root) {
    std::array<double, 2> pair{};
    root.numbers("pair", pair, {.min = 0, .required = true});
  };
  EXPECT_EQ(problems("pair = [1, 2]", ask), Lines{});
  EXPECT_EQ(problems("pair = []", ask), Lines{":1: 'pair' should have 2 numbers, found 0"});
  EXPECT_EQ(problems("pair = [1]", ask), Lines{":1: 'pair' should have 2 numbers, found 1"});
  EXPECT_EQ(problems("pair = [1, 2, 3]", ask), Lines{":1: 'pair' should have 2 numbers, found 3"});
  EXPECT_EQ(problems("pair = [\n  -1,\n  'two',\n]", ask),
            (Lines{":2: 'pair[0]' is -1, allowed is at least 0",
                   ":3: 'pair[1]' should be a number, found a string"}));
}

TEST_F(TomlReader, RequiredKeysAreMissedAtTheLineOfTheirTable) {
  const auto ask = [](TomlTable root) {
    double number = 0;
    int integer = 0;
    bool boolean = false;
    std::array<double, 2> numbers{};
    std::string text;
    root.text("name", text, {.required = true});
    root.tables("path", {.required = true});
    TomlTable wrench = root.table("wrench", {.required = true});
    wrench.number("mass_kg", number, {.required = true});
    wrench.integer("count", integer, {.required = true});
    wrench.boolean("enabled", boolean, {.required = true});
    wrench.numbers("pair", numbers, {.required = true});
    wrench.choice("kind", integer, {{"one", 1}}, {.required = true});
  };
  EXPECT_EQ(problems("\n[wrench]\n", ask),
            (Lines{":1: 'name' is missing", ":1: 'path' is missing", ":2: 'wrench.count' is missing",
                   ":2: 'wrench.enabled' is missing", ":2: 'wrench.kind' is missing",
                   ":2: 'wrench.mass_kg' is missing", ":2: 'wrench.pair' is missing"}));
  EXPECT_EQ(problems("name = 'x'\npath = []\n", ask).front(), ":1: 'wrench' is missing");
}

TEST_F(TomlReader, UnknownKeysAreFoundAtEveryDepth) {
  constexpr std::string_view kText = R"(
[known.inner]
value = 1
[known.other]
value = 1
[[list]]
[list.inner]
value = 1
extra = 1
[other]
value = 1
)";
  const Lines found = problems(kText, [](TomlTable root) {
    double value = 0;
    root.table("known").table("inner");
    for (TomlTable& element : root.tables("list")) element.table("inner").number("value", value);
  });
  EXPECT_EQ(found, (Lines{":3: unknown key 'known.inner.value': no keys are expected here",
                          ":4: unknown key 'known.other': known keys are 'inner'",
                          ":9: unknown key 'list[0].inner.extra': known keys are 'value'",
                          ":10: unknown key 'other': known keys are 'known', 'list'"}));
}

TEST_F(TomlReader, ATableMayBeAskedForTwice) {
  const Lines found = problems("[table]\na = 1\nb = 2\n", [](TomlTable root) {
    double value = 0;
    root.table("table").number("a", value);
    root.table("table").number("b", value);
  });
  EXPECT_EQ(found, Lines{});
}

TEST_F(TomlReader, InlineTablesAreTables) {
  double sum = 0;
  constexpr std::string_view kText =
      "list = [\n  { a = 1 },\n  2,\n  { a = 3, b = 4 } ]\ntable = { a = 5 }\n";
  const Lines found = problems(kText, [&](TomlTable root) {
    double value = 0;
    for (TomlTable& element : root.tables("list")) {
      element.number("a", value);
      sum += value;
    }
    root.table("table").number("a", value);
    sum += value;
  });
  EXPECT_EQ(found, (Lines{":3: 'list[1]' should be a table, found an integer",
                          ":4: unknown key 'list[2].b': known keys are 'a'"}));
  EXPECT_EQ(sum, 9);
}

TEST_F(TomlReader, HintsForUnknownKeys) {
  const struct {
    std::string written;
    std::vector<std::string> known;
    std::string hint;
  } cases[] = {
      // The same quantity in another unit, or without one, is worth more than a shorter way to another key.
      {"stiffness_N_per_mm",
       {"stiffness_N_per_m", "damping_N_s_per_m"},
       "wrong unit: expected 'stiffness_N_per_m'"},
      {"mass_g", {"mass_kg", "mast_g"}, "wrong unit: expected 'mass_kg'"},
      {"turn_deg", {"turn_rad", "turn_rad_per_s"}, "wrong unit: expected 'turn_rad'"},
      {"turn_deg_per_s", {"turn_rad", "turn_rad_per_s"}, "wrong unit: expected 'turn_rad_per_s'"},
      {"current", {"current_A", "currents"}, "wrong unit: expected 'current_A'"},
      {"p_HD_mm", {"p_HB_m", "p_HD_m"}, "wrong unit: expected 'p_HD_m'"},
      // A misspelled word.
      {"compensaton", {"compensation", "mode"}, "did you mean 'compensation'?"},
      {"torque_nm", {"torque_Nm", "name"}, "did you mean 'torque_Nm'?"},
      {"modes", {"mode"}, "did you mean 'mode'?"},
      // Nothing near; a unit alone is no name.
      {"max_s", {"min_s", "mass_kg"}, "known keys are 'mass_kg', 'min_s'"},
      {"m", {"s"}, "known keys are 's'"},
      {"speed", {"robot", "mass_kg"}, "known keys are 'mass_kg', 'robot'"},
  };
  for (const auto& [written, known, hint] : cases) {
    const auto found = problems(written + " = 1\n", [&known = known](TomlTable root) {
      double value = 0;
      for (const std::string& key : known) root.number(key, value);
    });
    EXPECT_EQ(found, Lines{":1: unknown key '" + written + "': " + hint});
  }
}

TEST_F(TomlReader, SyntaxErrorsHaveTheirLine) {
  const auto only_problem = [this](std::string_view text) {
    const Lines found = problems(text);
    return found.size() == 1 ? found.front() : "not one problem";
  };
  EXPECT_EQ(only_problem("a = 1\n\na = 2\n").substr(0, 3), ":3:");
  EXPECT_NE(only_problem("a = 1\n\na = 2\n").find("redefine"), std::string::npos);
  EXPECT_EQ(only_problem("[a]\n[a]\n").substr(0, 3), ":2:");
  EXPECT_EQ(only_problem("\na =\n").substr(0, 3), ":2:");
  EXPECT_EQ(only_problem("a = 1 2\n").substr(0, 3), ":1:");
}

TEST_F(TomlReader, EveryPrefixOfAFileIsReadOrRefused) {
  const std::string_view text =
      "name = \"x\"\n[table]\nnumbers = [1.5, 2e3]\n[[list]]\ninline = { a = 0x1F }\n";
  for (std::size_t size = 0; size <= text.size(); ++size) {
    try {
      parse(text.substr(0, size));
    } catch (const ConfigError& error) {
      EXPECT_EQ(error.problems().size(), 1u);
    }
  }
}

TEST_F(TomlReader, BinaryGarbageIsASyntaxError) {
  using std::string_view_literals::operator""sv;
  for (const std::string_view garbage :
       {"\x7f\x45LF\x02\x01\x01\0\0\0"sv, "\xff\xfe\0a\0 "sv, "\0"sv, "a = \"\xc3\x28\""sv}) {
    EXPECT_THROW(parse(garbage), ConfigError);
  }
}

TEST_F(TomlReader, AnEmptyFileIsFine) {
  TomlFile file = parse("");
  file.root();
  EXPECT_NO_THROW(file.finish());
}

TEST_F(TomlReader, AMissingFileSaysSo) { expect_refused(": cannot be opened: No such file or directory"); }

TEST_F(TomlReader, ADirectoryIsNoFile) {
  std::filesystem::create_directory(path_);
  expect_refused(": is a directory, expected a file");
}

TEST_F(TomlReader, MovingTheFileKeepsItsTables) {
  TomlFile file = parse("a = 1\n");
  TomlTable root = file.root();
  const TomlFile moved = std::move(file);
  double value = 0;
  root.number("a", value);
  EXPECT_EQ(value, 1.0);
  EXPECT_NO_THROW(moved.finish());
}

TEST_F(TomlReader, ALetterOutOfPlaceIsRefusedWithItsLine) {
  for (const char* text :
       {"\n\ngröße = 1\n", "\n\nname = é\n", "# ok\n\nname = \"a\" é\n", "\n\nname = 'a\nñ = 1\n",
        "\n\nname\x7F = 1\n", "\n\nf=745555\"\xCB\xB3\"", "\n\nat = -1`zay_[\"\"\"[a\xD0\xBF\"\"\"",
        "\n\nb = \"x\"\"y\"\n", "\n\nname = 1\xC2\xA0\xE1\x9A\x81"}) {
    const auto found = problems(text);
    ASSERT_EQ(found.size(), 1U) << text;
    EXPECT_TRUE(found.front().starts_with(":3: ")) << text << ": " << found.front();
  }
}

TEST_F(TomlReader, QuotesStandWhereKeysAndValuesBegin) {
  std::string name;
  const auto ask = [&name](TomlTable root) {
    TomlTable table = root.table("a b");
    table.text("n.m", name);
  };
  for (const char* text :
       {"[\"a b\"]\n'n.m' = 'x'\n", "\"a b\".\"n.m\" = \"x\"\n", "'a b' = { 'n.m' = 'x' }\n"}) {
    EXPECT_EQ(problems(text, ask), std::vector<std::string>{}) << text;
    EXPECT_EQ(name, "x") << text;
  }
  const auto ask_name = [&name](TomlTable root) { root.text("name", name); };
  EXPECT_EQ(problems("name = \"\"\"x\"\"\"\"\"\n", ask_name), std::vector<std::string>{});
  EXPECT_EQ(name, "x\"\"");
}

TEST_F(TomlReader, WhatTomlTakesForGrantedIsRefusedToo) {
  for (const char* text : {"[[<name]]\n", "[[\x07name]]\n", "[ =b]\n", "fault = []{ kind = 1 }]\n"})
    EXPECT_EQ(problems(text).size(), 1U) << text;
}

TEST_F(TomlReader, LettersBeyondAsciiAreWelcomeInStringsAndComments) {
  std::string name;
  const auto ask = [&name](TomlTable root) { root.text("name", name); };
  for (const char* text : {"# Größe\nname = \"é\"\n", "name = 'é' # é\n", "name = \"\"\"é\"\"\"\n",
                           "name = \"é\" # it's\n", "name = '''é'''\n", "\xEF\xBB\xBFname = \"é\"\n"}) {
    EXPECT_EQ(problems(text, ask), std::vector<std::string>{}) << text;
    EXPECT_EQ(name, "é") << text;
  }
  EXPECT_EQ(problems("name = \"\\\"é\"\n", ask), std::vector<std::string>{});
  EXPECT_EQ(name, "\"é");
}

TEST_F(TomlReader, TheDepthOfAKeyIsBounded) {
  const auto key = [](std::size_t dots) {
    std::string text = "a";
    for (std::size_t i = 0; i < dots; ++i) text += ".a";
    return text;
  };
  const auto ignore = [](TomlTable root) { root.ignore("a"); };
  EXPECT_EQ(problems("\n[" + key(64) + "]\n", ignore), Lines{});
  const Lines refusal{":2: more than 64 dots in one key or text"};
  for (const std::size_t dots : {std::size_t{65}, std::size_t{1'000'000}})
    for (const std::string& text :
         {"\n[" + key(dots) + "]\n", "\n[[" + key(dots) + "]]\n", "\n" + key(dots) + " = 1\n",
          "\nb = { c = '''\"''', " + key(dots) + " = 1 }\n"})
      EXPECT_EQ(problems(text, ignore), refusal) << dots;
  TomlFile file = parse("");
  EXPECT_NO_THROW(file.set(key(64), "1"));
  EXPECT_THROW(file.set(key(65), "1"), ConfigError);
}

TEST_F(TomlReader, ASettingThatCannotBeReadIsRefusedWithItsKeyAndTheReason) {
  const auto refusal = [&](const std::string& key, const std::string& value) -> std::string {
    TomlFile file = parse("");
    try {
      file.set(key, value);
    } catch (const ConfigError& error) {
      return error.what();
    }
    return "taken";
  };
  EXPECT_EQ(refusal("a.force_N", "1e308"), "taken");
  EXPECT_EQ(refusal("a.force_N", "1e999"),
            "set: 'a.force_N' cannot be 1e999: Error while parsing floating-point: '1e999' could not be "
            "interpreted as a value: a number is at most 1.8e308, without its sign");
  EXPECT_EQ(refusal("a.force_N", "[1, -1e999]").substr(0, 41), "set: 'a.force_N' cannot be [1, -1e999]: E");
  EXPECT_EQ(refusal("a.count", "99999999999999999999"),
            "set: 'a.count' cannot be 99999999999999999999: Error while parsing decimal integer: "
            "'99999999999999999999' is not representable in 64 bits");
  EXPECT_EQ(refusal("a.name", "ten"), "set: 'a.name' cannot be ten: text needs quotation marks");
  EXPECT_EQ(refusal("a", "{b = 1}"), "set: 'a' cannot be {b = 1}: it is a table; set its keys one by one");
  EXPECT_EQ(refusal("a", "1\nb = 2"), "set: the value of 'a' has more than one line");
  EXPECT_EQ(refusal("a", " "), "set: 'a' has no value");
  for (const char* key : {"", "a..b", ".a", "a.", "\"a\"", "a b", "a = 1 #"})
    EXPECT_EQ(refusal(key, "1"), "set: '" + std::string(key) + "' is not the name of a key");
}

TEST_F(TomlReader, ANumberThatIsTooLargeIsRefusedWithTheLargest) {
  EXPECT_EQ(problems("\na = [1,\n1e999]"),
            Lines{":3: Error while parsing floating-point: '1e999' could not be interpreted as a value: a "
                  "number is at most 1.8e308, without its sign"});
}

TEST_F(TomlReader, TheNestingOfValuesIsBounded) {
  const auto nested = [](std::size_t arrays) {
    return "a = " + std::string(arrays, '[') + std::string(arrays, ']') + "\n";
  };
  const auto ignore = [](TomlTable root) { root.ignore("a"); };
  EXPECT_EQ(problems(nested(256), ignore), Lines{});
  for (const std::size_t arrays : {std::size_t{257}, std::size_t{1'000'000}}) {
    const Lines found = problems(nested(arrays), ignore);
    ASSERT_EQ(found.size(), 1U);
    EXPECT_NE(found.front().find("exceeded maximum nested value depth of 256"), std::string::npos)
        << found.front();
  }
}

TEST_F(TomlReader, ArraysOfTablesAndTextsAreBounded) {
  const auto list = [](std::size_t size) {
    std::string tables;
    std::string texts = "texts = [";
    for (std::size_t i = 0; i < size; ++i) {
      texts += "'x', ";
      tables += "[[table]]\n";
    }
    return texts + "]\n" + tables;
  };
  std::size_t tables = 0;
  std::vector<std::string> texts;
  const auto ask = [&](TomlTable root) {
    root.texts("texts", texts, {.most = 5});
    tables = root.tables("table", {.most = 5}).size();
  };
  EXPECT_EQ(problems(list(5), ask), Lines{});
  EXPECT_EQ(tables, 5U);
  EXPECT_EQ(texts.size(), 5U);
  EXPECT_EQ(problems(list(6), ask), (Lines{":1: 'texts' has 6 elements, allowed are 5",
                                           ":2: 'table' has 6 elements, allowed are 5"}));
  const auto ask_by_default = [&](TomlTable root) {
    root.texts("texts", texts);
    tables = root.tables("table").size();
  };
  EXPECT_EQ(problems(list(1000), ask_by_default), Lines{});
  EXPECT_EQ(problems(list(1001), ask_by_default).size(), 2U);
}

TEST_F(TomlReader, TheFirstHundredProblemsAreListedAndTheRestIsCounted) {
  const auto unknown = [](int keys) {
    std::string text;
    for (int i = 0; i < keys; ++i) text += "key_" + std::to_string(i) + " = 1\n";
    return text;
  };
  const auto ask_nothing = [](const TomlTable& /*root*/) {};
  EXPECT_EQ(problems(unknown(100), ask_nothing).size(), 100U);
  const Lines found = problems(unknown(103), ask_nothing);
  ASSERT_EQ(found.size(), 101U);
  EXPECT_EQ(found.back(), ": and 3 more problems");
}

TEST_F(TomlReader, AFileIsUpToFourMebibytesLong) {
  constexpr std::size_t kMax = 4 << 20;
  EXPECT_EQ(problems(std::string(kMax, '\n')), Lines{});
  EXPECT_EQ(problems(std::string(kMax + 1, '\n')),
            Lines{": has more than the 4194304 bytes that are expected"});
}

}  // namespace toml_reader_test
