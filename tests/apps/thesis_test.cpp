// The thesis' figures made again: the compared numbers, and the command `youbot-bench thesis`.
#include "apps/youbot_bench/thesis/thesis.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <regex>
#include <set>
#include <string>
#include <vector>

#include "apps/youbot_bench/thesis/not_made.h"
#include "apps/youbot_bench/thesis/page.h"
#include "operation/teleop_measures.h"
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
      const Printed& printed = *comparison.printed;
      SCOPED_TRACE(std::string(printed.key));
      EXPECT_TRUE(comparison.agrees() || !printed.limited())
          << comparison.ours << " instead of " << expected_text(printed);
      // What differs or holds by construction has a reason.
      if (printed.kind == kMayDiffer || printed.kind == kByConstruction) {
        EXPECT_FALSE(comparison.why.empty());
      }
    }
}

/// "figure 36" and "figure 37" of "Figures 36 and 37".
void add_parts(std::set<std::string>& parts, std::string title) {
  std::ranges::transform(title, title.begin(), [](unsigned char c) { return std::tolower(c); });
  const std::regex part("(figure|table|section|appendix)s? ([0-9a-z.]+)(?: and ([0-9]+))?");
  for (auto at = std::sregex_iterator(title.begin(), title.end(), part); at != std::sregex_iterator(); ++at)
    for (const std::size_t number : {2U, 3U})
      if ((*at)[number].matched) parts.insert((*at)[1].str() + " " + (*at)[number].str());
}

/// Written down from the thesis, and not from the program: all its figures and tables but those of the costs,
/// and the sections and the appendix whose numbers or words are compared.
std::set<std::string> parts_of_the_thesis() {
  std::set<std::string> parts{"section 2.7.2", "section 3.2.3.1", "section 3.2.3.2", "section 3.4.2",
                              "section 3.4.3", "section 3.4.4",   "section 3.4.5",   "appendix a"};
  for (int number = 1; number <= 38; ++number) parts.insert("figure " + std::to_string(number));
  for (int number = 1; number <= 5; ++number) parts.insert("table " + std::to_string(number));
  return parts;
}

/// The numbers of the thesis that an experiment, a fit or a formula of ours could miss.
const std::set<std::string> kMustBeMet{"youbot/base speed",
                                       "steady state/whole",
                                       "figure 15/dip 1",
                                       "figure 15/dip 2",
                                       "figure 15/dip 3",
                                       "figure 15/dip 1, backward",
                                       "figure 15/dip 2, backward",
                                       "figure 15/dip 3, backward",
                                       "figure 15/fastest",
                                       "table 4/Fc, method",
                                       "table 4/Fs, method",
                                       "table 4/vs, method",
                                       "table 4/exponent, method",
                                       "table 4/viscous, method",
                                       "ramp/stiffness",
                                       "dahl/stiffness"};

bool has(const std::string& text, const std::string& part) { return text.find(part) != std::string::npos; }

TEST(ThesisFigures, ADifferenceCountsFromTheNearestEndOfThePrintedRange) {
  const Printed range{"k", "", "", "", 4, 5, kMustAgree, 10};
  EXPECT_EQ((Comparison{&range, 4.5}.difference_percent()), 0);
  EXPECT_NEAR((Comparison{&range, 3.8}.difference_percent()), -5, 1e-12);
  EXPECT_NEAR((Comparison{&range, 6}.difference_percent()), 20, 1e-12);
  EXPECT_TRUE((Comparison{&range, 3.8}.agrees()));
  EXPECT_FALSE((Comparison{&range, 6}.agrees()));
  EXPECT_FALSE((Comparison{&range, std::nan("")}.agrees()));
  const Printed negative{"k", "", "", "", -0.2, -0.2};
  EXPECT_NEAR((Comparison{&negative, -0.1}.difference_percent()), 50, 1e-12);
  EXPECT_FALSE(negative.limited());
}

TEST(ThesisFigures, EachPrintedNumberHasOneName) {
  std::set<std::string_view> keys;
  for (const Printed& number : kNumbers) {
    EXPECT_TRUE(keys.insert(number.key).second) << number.key;
    EXPECT_LE(number.from, number.to) << number.key;
    EXPECT_FALSE(number.place.empty()) << number.key;
  }
  EXPECT_THROW(printed("table 6/first"), std::logic_error);
}

// The same source (3.2.3.4) is a limit of operation/, which the report of each teleoperation compares.
TEST(ThesisFigures, TheLimitsOfAHumanInOperationAreThePrintedOnes) {
  namespace human = operation::human;
  EXPECT_DOUBLE_EQ(1e-2 * human::kHardStiffness_N_per_m, printed("human/stiffness").from);
  EXPECT_EQ(human::kWeakestForce_N, printed("human/force").from);
  EXPECT_EQ(human::kStrongestForce_N, printed("human/force").to);
  EXPECT_EQ(human::kForceResolution_N, printed("human/resolution").to);
}

TEST(ThesisFigures, KindsAndCriteriaAreCountedApart) {
  const Printed agreement{"a", "", "", "", 1, 1, kMustAgree, 1};
  const Printed setting{"s", "", "", "", 2, 2, kSetting};
  const Printed constructed{"c", "", "", "", 3, 3, kByConstruction};
  const Printed free{"f", "", "", "", 4, 4};
  const Printed criterion{"o", "", "", "", 0, 5, kMustAgree, 0, kCriterion};
  Figure figure{.number = "Figure 0", .caption = "", .compared = {}};
  figure.compared = {{&agreement, 1}, {&setting, 2}, {&constructed, 3}, {&free, 9}, {&criterion, 5}};
  const Tally print = tally({&figure, 1}, kThesis);
  EXPECT_EQ(print.compared, 4U);
  EXPECT_EQ(print.must_agree, 1U);
  EXPECT_EQ(print.agree, 1U);
  EXPECT_EQ(print.settings, 1U);
  EXPECT_EQ(print.by_construction, 1U);
  EXPECT_EQ(print.may_differ, 1U);
  EXPECT_EQ(print.outside, 0U);
  EXPECT_EQ(tally({&figure, 1}, kCriterion).compared, 1U);
  const nlohmann::json json = json_of({&figure, 1});
  EXPECT_EQ(json["thesis"]["must_agree"], 1);
  EXPECT_EQ(json["criterion"]["must_agree"], 1);
  EXPECT_EQ(json["numbers"][1]["kind"], "setting");
  EXPECT_EQ(json["numbers"][1]["origin"], "thesis");
  EXPECT_EQ(json["numbers"][4]["origin"], "criterion");
  EXPECT_EQ(json["numbers"][4]["expected_to"], 5);
  EXPECT_TRUE(json["numbers"][3]["agrees"].is_null());
}

TEST(ThesisFigures, ANumberBeyondItsLimitIsAnExitCode) {
  const Printed agreement{"a", "", "", "", 1, 1, kMustAgree, 1};
  const Printed setting{"s", "", "", "", 2, 2, kSetting};
  const Printed free{"f", "", "", "", 4, 4};
  Figure figure{.number = "Figure 0", .caption = "", .compared = {}};
  figure.compared = {{&agreement, 1.005}, {&setting, 2}, {&free, 9}};
  EXPECT_EQ(exit_code({&figure, 1}), 0);
  figure.compared[0].ours = 1.02;
  EXPECT_EQ(exit_code({&figure, 1}), 1);
  EXPECT_TRUE(has(page_of({&figure, 1}, true).html(), "DOES NOT AGREE"));
  figure.compared[0].ours = 1;
  figure.compared[1].ours = 2.1;  // a setting that is not what the thesis prints
  EXPECT_EQ(exit_code({&figure, 1}), 1);
}

// The oracle is print: the limits in printed_numbers.h, and table 5's 377, 251, 283 and 156 N·m/rad.
TEST(ThesisFigures, AllChaptersAgreeWithPrint) {
  const support::TemporaryDirectory directory;
  const std::vector<Figure> figures = make_figures({.out = directory / "out", .quiet = true});
  expect_agreement(figures);
  EXPECT_EQ(exit_code(figures), 0);

  std::map<std::string, double> ours = numbers_of(figures);
  EXPECT_EQ(ours.size(), kNumbers.size()) << "each number of the table is compared, and once";
  EXPECT_NEAR(ours["table 5/first, command"], 377, 0.5);
  EXPECT_NEAR(ours["table 5/first, real"], 251, 0.5);
  EXPECT_NEAR(ours["table 5/second, command"], 283, 0.5);
  EXPECT_NEAR(ours["table 5/second, real"], 156, 0.5);

  std::set<std::string> parts;
  std::set<std::string> met;
  for (const Figure& figure : figures) {
    add_parts(parts, figure.number);
    for (const Comparison& comparison : figure.compared)
      if (comparison.printed->origin == kThesis && comparison.printed->kind == kMustAgree)
        met.emplace(comparison.printed->key);
  }
  for (const NotMade& each : kNotMade) add_parts(parts, std::string(each.number));
  EXPECT_EQ(parts, parts_of_the_thesis());
  EXPECT_EQ(met, kMustBeMet);

  const Tally print = tally(figures, kThesis);
  EXPECT_EQ(print.compared, 114U);
  EXPECT_EQ(print.must_agree, kMustBeMet.size());
  EXPECT_EQ(print.settings, 70U);
  EXPECT_EQ(print.by_construction, 6U);
  EXPECT_EQ(print.may_differ, 22U);
  const Tally criteria = tally(figures, kCriterion);
  EXPECT_EQ(criteria.must_agree, 15U);
  EXPECT_EQ(criteria.by_construction, 2U);

  EXPECT_EQ(figures.size(), 33U);
  const std::string html = page_of(figures, false).html();
  for (const Figure& figure : figures) EXPECT_TRUE(has(html, figure.number + ": ")) << figure.number;
  EXPECT_TRUE(has(html, "What is not made, and why"));
  for (const NotMade& each : kNotMade) EXPECT_TRUE(has(html, std::string(each.caption))) << each.number;
  EXPECT_FALSE(has(html, "DOES NOT AGREE"));
  EXPECT_TRUE(fs::exists(directory / "out/figure-18/report.html"));
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
  EXPECT_EQ(json["numbers"].size(),
            json["thesis"]["compared"].get<std::size_t>() + json["criterion"]["compared"].get<std::size_t>());
  EXPECT_EQ(json["thesis"]["must_agree"], json["thesis"]["agree"]);
  const auto speed = std::ranges::find_if(
      json["numbers"], [](const nlohmann::json& number) { return number["key"] == "youbot/arm speed"; });
  ASSERT_NE(speed, json["numbers"].end());
  EXPECT_EQ((*speed)["place"], "Table 2");
  EXPECT_EQ((*speed)["expected_from"], 90);
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
  const fs::path below = out_ / "below";
  const support::CommandResult result =
      support::run_command(support::program("youbot-bench") + " thesis --chapters steady-state --out " +
                           below.string() + " & made=$!; until test -e " + (below / "figure-14").string() +
                           " || ! kill -0 $made; do sleep 0.05; done; kill -INT $made; wait $made");
  EXPECT_EQ(result.exit_code, 130) << result.output;
  EXPECT_TRUE(result.said("stopped on request, nothing to compare")) << result.output;
  EXPECT_FALSE(fs::exists(out_)) << "nothing is left, so that the command can run again";
}

}  // namespace thesis_test
}  // namespace youbot_bench::thesis
