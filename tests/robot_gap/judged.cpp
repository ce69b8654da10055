#include "tests/robot_gap/judged.h"

#include <algorithm>

namespace robot_gap_test {

using identification::robot_gap::FoundPart;
using identification::robot_gap::NamedEffect;

bool same(const NamedEffect& a, const NamedEffect& b) { return a.effect == b.effect && a.part == b.part; }

void judge_names(Judged& judged, const std::vector<NamedEffect>& truth) {
  const std::vector<FoundPart>& named = judged.result.effects;
  const auto is_named = [&](const NamedEffect& one) {
    return std::any_of(named.begin(), named.end(), [&](const FoundPart& f) { return same(f.name, one); });
  };
  const auto covers = [](const FoundPart& found, const NamedEffect& name) {
    return same(found.name, name) || std::any_of(found.equivalent.begin(), found.equivalent.end(),
                                                 [&](const NamedEffect& rival) { return same(rival, name); });
  };
  const bool as_many = named.size() == truth.size();
  judged.right = as_many && std::all_of(truth.begin(), truth.end(), is_named);
  judged.among_rivals =
      as_many && std::all_of(truth.begin(), truth.end(), [&](const NamedEffect& one) {
        return std::any_of(named.begin(), named.end(), [&](const FoundPart& f) { return covers(f, one); });
      });
  judged.wrong_name = std::any_of(named.begin(), named.end(), [&](const FoundPart& f) {
    return std::none_of(truth.begin(), truth.end(), [&](const NamedEffect& one) { return covers(f, one); });
  });
}

void judge_parameter(Judged& judged, const FoundPart& found, double value) {
  const auto& estimate = found.parameters.front();
  ++judged.parameters;
  judged.parameters_inside += estimate.lower <= value && value <= estimate.upper ? 1 : 0;
}

}  // namespace robot_gap_test
