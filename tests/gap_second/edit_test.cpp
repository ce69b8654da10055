#include "tests/gap_second/edit_test.h"

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <limits>
#include <set>

namespace gap_second {

namespace {

/// Whether all that both have an interval of has a value that is in both.
bool agree(const Answer& delivered, const Answer& edited) {
  bool any = false;
  for (const auto& [parameter, after] : edited.intervals) {
    const auto known = delivered.intervals.find(parameter);
    if (known == delivered.intervals.end()) continue;
    if (after.second < known->second.first || after.first > known->second.second) return false;
    any = true;
  }
  return any;
}

}  // namespace

std::string without_effect(const std::string& model, const std::string& effect, int given) {
  const std::string head = "[[effect]]";
  std::string kept;
  for (std::size_t begin = 0; begin < model.size();) {
    const std::size_t end = std::min(model.find(head, begin + 1), model.size());
    const std::string block = model.substr(begin, end - begin);
    const bool meant =
        block.starts_with(head) && block.find("type = \"" + effect + "\"") != std::string::npos;
    if (!meant || given-- > 0) kept += block;
    begin = end;
  }
  return kept;
}

std::vector<Edit> edit_tests(const std::string& program, const Case& drawn, const Answer& answer,
                             const std::string& directory, int longest_s) {
  std::vector<Edit> edits;
  if (answer.verdict != "explained") return edits;
  std::ifstream file(directory + "/gap/model.toml", std::ios::binary);
  const std::string delivered{std::istreambuf_iterator<char>(file), {}};
  std::set<std::string> done;
  for (const NamedEffect& named : answer.effects) {
    if (!done.insert(named.type).second) continue;
    const std::string place = directory + "/without-" + named.type;
    std::filesystem::create_directories(place);
    Case edited = drawn;
    take_away(named.type, edited.subject);
    CaseFiles files = write_case(edited, place);
    const auto given = std::count_if(drawn.base.effects.begin(), drawn.base.effects.end(),
                                     [&](const ModelEffect& effect) { return effect.type == named.type; });
    std::ofstream(files.base) << without_effect(delivered, named.type, static_cast<int>(given));
    const Answer again = ask(program, files, place, longest_s);
    edits.push_back({named.type,
                     again.exit_code == 0 ? again.gap_before_Nm : std::numeric_limits<double>::quiet_NaN(),
                     again.floor_Nm, again.gap_refitted_Nm, agree(answer, again)});
  }
  return edits;
}

}  // namespace gap_second
