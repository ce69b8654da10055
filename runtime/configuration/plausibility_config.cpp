#include "runtime/configuration/plausibility_config.h"

#include <algorithm>
#include <cstddef>

#include "runtime/log.h"

namespace runtime {
namespace {

constexpr std::string_view kKey = "off";
constexpr std::string_view kHall =
    control::kPlausibilityCheckNames[static_cast<std::size_t>(control::PlausibilityCheck::kHallAgreement)];

std::vector<std::string> names_of(const control::ChecksOff& off) {
  std::vector<std::string> names;
  for (std::size_t i = 0; i < control::kPlausibilityCheckNames.size(); ++i)
    if (off.has(static_cast<control::PlausibilityCheck>(i)))
      names.emplace_back(control::kPlausibilityCheckNames[i]);
  return names;
}

}  // namespace

void read_plausibility(TomlTable table, control::ChecksOff& off) {
  const auto& known = control::kPlausibilityCheckNames;
  std::vector<std::string> names;
  table.texts(kKey, names);
  for (const std::string& name : names) {
    const auto* const check = std::find(known.begin(), known.end(), name);
    if (check == known.end())
      table.refuse(kKey,
                   fmt::format("has no check '{}' to switch off, but {}", name, fmt::join(known, ", ")));
    else
      off.add(static_cast<control::PlausibilityCheck>(check - known.begin()));
  }
}

std::string plausibility_text(const control::ChecksOff& off) {
  std::vector<std::string> names = names_of(off);
  for (std::string& name : names) name = toml_string(name);
  return fmt::format("[plausibility]\noff = [{}]\n", fmt::join(names, ", "));
}

void warn_of(const control::ChecksOff& off) {
  for (const std::string& name : names_of(off))
    spdlog::warn("plausibility.off: the check '{}' is off: a sensor that lies may go unseen (docs/safety.md)",
                 name);
}

std::vector<std::string> notes_on_silent(const control::ChecksOff& silent) {
  std::vector<std::string> notes;
  for (const std::string& name : names_of(silent))
    if (name == kHall)
      notes.push_back(fmt::format(
          "for some seconds a motor controller's mailbox gave no reading of its Hall sensors, by which "
          "the check '{}' judges its encoder: stop, and look at `youbot-bench diagnose` (docs/safety.md)",
          name));
    else
      notes.push_back(
          fmt::format("for a second or more too few samples came in time for the check '{}'; give this "
                      "machine less to do (docs/safety.md)",
                      name));
  return notes;
}

}  // namespace runtime
