// The thesis' figures made again: the compared numbers, and the command `youbot-bench thesis`.
#include "apps/youbot_bench/thesis/thesis.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <string>
#include <vector>

#include "apps/youbot_bench/thesis/not_made.h"
#include "apps/youbot_bench/thesis/page.h"
#include "tests/support/built_paths.h"
#include "tests/support/run_command.h"
#include "tests/support/temporary_directory.h"

namespace youbot_bench::thesis {
namespace thesis_test {

namespace fs = std::filesystem;

std::map<std::string, double> numbers_of(const std::vector<Figure>& figures) {
  std::map<std::string, double> numbers;
  for (const Figure& figure : figures)
    for (const Comparison& comparison : figure.compared)
      numbers[std::string(comparison.printed->key)] = comparison.ours;
  return numbers;
}

void expect_agreement(const std::vector<Figure>& figures) {
  for (const Figure& figure : figures)
    for (const Comparison& comparison : figure.compared) {
      SCOPED_TRACE(std::string(comparison.printed->key));
      EXPECT_TRUE(comparison.agrees() || !comparison.must_agree())
          << comparison.ours << " instead of " << comparison.printed->from;
      // What differs has a reason.
      if (!comparison.must_agree() && !comparison.printed->setting) {
        EXPECT_FALSE(comparison.why.empty());
      }
    }
}

bool has(const std::string& text, const std::string& part) { return text.find(part) != std::string::npos; }

TEST(ThesisFigures, ADifferenceCountsFromTheNearestEndOfThePrintedRange) {
  const Printed range{"k", "", "", "", 4, 5, 10};
  EXPECT_EQ((Comparison{&range, 4.5}.difference_percent()), 0);
  EXPECT_NEAR((Comparison{&range, 3.8}.difference_percent()), -5, 1e-12);
  EXPECT_NEAR((Comparison{&range, 6}.difference_percent()), 20, 1e-12);
  EXPECT_TRUE((Comparison{&range, 3.8}.agrees()));
  EXPECT_FALSE((Comparison{&range, 6}.agrees()));
  EXPECT_FALSE((Comparison{&range, std::nan("")}.agrees()));
  const Printed negative{"k", "", "", "", -0.2, -0.2};
  EXPECT_NEAR((Comparison{&negative, -0.1}.difference_percent()), 50, 1e-12);
  EXPECT_FALSE((Comparison{&negative, -0.2}.must_agree()));
}

TEST(ThesisFigures, EachPrintedNumberHasOneName) {
  std::set<std::string_view> keys;
  for (const Printed& number : kPrinted) {
    EXPECT_TRUE(keys.insert(number.key).second) << number.key;
    EXPECT_LE(number.from, number.to) << number.key;
    EXPECT_FALSE(number.where.empty()) << number.key;
  }
  EXPECT_THROW(printed("table 6/first"), std::logic_error);
}

// The oracle is print: table 5 has 377, 251, 283 and 156 N·m/rad, section 2.5.2 0.127 N·m·s/rad and 0.03 N·m.
TEST(ThesisFigures, BelowBreakAwayTheNumbersAreThoseOfTheThesis) {
  const support::TemporaryDirectory directory;
  const std::vector<Figure> figures =
      make_figures({.out = directory / "out",
                    .chapters = {"specifications", "theory", "presliding", "mapping"},
                    .quiet = true});
  expect_agreement(figures);
  std::map<std::string, double> ours = numbers_of(figures);
  EXPECT_NEAR(ours["table 5/first, command"], 377, 0.5);
  EXPECT_NEAR(ours["table 5/first, real"], 251, 0.5);
  EXPECT_NEAR(ours["table 5/second, command"], 283, 0.5);
  EXPECT_NEAR(ours["table 5/second, real"], 156, 0.5);
  EXPECT_NEAR(ours["ramp/damping"], 0.127, 0.0005);
  EXPECT_NEAR(ours["ramp/offset"], 0.03, 0.001);
  EXPECT_GT(ours["creep"], 0) << "the minima of figure 24 rise";

  const std::string html = page_of(figures, true).html();
  for (const char* const section : {"Table 1",       "Table 2",           "Figure 3",
                                    "Figure 4",      "Figures 6 and 8",   "Figure 7",
                                    "Figure 9",      "Figure 10",         "Figure 11",
                                    "Figure 12",     "Figure 13",         "Figure 18",
                                    "Table 5",       "Figure 19",         "Figure 20",
                                    "Figure 23",     "Figure 24",         "Section 3.4.2",
                                    "Section 3.4.3", "Figures 36 and 37", "What is not made, and why"})
    EXPECT_TRUE(has(html, std::string(section))) << section;
  for (const NotMade& each : kNotMade) EXPECT_TRUE(has(html, std::string(each.caption))) << each.number;
  EXPECT_FALSE(has(html, "DOES NOT AGREE"));
  EXPECT_TRUE(fs::exists(directory / "out/figure-18/report.html"));
}

TEST(ThesisFigures, WithCompensationWheelAndBaseMoveAsInPrint) {
  const support::TemporaryDirectory directory;
  const std::vector<Figure> figures =
      make_figures({.out = directory / "out", .chapters = {"compensation"}, .quiet = true});
  expect_agreement(figures);
  std::map<std::string, double> ours = numbers_of(figures);
  EXPECT_GT(ours["swing/highest"], 4);
  EXPECT_LT(ours["base/without"], 10);
  EXPECT_GT(ours["base/with"], 1000);
}

class ThesisCommand : public ::testing::Test {
 protected:
  support::CommandResult run(const std::string& arguments) const {
    return support::run_command(support::program("youbot-bench") + " thesis " + arguments);
  }

  support::TemporaryDirectory temporary_;
  const fs::path out_ = temporary_ / "out";
};

TEST_F(ThesisCommand, WritesAPageAndTheNumbers) {
  const support::CommandResult result = run("--chapters specifications,mapping --out " + out_.string());
  ASSERT_EQ(result.exit_code, 0) << result.output;
  EXPECT_TRUE(result.said("printed numbers beside ours")) << result.output;
  EXPECT_TRUE(fs::exists(out_ / "report.html"));
  const nlohmann::json json = nlohmann::json::parse(std::ifstream(out_ / "thesis.json"));
  EXPECT_EQ(json["format"], "youbot-thesis/1");
  EXPECT_EQ(json["numbers"].size(), json["compared"]);
  EXPECT_EQ(json["must_agree"], json["agree"]);
  const auto speed = std::ranges::find_if(
      json["numbers"], [](const nlohmann::json& number) { return number["key"] == "youbot/arm speed"; });
  ASSERT_NE(speed, json["numbers"].end());
  EXPECT_EQ((*speed)["printed_in"], "Table 2");
  EXPECT_EQ((*speed)["printed_from"], 90);
  EXPECT_NEAR((*speed)["ours"], 90, 0.1);
  EXPECT_EQ((*speed)["agrees"], true);
  // What is there is never written over.
  EXPECT_EQ(run("--quiet --chapters theory --out " + out_.string()).exit_code, 2);
}

TEST_F(ThesisCommand, IsSilentWhenQuietAndRefusesWrongUse) {
  const support::CommandResult quiet = run("--quiet --chapters theory --out " + out_.string());
  EXPECT_EQ(quiet.exit_code, 0);
  EXPECT_EQ(quiet.output, "");
  EXPECT_EQ(run("").exit_code, 2);
  EXPECT_EQ(run("--chapters cooking --out " + (temporary_ / "b").string()).exit_code, 2);
  EXPECT_EQ(run("--out " + (temporary_ / "a,b").string()).exit_code, 2);
  EXPECT_FALSE(fs::exists(temporary_ / "b"));
  temporary_.write("file", "");
  EXPECT_EQ(run("--out " + (temporary_ / "file/below").string()).exit_code, 3);
}

TEST_F(ThesisCommand, EndsSoonWhenItIsAskedTo) {
  const support::CommandResult result =
      support::run_command(support::program("youbot-bench") + " thesis --chapters steady-state --out " +
                           out_.string() + " & made=$!; until test -e " + (out_ / "figure-14").string() +
                           " || ! kill -0 $made; do sleep 0.05; done; kill -INT $made; wait $made");
  EXPECT_EQ(result.exit_code, 130) << result.output;
  EXPECT_TRUE(result.said("stopped on request, nothing to compare")) << result.output;
  EXPECT_FALSE(fs::exists(out_ / "report.html"));
}

}  // namespace thesis_test
}  // namespace youbot_bench::thesis
