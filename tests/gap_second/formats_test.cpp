// The program accepts the output of this generator, and the scorer distinguishes right from wrong.
#include <gtest/gtest.h>

#include <random>
#include <string>
#include <vector>

#include "tests/gap_second/answer.h"
#include "tests/gap_second/cases.h"
#include "tests/gap_second/score.h"
#include "tests/support/built_paths.h"
#include "tests/support/temporary_directory.h"

namespace gap_second {
namespace {

class SecondGenerator : public testing::Test {
 protected:
  std::string directory() const { return directory_.path(); }
  Answer asked(const Case& drawn) const {
    return ask(support::program_dir() + "/youbot-gap", write_case(drawn, directory()), directory(), 60);
  }

 private:
  support::TemporaryDirectory directory_;
};

/// A short one: six seconds of each recording.
Case short_case(char case_class, int number) {
  Case drawn = draw_case(case_class, number, 1);
  drawn.subject.seconds = 6;
  return drawn;
}

TEST_F(SecondGenerator, WritesFilesThatTheProgramAccepts) {
  const Case drawn = short_case('a', 0);
  const Answer answer = asked(drawn);
  EXPECT_EQ(answer.exit_code, 0) << answer.error;
  EXPECT_FALSE(answer.verdict.empty());
  EXPECT_NEAR(answer.inertia_kg_m2, drawn.subject.truth.inertia_kg_m2,
              0.5 * drawn.subject.truth.inertia_kg_m2);
}

TEST_F(SecondGenerator, ReadsARefusal) {
  Case drawn = short_case('a', 1);
  drawn.base.inertia_kg_m2 = -1;
  const Answer answer = asked(drawn);
  EXPECT_EQ(answer.exit_code, 2);
  EXPECT_NE(answer.error.find("base.toml"), std::string::npos) << answer.error;
}

TEST(SecondCases, DrawsTheSameCaseFromTheSameSeed) {
  const Case one = draw_case('c', 5, 7);
  const Case again = draw_case('c', 5, 7);
  EXPECT_EQ(one.hidden, again.hidden);
  EXPECT_EQ(one.seed, again.seed);
  EXPECT_NE(one.seed, draw_case('c', 5, 8).seed);
  EXPECT_EQ(one.hidden.size(), 2U);
}

TEST(SecondCases, SpoilsARecordingAsItSays) {
  std::mt19937_64 random(1);
  for (const BadData& kind : kinds_of_bad_data()) {
    const Case drawn = short_case('a', 2);
    const Recording good = record(drawn.subject.truth, drawn.subject.rig, Motion::kMultisine, 5, 1);
    Recording bad = good;
    spoil(kind.name, bad, random);
    bool differs =
        bad.header != good.header || bad.columns.size() != good.columns.size() || bad.rows() != good.rows();
    for (const Column& column : good.columns)
      differs = differs || !bad.has(column.name) || bad.at(column.name) != column.values;
    EXPECT_TRUE(differs) << kind.name;
  }
}

TEST(SecondCases, AHeldSensorRepeatsThreeRowsInFour) {
  std::mt19937_64 random(1);
  Recording recording;
  recording.columns = {{"position_rad", {}}, {"torque_measured_Nm", {}}};
  for (int i = 0; i < 1000; ++i)
    for (Column& column : recording.columns) column.values.push_back(i);
  spoil("held sensor", recording, random);
  const std::vector<double>& position = recording.at("position_rad");
  int repeated = 0;
  for (std::size_t i = 1; i < position.size(); ++i) repeated += position[i] == position[i - 1] ? 1 : 0;
  EXPECT_NEAR(repeated / 1000.0, 0.77, 0.01);
}

Answer named(const std::vector<NamedEffect>& effects, const std::string& verdict) {
  Answer answer;
  answer.exit_code = 0;
  answer.verdict = verdict;
  answer.effects = effects;
  return answer;
}

TEST(SecondScore, KnowsRightFromWrong) {
  Case two;
  two.hidden = {"stribeck", "cogging"};
  EXPECT_EQ(judge(two, named({{"cogging", {}}, {"stribeck", {}}}, "explained")).outcome, Outcome::kRight);
  EXPECT_EQ(judge(two, named({{"cogging", {}}, {"viscous", {"stribeck"}}}, "explained")).outcome,
            Outcome::kRight);
  EXPECT_EQ(judge(two, named({{"cogging", {}}}, "partly explained")).outcome, Outcome::kHalfRight);
  EXPECT_EQ(judge(two, named({{"cogging", {}}, {"stribeck", {}}, {"cogging", {}}}, "explained")).outcome,
            Outcome::kHalfRight);
  EXPECT_EQ(judge(two, named({{"viscous", {}}}, "explained")).outcome, Outcome::kWrongName);
  EXPECT_EQ(judge(two, named({}, "unexplained")).outcome, Outcome::kAbstained);
  EXPECT_EQ(judge(two, named({}, "no gap")).outcome, Outcome::kMissed);
  EXPECT_EQ(judge(Case{}, named({}, "no gap")).outcome, Outcome::kRight);
  EXPECT_EQ(judge(Case{}, named({}, "unexplained")).outcome, Outcome::kAbstained);
  EXPECT_EQ(judge(Case{}, named({{"viscous", {}}}, "explained")).outcome, Outcome::kFalseAlarm);
  Case poor;
  poor.also_fine = {"coulomb"};
  EXPECT_EQ(judge(poor, named({{"coulomb", {}}}, "partly explained")).outcome, Outcome::kRight);
  EXPECT_EQ(judge(poor, named({{"coulomb", {}}, {"elasticity", {}}}, "explained")).outcome,
            Outcome::kFalseAlarm);
  Case unknown;
  unknown.unknown_cause = "hum";
  EXPECT_EQ(judge(unknown, named({}, "unexplained")).outcome, Outcome::kRight);
  EXPECT_EQ(judge(unknown, named({}, "no gap")).outcome, Outcome::kMissed);
}

TEST(SecondScore, SaysWhenTheDeliveredModelIsWorse) {
  Answer answer = named({}, "no gap");
  answer.gap_before_Nm = 0.944;
  answer.gap_after_Nm = 0.986;
  EXPECT_TRUE(judge(Case{}, answer).worse);
  answer.gap_after_Nm = 0.9;
  EXPECT_FALSE(judge(Case{}, answer).worse);
  answer.simulation = {1.0, 1.5};
  EXPECT_TRUE(judge(Case{}, answer).worse);
}

TEST(SecondScore, HoldsIntervalsAgainstTheTruth) {
  Case drawn;
  drawn.subject.parameters = {{"backlash.gap_rad", 0.03}, {"inertia_kg_m2", 0.01}};
  Answer answer = named({}, "explained");
  answer.intervals = {
      {"backlash.gap_rad", {0.01, 0.02}}, {"inertia_kg_m2", {0.009, 0.011}}, {"other", {0, 1}}};
  const Score score = judge(drawn, answer);
  EXPECT_EQ(score.intervals, 2);
  EXPECT_EQ(score.intervals_right, 1);
}

TEST(SecondEditTest, TakesOneTypeOutOfAModelFileButWhatWasGiven) {
  const std::string head = "format = \"youbot-drive-model/1\"\n";
  const std::string coulomb = "[[effect]]\ntype = \"coulomb\"\ntorque_Nm = 0.05\n";
  const std::string cogging = "[[effect]]\ntype = \"cogging\"\namplitude_Nm = 0.01\n";
  EXPECT_EQ(without_effect(head + coulomb + cogging + cogging, "cogging"), head + coulomb);
  EXPECT_EQ(without_effect(head + cogging + coulomb + cogging, "cogging", 1), head + cogging + coulomb);
  EXPECT_EQ(without_effect(head + coulomb, "cogging"), head + coulomb);
}

// Every hidden effect can be removed: the result is the drive that never had it.
TEST(SecondEditTest, TheDriveLosesWhatWasHiddenInIt) {
  for (const std::string& effect : known_effects()) {
    if (effect == "viscous") continue;  // every drive has it
    std::mt19937_64 random(7);
    Subject never = draw_subject(random);
    Subject edited = never;
    hide_effect(effect, edited, random);
    never.rig = edited.rig;
    never.seconds = edited.seconds;
    if (effect == "load_friction") {  // what weighs on the joint stays
      never.truth.imbalance_Nm = edited.truth.imbalance_Nm;
      never.truth.rest_position_rad = edited.truth.rest_position_rad;
    }
    const auto recorded = [](const Subject& subject) {
      return record(subject.truth, subject.rig, Motion::kSlowReversals, 2, 3).at("position_rad");
    };
    EXPECT_TRUE(effect == "unsigned_current" || recorded(edited) != recorded(never)) << effect;
    take_away(effect, edited);
    EXPECT_FALSE(edited.unsigned_current);
    EXPECT_EQ(recorded(edited), recorded(never)) << effect;
  }
}

}  // namespace
}  // namespace gap_second
