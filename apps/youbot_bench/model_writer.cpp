#include "apps/youbot_bench/model_writer.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <span>
#include <stdexcept>
#include <string_view>
#include <system_error>

#include "apps/common/toml_reader.h"
#include "apps/common/whole_file.h"

namespace youbot_bench {
namespace {

using sim::identify::Estimate;

struct Entry {
  std::string_view parameter;
  std::string_view effect;
  std::string_view key;
  std::string_view remark;
};
/// In the order of the file; entries of one effect together.
constexpr auto kEntries = std::to_array<Entry>({
    {"coulomb_Nm", "coulomb", "torque_Nm", ""},
    {"viscous_Nm_s_per_rad", "viscous", "coefficient_Nm_s_per_rad", ""},
    {"static_Nm", "stribeck", "static_torque_Nm", ""},
    {"stribeck_velocity_rad_per_s", "stribeck", "velocity_rad_per_s", ""},
    {"stribeck_exponent", "stribeck", "exponent", ""},
    {"torque_offset_Nm", "torque_offset", "torque_Nm",
     "or Coulomb friction that differs by direction: the same in sliding"},
    {"viscous_asymmetry_Nm_s_per_rad", "direction_asymmetry", "viscous_Nm_s_per_rad", "half the difference"},
    {"quadratic_Nm_s2_per_rad2", "quadratic_drag", "coefficient_Nm_s2_per_rad2", ""},
    {"stiffness_Nm_per_rad", "presliding", "stiffness_Nm_per_rad", ""},
    {"damping_Nm_s_per_rad", "presliding", "damping_Nm_s_per_rad", ""},
});

/// Seven digits, always a TOML float.
std::string number(double value) {
  std::array<char, 40> text{};
  const auto end =
      std::to_chars(text.data(), text.data() + text.size(), value, std::chars_format::general, 7).ptr;
  std::string result(text.data(), end);
  if (result.find_first_of(".e") == result.npos) result += ".0";
  return result;
}

/// A comment of one line, whatever `text` holds.
std::string comment(std::string_view text) {
  std::string result = "# ";
  for (const char c : text)
    if (static_cast<unsigned char>(c) >= 0x20 && c != 0x7f) result += c;
  return result + "\n";
}

const Estimate* find(std::span<const Estimate> estimates, std::string_view name) {
  const auto found =
      std::find_if(estimates.begin(), estimates.end(), [&](const Estimate& e) { return e.name == name; });
  return found == estimates.end() ? nullptr : &*found;
}

/// An effect when all of its parameters are there, else the reason as a comment. An exponent that was given
/// counts with the others.
std::string effect_text(std::string_view effect, std::span<const Estimate> estimates) {
  std::string lines;
  std::string reasons;
  bool fitted = false;
  for (const Entry& entry : kEntries) {
    if (entry.effect != effect) continue;
    const Estimate* const estimate = find(estimates, entry.parameter);
    if (estimate == nullptr) continue;
    if (!estimate->ok() && !is_given(*estimate)) {
      reasons += comment("not identifiable: " + estimate->name + ": " + estimate->not_identifiable);
      continue;
    }
    lines += std::string(entry.key) + " = " + number(estimate->value);
    if (estimate->ok())
      lines += "  # 95 %: " + number(estimate->lower) + " to " + number(estimate->upper);
    else
      lines += "  # given";
    if (!entry.remark.empty()) lines += "; " + std::string(entry.remark);
    lines += "\n";
    fitted |= estimate->ok();
  }
  if (!reasons.empty()) return "\n" + reasons;
  if (!fitted) return "";
  return "\n[[effect]]\ntype = \"" + std::string(effect) + "\"\n" + lines;
}

}  // namespace

bool is_given(const Estimate& estimate) { return estimate.not_identifiable.starts_with("given"); }

std::string model_text(const IdentifiedModel& model) {
  std::string text;
  for (const std::string& line : model.evidence) text += comment(line);
  text += "format = \"youbot-drive-model/1\"\nname = " + apps::toml_string(model.name) + "\n";
  if (model.inertia_kg_m2) text += "inertia_kg_m2 = " + number(*model.inertia_kg_m2) + "\n";

  std::vector<Estimate> estimates = model.sliding ? model.sliding->parameters : model.moving;
  for (const Estimate& estimate : model.presliding)
    if (find(estimates, estimate.name) == nullptr) estimates.push_back(estimate);
  std::string_view last;
  for (const Entry& entry : kEntries) {
    if (entry.effect == last) continue;
    last = entry.effect;
    text += effect_text(entry.effect, estimates);
  }
  return text;
}

void write_model(const IdentifiedModel& model, const std::filesystem::path& directory) {
  std::error_code error;
  std::filesystem::create_directories(directory, error);
  if (error)
    throw std::runtime_error(directory.string() + ": cannot make this directory: " + error.message());
  apps::write_whole_file(directory / "model.toml", model_text(model));
}

}  // namespace youbot_bench
