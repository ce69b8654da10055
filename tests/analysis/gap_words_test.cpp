// The terminal output of youbot-gap.
#include <gtest/gtest.h>

#include <limits>
#include <string>

#include "analysis/findings.h"
#include "analysis/gap_report.h"
#include "analysis/summary.h"

namespace gap_words_test {

using identification::gap::FoundEffect;

/// A Stribeck curve with a tail, which is a choice and not fitted, and an exponent that is hardly known.
analysis::Findings stribeck_with_tail() {
  FoundEffect found{
      .effect = model::effects::make_effect(
          "stribeck",
          {{"static_torque_Nm", 0.2}, {"velocity_rad_per_s", 0.5}, {"exponent", 1.5}, {"tail", 1}}),
      .where = {}};
  found.parameters = {{.name = "static_torque_Nm", .value = 0.2, .lower = 0.19, .upper = 0.21},
                      {.name = "velocity_rad_per_s", .value = 0.5, .lower = 0.4, .upper = 0.6},
                      {.name = "exponent", .value = 1.5, .lower = -2, .upper = 5}};
  analysis::Findings findings{.base = {}, .base_path = {}, .drive = "axis", .data = {}, .result = {}};
  findings.result.effects = {found};
  return findings;
}

TEST(GapWords, NameEveryParameterWithinWhatItMayBe) {
  const analysis::Findings findings = stribeck_with_tail();
  const std::string text = analysis::summary_text(findings);
  EXPECT_NE(text.find("exponent 1.5 (0.3 to 4), tail 1 (not fitted)"), std::string::npos) << text;
  const std::string page = analysis::gap_report(findings).html();
  EXPECT_NE(page.find("<td>tail</td>"), std::string::npos);
}

TEST(GapWords, ShowThatAnIntervalIsNarrow) {
  analysis::Findings findings = stribeck_with_tail();
  findings.result.effects[0].effect = model::effects::make_effect("inertia", {{"difference_kg_m2", -200}});
  findings.result.effects[0].parameters = {
      {.name = "difference_kg_m2", .value = -200, .lower = -200.004, .upper = -199.996}};
  const std::string text = analysis::summary_text(findings);
  EXPECT_NE(text.find("difference -200 kg·m² (-200.004 to -199.996)"), std::string::npos) << text;
  const std::string page = analysis::gap_report(findings).html();
  EXPECT_NE(page.find("-200.004"), std::string::npos);
}

TEST(GapWords, CountTheHarmonicsOfARippleAndTellThemApart) {
  analysis::Findings findings = stribeck_with_tail();
  findings.result.verdict = identification::gap::Verdict::kExplained;
  for (const double periods : {7.0, 28.0})
    findings.result.effects.push_back(
        {.effect = model::effects::make_effect(
             "cogging", {{"amplitude_Nm", 0.01}, {"periods_per_rev", periods}, {"phase_rad", 0}}),
         .where = {}});
  EXPECT_NE(analysis::headline(findings).find("stribeck and 2 harmonics of cogging were missing"),
            std::string::npos)
      << analysis::headline(findings);
  const std::string page = analysis::gap_report(findings).html();
  for (const char* step : {"without cogging 7 times a turn", "without cogging 28 times a turn"})
    EXPECT_NE(page.find(step), std::string::npos) << step;
}

}  // namespace gap_words_test
