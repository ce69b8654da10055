#include "tests/gap/edit_test.h"

#include <algorithm>
#include <map>
#include <string_view>
#include <utility>

#include "model/effects/any_effect.h"

namespace gap_test {
namespace {

/// Ratio to the noise floor up to which a gap counts as noise: the meaning of "explained".
constexpr double kAtTheFloor = 1.2;

Drive without(const Drive& drive, std::string_view effect) {
  Drive edited = drive;
  for (std::size_t kind = 0; kind < kLibraryKinds; ++kind)
    if (name_of(static_cast<Hidden>(kind)) == effect) edited.effects.amount(static_cast<Hidden>(kind)) = 0;
  return edited;
}

/// The delivered model holds the given one's effects first.
model::effects::DriveModel without(const model::effects::DriveModel& delivered, std::string_view effect,
                                   const std::vector<model::effects::AnyEffect>& given) {
  model::effects::DriveModel edited = delivered;
  auto own = std::ranges::count(given, effect, model::effects::name_of);
  std::erase_if(edited.effects, [&](const model::effects::AnyEffect& candidate) {
    return model::effects::name_of(candidate) == effect && own-- <= 0;
  });
  return edited;
}

/// By effect and parameter; the first of several of one type.
using Estimates = std::map<std::pair<std::string, std::string>, identification::fit::Estimate>;
Estimates estimates_of(const identification::gap::Result& result) {
  Estimates estimates;
  for (const auto& [effect, estimate] : result.refitted)
    estimates.try_emplace({effect, estimate.name}, estimate);
  for (const identification::gap::FoundEffect& found : result.effects)
    for (const identification::fit::Estimate& estimate : found.parameters)
      estimates.try_emplace({std::string(model::effects::name_of(found.effect)), estimate.name}, estimate);
  return estimates;
}

/// Whether all that both have an interval of has a value that is in both.
bool agree(const identification::gap::Result& delivered, const identification::gap::Result& edited) {
  const Estimates before = estimates_of(delivered);
  bool any = false;
  for (const auto& [parameter, after] : estimates_of(edited)) {
    const auto known = before.find(parameter);
    if (known == before.end() || !known->second.ok() || !after.ok()) continue;
    if (after.upper < known->second.lower || after.lower > known->second.upper) return false;
    any = true;
  }
  return any;
}

}  // namespace

bool Edit::at_the_floor() const { return gap_Nm <= kAtTheFloor * never_Nm; }
bool Edit::passed() const {
  return at_the_floor() || (refitted_Nm <= kAtTheFloor * never_Nm && parameters_agree);
}

std::vector<Edit> edit_tests(const Case& gap_case, const identification::gap::Result& result) {
  std::vector<Edit> edits;
  for (const identification::gap::FoundEffect& found : result.effects) {
    const std::string_view effect = model::effects::name_of(found.effect);
    if (std::ranges::find(edits, effect, &Edit::effect) != edits.end()) continue;
    const auto planned = [&](std::vector<Run> runs) {
      for (Run& run : runs) run.breakaway_Nm = breakaway_Nm(gap_case.drive);
      return runs;
    };
    const Drive drive = without(gap_case.drive, effect);
    const identification::gap::Result edited = identification::gap::analyse(
        without(result.model, effect, gap_case.base.effects), recordings_of(drive, planned(gap_case.runs)),
        recordings_of(drive, planned(gap_case.held_out_runs), "held-out-"));
    edits.push_back({std::string(effect), edited.gap_before_Nm, edited.noise_floor_Nm, edited.gap_base_Nm,
                     agree(result, edited)});
  }
  return edits;
}

}  // namespace gap_test
