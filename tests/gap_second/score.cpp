#include "tests/gap_second/score.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstdio>
#include <numbers>

namespace gap_second {
namespace {

template <typename... Values>
std::string format(const char* pattern, Values... values) {
  char text[200];
  std::snprintf(text, sizeof text, pattern, values...);
  return text;
}

bool has(const std::vector<std::string>& names, const std::string& wanted) {
  return std::find(names.begin(), names.end(), wanted) != names.end();
}

bool names_cause(const std::string& bad_data, std::string text) {
  std::transform(text.begin(), text.end(), text.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  for (const BadData& kind : kinds_of_bad_data())
    if (kind.name == bad_data)
      return std::any_of(kind.words.begin(), kind.words.end(),
                         [&](const std::string& word) { return text.find(word) != std::string::npos; });
  return false;
}

/// Parameters of the base model that were wrong and are put right without an effect beside them.
bool refitted_right(const std::string& effect, const Case& drawn, const Answer& answer) {
  if (effect == "inertia") {
    const double truth = drawn.subject.truth.inertia_kg_m2;
    return std::abs(answer.inertia_kg_m2 - truth) < 0.15 * truth;
  }
  return has(answer.model_effects, effect);
}

/// Signs that no document defines do not count; a parameter that may have either is known by its size.
void judge_intervals(const Case& drawn, const Answer& answer, Score& score) {
  for (const auto& [parameter, interval] : answer.intervals) {
    const auto known = drawn.subject.parameters.find(parameter);
    if (known == drawn.subject.parameters.end()) continue;
    const bool right = interval.first <= known->second && known->second <= interval.second;
    ++score.intervals;
    score.intervals_right += right ? 1 : 0;
    if (!right)
      score.wrong_intervals.push_back(
          parameter + format(" %.4g not in %.4g..%.4g", known->second, interval.first, interval.second));
  }
}

Outcome judge_names(const Case& drawn, const Answer& answer, bool& by_rival) {
  std::vector<std::string> found;
  int wrong = 0;
  for (const NamedEffect& effect : answer.effects) {
    std::vector<std::string> names = effect.equivalent;
    names.insert(names.begin(), effect.type);
    const auto true_name = std::find_if(names.begin(), names.end(), [&](const std::string& name) {
      return has(drawn.hidden, name) && !has(found, name);  // a second one of the same is one too many
    });
    if (true_name != names.end()) {
      found.push_back(*true_name);
      by_rival = by_rival || true_name != names.begin();
    } else if (drawn.also_fine.count(effect.type) == 0) {
      ++wrong;
    }
  }
  for (const std::string& effect : drawn.hidden)
    if (!has(found, effect) && refitted_right(effect, drawn, answer)) found.push_back(effect);
  const bool something_hidden = !drawn.hidden.empty() || !drawn.unknown_cause.empty();
  const bool satisfied = answer.verdict == "no gap" || answer.verdict == "explained";
  if (!something_hidden && wrong > 0) return Outcome::kFalseAlarm;
  // What is wrong with the data may leave something over, but then it has to be said what it is.
  const bool tolerated = !answer.effects.empty() && wrong == 0;
  if (!something_hidden)
    return satisfied || tolerated || names_cause(drawn.bad_data, answer.diagnosis) ? Outcome::kRight
                                                                                   : Outcome::kAbstained;
  const bool all =
      !drawn.hidden.empty() && std::all_of(drawn.hidden.begin(), drawn.hidden.end(),
                                           [&](const auto& effect) { return has(found, effect); });
  if (all && wrong == 0) return Outcome::kRight;
  if (!found.empty()) return Outcome::kHalfRight;
  if (wrong > 0) return Outcome::kWrongName;
  if (satisfied) return Outcome::kMissed;
  return drawn.unknown_cause.empty() ? Outcome::kAbstained : Outcome::kRight;
}

}  // namespace

const char* name(Outcome outcome) {
  switch (outcome) {
    case Outcome::kRight: return "right";
    case Outcome::kHalfRight: return "half right";
    case Outcome::kWrongName: return "wrong name";
    case Outcome::kFalseAlarm: return "false alarm";
    case Outcome::kAbstained: return "abstained";
    case Outcome::kMissed: return "missed";
    case Outcome::kRefusedCause: return "refused, cause named";
    case Outcome::kRefusedOther: return "refused otherwise";
    case Outcome::kFailed: break;
  }
  return "failed";
}

Score judge(const Case& drawn, const Answer& answer) {
  Score score;
  if (answer.exit_code == 2 || answer.exit_code == 3) {
    score.outcome =
        names_cause(drawn.bad_data, answer.error) ? Outcome::kRefusedCause : Outcome::kRefusedOther;
    return score;
  }
  if (answer.exit_code != 0) return score;
  score.outcome = judge_names(drawn, answer, score.by_rival);
  score.diagnosed = names_cause(drawn.bad_data, answer.diagnosis);
  const bool worse_simulation =
      answer.simulation && answer.simulation->second > 1.02 * answer.simulation->first;
  score.worse = answer.gap_after_Nm > 1.001 * answer.gap_before_Nm || worse_simulation;
  score.undetermined =
      static_cast<int>(std::count_if(answer.effects.begin(), answer.effects.end(),
                                     [](const NamedEffect& effect) { return !effect.determined; }));
  judge_intervals(drawn, answer, score);
  return score;
}

std::string report_line(const Case& drawn, const Answer& answer, const Score& score) {
  const Rig& rig = drawn.subject.rig;
  std::string line = drawn.id + " " + rig.name + format(" %.0f Hz", rig.rate_Hz);
  line += drawn.command_column ? "" : ", no command";
  line += drawn.measured_column ? "" : ", not measured";
  line += " | hidden:";
  for (const std::string& effect : drawn.hidden) line += " " + effect;
  if (drawn.kind != "pairs" && !has(drawn.hidden, drawn.kind)) line += " [" + drawn.kind + "]";
  line += " | answered: ";
  if (answer.exit_code != 0) {
    line += format("exit code %d ", answer.exit_code) + answer.error;
  } else {
    line += answer.verdict + ":";
    for (const NamedEffect& effect : answer.effects) {
      line += " " + effect.type;
      for (const std::string& rival : effect.equivalent) line += "/" + rival;
      line += effect.determined ? "" : " (undetermined)";
    }
    line +=
        format(" | gap %.3g -> %.3g, floor %.3g", answer.gap_before_Nm, answer.gap_after_Nm, answer.floor_Nm);
    if (answer.simulation)
      line += format(", simulation %.3g -> %.3g", answer.simulation->first, answer.simulation->second);
  }
  line += std::string(" | ") + name(score.outcome) + (score.by_rival ? " by a rival" : "") +
          (score.worse ? ", WORSE" : "") + (score.diagnosed ? ", diagnosed" : "");
  if (score.intervals > 0) line += format(" | intervals %d of %d", score.intervals_right, score.intervals);
  for (const std::string& wrong : score.wrong_intervals) line += "; " + wrong;
  for (const Edit& edit : score.edits)
    line += " | without " + edit.effect + format(" %.3g, floor %.3g", edit.gap_Nm, edit.floor_Nm) +
            (edit.passed() ? "" : ", EDIT FAILED");
  return line + format(" | %.1f s", answer.seconds);
}

void Tally::add(const Answer& answer, const Score& score) {
  ++outcomes[static_cast<std::size_t>(score.outcome)];
  ++cases;
  by_rival += score.by_rival ? 1 : 0;
  diagnosed += score.diagnosed ? 1 : 0;
  undetermined += score.undetermined;
  worse += score.worse ? 1 : 0;
  intervals += score.intervals;
  intervals_right += score.intervals_right;
  edited += score.edits.empty() ? 0 : 1;
  edits_passed += !score.edits.empty() && std::all_of(score.edits.begin(), score.edits.end(),
                                                      [](const Edit& edit) { return edit.passed(); });
  seconds += answer.seconds;
  longest_s = std::max(longest_s, answer.seconds);
}

std::string table_head(std::size_t name_width) {
  return std::string(name_width, ' ') +
         " cases right  half wrong alarm abst. misse ref+c ref-o faile |rival worse undet diagn  intervals  "
         "edit test   "
         "mean "
         "s  max "
         "s\n";
}

std::string table_row(const std::string& row_name, const Tally& tally, std::size_t name_width) {
  std::string row = row_name;
  row.resize(name_width, ' ');
  row += format(" %5d", tally.cases);
  for (int count : tally.outcomes) row += count == 0 ? std::string("     .") : format(" %5d", count);
  row += format(" |%5d %5d %5d %5d %4d of %3d %4d of %2d %8.1f %6.1f\n", tally.by_rival, tally.worse,
                tally.undetermined, tally.diagnosed, tally.intervals_right, tally.intervals,
                tally.edits_passed, tally.edited, tally.seconds / std::max(1, tally.cases), tally.longest_s);
  return row;
}

}  // namespace gap_second
