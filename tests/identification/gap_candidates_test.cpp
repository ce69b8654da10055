/// Every shape that the search tries represents the model that it would become.
#include "identification/gap/candidates.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "tests/support/built_paths.h"

namespace identification::gap {
namespace gap_candidates_test {

constexpr double kRate_Hz = 1000;

/// A motion with several frequencies, with reversals and fast enough for everything.
Source motion(bool commanded_only) {
  Source source{.name = "multisine.csv", .recording = {}};
  std::vector<double> time, torque, position;
  for (int i = 0; i < 12000; ++i) {
    const double t = i / kRate_Hz;
    time.push_back(t);
    position.push_back(2 * std::sin(2.1 * t) + 0.6 * std::sin(7.7 * t) + 0.02 * std::sin(40 * t));
    torque.push_back(0.05 * std::sin(2.1 * t) + 0.04 * std::sin(9 * t));
  }
  source.recording.columns = {{"time_s", time},
                              {commanded_only ? "torque_command_Nm" : "torque_measured_Nm", torque},
                              {"position_rad", position}};
  return source;
}

double between(const Bounds& bounds, double wish) { return std::clamp(wish, bounds.lower, bounds.upper); }

/// Columns times amplitudes are what the model predicts more with the effect than without it.
void expect_columns_are_the_effects(const FittedModel& fitted, const Rows& rows,
                                    std::set<std::string_view>& seen) {
  const Dictionary dictionary = make_dictionary(fitted, rows);
  const Eigen::VectorXd without = predicted_rows(fitted, rows);
  for (const Candidate& candidate : dictionary.candidates) {
    seen.insert(candidate.effect);
    // The only amplitude that bends what it scales, beside a load: taken where the column was made.
    const bool by_share = candidate.effect == "backlash" || candidate.effect == "elasticity";
    Eigen::VectorXd amplitudes(static_cast<Eigen::Index>(candidate.columns.size()));
    Eigen::VectorXd said = Eigen::VectorXd::Zero(rows.count());
    for (std::size_t k = 0; k < candidate.columns.size(); ++k) {
      const auto at = static_cast<Eigen::Index>(k);
      const Bounds& bounds = candidate.bounds[k];
      // Small against Coulomb friction, so that no level is cut at zero; in the middle where there is one.
      amplitudes[at] = by_share                                          ? 0.3
                       : std::isfinite(bounds.upper) && bounds.lower > 0 ? 0.5 * (bounds.lower + bounds.upper)
                                                                         : between(bounds, 2e-4);
      said += amplitudes[at] * dictionary.columns.col(candidate.columns[k]);
    }
    EXPECT_GT(said.norm(), 0) << candidate.effect;
    const Eigen::VectorXd done = predicted_rows(candidate.add(fitted, amplitudes), rows) - without;
    EXPECT_LE((done - said).norm(), 0.02 * said.norm() + 1e-9) << candidate.effect;
  }
}

TEST(Candidates, TheirColumnsAreWhatTheEffectsDo) {
  FittedModel fitted{.model = {.name = "bench", .inertia_kg_m2 = 0.01}, .given_inertia_kg_m2 = 0.01};
  std::set<std::string_view> seen;
  for (const bool commanded_only : {false, true}) {
    const Source source = motion(commanded_only);
    fitted.model.effects = {model::effects::make_effect("coulomb", {{"torque_Nm", 0.05}}),
                            model::effects::make_effect("viscous", {{"coefficient_Nm_s_per_rad", 0.01}})};
    const Band band = choose_band({source}, fitted.model);
    const std::vector<Signals> signals = {make_signals(source, band)};
    const Rows rows(signals);
    ASSERT_GT(rows.count(), 200);
    expect_columns_are_the_effects(fitted, rows, seen);
    // Some only make sense once another is there.
    fitted.model.effects.push_back(model::effects::make_effect("imbalance", {{"torque_Nm", 0.02}}));
    expect_columns_are_the_effects(fitted, rows, seen);
  }
  for (const char* effect :
       {"quadratic_drag", "stribeck", "midspeed_dip", "torque_offset", "direction_asymmetry", "thermal_drift",
        "imbalance", "spring", "load_friction", "inertia", "presliding", "backlash", "elasticity",
        "torque_deadband", "transport_delay"})
    EXPECT_TRUE(seen.contains(effect)) << effect;
}

/// Of effects: a row for each, its name and the cell beside it.
std::map<std::string, std::string> searched_by_the_readme() {
  std::map<std::string, std::string> table;
  std::ifstream file(support::source_dir() + "/apps/youbot_gap/README.md");
  bool here = false;
  for (std::string line; std::getline(file, line);) {
    if (line.starts_with("#")) here = line == "### Effects that the search looks for";
    if (!here || !line.starts_with("| `")) continue;
    const std::size_t end = line.find('`', 3);
    const std::size_t cell = line.find("| ", end) + 2;
    table[line.substr(3, end - 3)] = line.substr(cell, line.find(" |", cell) - cell);
  }
  return table;
}

TEST(Candidates, TheReadmeSaysWhichEffectsAreSearched) {
  // A ripple is found by its spectrum; others before the search, from command and measured torque.
  std::set<std::string_view> searched{"cogging",       "unsigned_current", "torque_saturation",
                                      "actuator_gain", "actuator_offset",  "torque_sensor_offset"};
  FittedModel fitted{.model = {.name = "bench", .inertia_kg_m2 = 0.01}, .given_inertia_kg_m2 = 0.01};
  for (const bool commanded_only : {false, true}) {
    const Source source = motion(commanded_only);
    const std::vector<Signals> signals = {make_signals(source, choose_band({source}, fitted.model))};
    const Rows rows(signals);
    for (const char* known : {"", "coulomb", "imbalance"}) {
      fitted.model.effects.clear();
      if (*known != 0) fitted.model.effects.push_back(model::effects::make_effect(known));
      for (const Candidate& candidate : make_dictionary(fitted, rows).candidates)
        searched.insert(candidate.effect);
    }
  }
  const std::map<std::string, std::string> table = searched_by_the_readme();
  for (const auto& effect : model::effects::effect_descriptions()) {
    const auto row = table.find(std::string(effect.name));
    ASSERT_NE(row, table.end()) << effect.name;
    EXPECT_EQ(row->second, searched.contains(effect.name) ? "yes" : "no") << effect.name;
  }
  EXPECT_EQ(table.size(), model::effects::effect_descriptions().size());
}

// Torque and motion reverse together by construction: nothing that gives could show.
TEST(Candidates, NothingThatGivesIsTriedOnATorqueWithTheSignOfTheMotion) {
  FittedModel fitted{.model = {.name = "bench", .inertia_kg_m2 = 0.01}, .given_inertia_kg_m2 = 0.01};
  fitted.model.effects = {model::effects::make_effect("coulomb", {{"torque_Nm", 0.05}})};
  Source source = motion(false);
  for (const bool by_motion : {false, true}) {
    source.signed_by_motion = by_motion;
    const std::vector<Signals> signals = {make_signals(source, choose_band({source}, fitted.model))};
    const Rows rows(signals);
    const Dictionary dictionary = make_dictionary(fitted, rows);
    for (const char* effect : {"presliding", "backlash", "elasticity"})
      EXPECT_EQ(
          std::ranges::find(dictionary.candidates, effect, &Candidate::effect) == dictionary.candidates.end(),
          by_motion)
          << effect;
    EXPECT_NE(std::ranges::find(dictionary.candidates, "inertia", &Candidate::effect),
              dictionary.candidates.end());
  }
}

// A friction curve that bends down is another cause: no medium drags the joint along.
TEST(Candidates, ADragIsNeverNegative) {
  FittedModel fitted{.model = {.name = "bench", .inertia_kg_m2 = 0.01}, .given_inertia_kg_m2 = 0.01};
  const Source source = motion(false);
  const std::vector<Signals> signals = {make_signals(source, choose_band({source}, fitted.model))};
  const Rows rows(signals);
  const Dictionary dictionary = make_dictionary(fitted, rows);
  const auto drag = std::ranges::find(dictionary.candidates, "quadratic_drag", &Candidate::effect);
  ASSERT_NE(drag, dictionary.candidates.end());
  EXPECT_EQ(drag->bounds.front().lower, 0);
  const auto lower_of = [&](double coefficient) {
    fitted.model.effects = {
        model::effects::make_effect("quadratic_drag", {{"coefficient_Nm_s2_per_rad2", coefficient}})};
    const std::vector<FreeParameter> free = free_parameters(fitted, rows);
    const auto own = std::ranges::find(free, "coefficient_Nm_s2_per_rad2", &FreeParameter::name);
    return own == free.end() ? 1 : own->lower;
  };
  EXPECT_EQ(lower_of(1e-4), 0);
  EXPECT_LT(lower_of(-1e-4), -1);  // of a given curve
}

}  // namespace gap_candidates_test
}  // namespace identification::gap
