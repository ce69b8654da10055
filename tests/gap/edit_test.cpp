#include "tests/gap/edit_test.h"

#include <algorithm>
#include <string_view>

#include "model/effects/any_effect.h"

namespace gap_test {
namespace {

/// Of the noise floor that a gap may have and still be noise: what "explained" stands for.
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

}  // namespace

bool Edit::passed() const { return gap_Nm <= kAtTheFloor * never_Nm; }

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
    edits.push_back({std::string(effect), edited.gap_before_Nm, edited.noise_floor_Nm});
  }
  return edits;
}

}  // namespace gap_test
