#include "tests/gap/gap_judge.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <exception>
#include <sstream>
#include <string_view>

namespace gap_test {
namespace {

constexpr std::size_t kLargestSet = 2;

bool stands_for(const identification::gap::FoundEffect& found, std::string_view truth) {
  if (model::effects::name_of(found.effect) == truth) return true;
  const auto& rivals = found.equivalent;
  return 1 + rivals.size() <= kLargestSet && std::find(rivals.begin(), rivals.end(), truth) != rivals.end();
}

/// Alone or among two: the truth within a larger set says nothing.
bool is_decided(const identification::gap::FoundEffect& found) {
  return 1 + found.equivalent.size() <= kLargestSet;
}

void add_once(std::vector<std::string>& names, std::string_view name) {
  if (std::find(names.begin(), names.end(), name) == names.end()) names.emplace_back(name);
}

void check_parameters(const Case& gap_case, const identification::gap::Result& result, Judgement& judgement) {
  for (const TrueParameter& truth : gap_case.parameters) {
    // A second ripple of the same type is another harmonic: the nearest one is meant.
    const identification::fit::Estimate* nearest = nullptr;
    for (const identification::gap::FoundEffect& found : result.effects) {
      if (model::effects::name_of(found.effect) != truth.effect) continue;
      for (const identification::fit::Estimate& estimate : found.parameters) {
        if (estimate.name != truth.parameter || !estimate.ok()) continue;
        if (nearest == nullptr ||
            std::abs(estimate.value - truth.value) < std::abs(nearest->value - truth.value))
          nearest = &estimate;
      }
    }
    if (nearest == nullptr) continue;
    ++judgement.parameters;
    if (nearest->lower - truth.resolution <= truth.value &&
        truth.value <= nearest->upper + truth.resolution) {
      ++judgement.parameters_inside;
      continue;
    }
    std::ostringstream words;
    words << truth.effect << ' ' << truth.parameter << " is " << truth.value << ", not " << nearest->value
          << " [" << nearest->lower << ", " << nearest->upper << ']';
    judgement.parameters_outside.push_back(words.str());
  }
}

/// Whatever else is missing. Not if the hidden effect affects them: a drift is cold or warm, other friction
/// curves end at another level, and a sticking brush is friction.
void check_base_parameters(const Case& gap_case, const identification::gap::Result& result,
                           Judgement& judgement) {
  const Plant& plant = gap_case.drive.plant;
  const auto hides = [&](Hidden hidden) {
    return std::ranges::find(gap_case.spec.hidden, hidden) != gap_case.spec.hidden.end();
  };
  const bool friction_is_known = !hides(Hidden::kThermalDrift) && !hides(Hidden::kStribeck) &&
                                 !hides(Hidden::kMidspeedDip) && !hides(Hidden::kStickingBrush);
  for (const auto& [effect, estimate] : result.refitted) {
    if (!estimate.ok()) continue;
    double truth = 0;
    if (effect.empty() && estimate.name == "inertia_kg_m2" && !hides(Hidden::kInertia))
      truth = plant.inertia_kg_m2;
    else if (effect == "coulomb" && friction_is_known)
      truth = plant.coulomb_Nm;
    else if (effect == "viscous" && friction_is_known)
      truth = plant.viscous_Nm_s_per_rad;
    else
      continue;
    ++judgement.base_parameters;
    if (estimate.lower <= truth && truth <= estimate.upper) {
      ++judgement.base_parameters_inside;
      continue;
    }
    std::ostringstream words;
    words << "its " << effect << ' ' << estimate.name << " is " << truth << ", not " << estimate.value << " ["
          << estimate.lower << ", " << estimate.upper << ']';
    judgement.parameters_outside.push_back(words.str());
  }
}

}  // namespace

Judgement judge(const Case& gap_case, bool edit) {
  Judgement judgement;
  judgement.spec = gap_case.spec;
  judgement.least_size = gap_case.least_size();
  judgement.true_floor_Nm = gap_case.drive.sensors.noise_floor_Nm();
  std::vector<std::string> truths;  // causes outside the library have no name to be missed
  if (gap_case.spec.kind != CaseKind::kOutside)
    for (const Hidden hidden : gap_case.spec.hidden) truths.emplace_back(name_of(hidden));

  identification::gap::Result result;
  const auto start = std::chrono::steady_clock::now();
  try {
    result = identification::gap::analyse(gap_case.base, gap_case.data, gap_case.held_out);
  } catch (const std::exception& error) {
    judgement.failure = error.what();
  }
  judgement.search_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();

  judgement.verdict = result.verdict;
  judgement.floor_Nm = result.noise_floor_Nm;
  judgement.gap_before_Nm = result.gap_before_Nm;
  judgement.gap_after_Nm = result.gap_after_Nm;
  for (const identification::gap::FoundEffect& found : result.effects) {
    bool right = false;
    for (const std::string& truth : truths) {
      if (!is_decided(found) || !stands_for(found, truth)) continue;
      add_once(judgement.named, truth);
      right = true;
    }
    if (right) continue;
    add_once(judgement.named, model::effects::name_of(found.effect));
    add_once(judgement.extra, model::effects::name_of(found.effect));
  }
  for (const std::string& truth : truths) {
    if (std::find(judgement.named.begin(), judgement.named.end(), truth) == judgement.named.end())
      judgement.missed.push_back(truth);
  }
  if (edit && result.verdict == identification::gap::Verdict::kExplained)
    judgement.edits = edit_tests(gap_case, result);
  check_parameters(gap_case, result, judgement);
  check_base_parameters(gap_case, result, judgement);
  return judgement;
}

}  // namespace gap_test
