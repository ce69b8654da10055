#include "operation/tunable.h"

#include <array>
#include <stdexcept>

namespace operation {
namespace {

using Settings = control::Teleoperation::Config;

struct Tunable {
  std::string_view key;
  void (*copy)(const Settings& from, Settings& to) noexcept;
};
constexpr auto kTunable = std::to_array<Tunable>(
    {{"teleoperation.coupling.stiff_N_per_m",
      [](const Settings& from, Settings& to) noexcept {
        to.stiff.translation_N_per_m = from.stiff.translation_N_per_m;
      }},
     {"teleoperation.coupling.stiff_Nm_per_rad",
      [](const Settings& from, Settings& to) noexcept {
        to.stiff.rotation_Nm_per_rad = from.stiff.rotation_Nm_per_rad;
      }},
     {"teleoperation.feedback.contact_share",
      [](const Settings& from, Settings& to) noexcept {
        to.feedback.contact_share = from.feedback.contact_share;
      }},
     {"teleoperation.feedback.enabled",
      [](const Settings& from, Settings& to) noexcept { to.force_feedback = from.force_feedback; }},
     {"teleoperation.feedback.force_scale",
      [](const Settings& from, Settings& to) noexcept {
        to.feedback.force_scale = from.feedback.force_scale;
      }},
     {"teleoperation.mapping.motion_scale",
      [](const Settings& from, Settings& to) noexcept {
        to.mapping.motion_scale = from.mapping.motion_scale;
      }},
     {"teleoperation.mapping.rate_m_per_s", [](const Settings& from, Settings& to) noexcept {
        to.mapping.rate_speed_m_per_s = from.mapping.rate_speed_m_per_s;
      }}});

constexpr auto kKeys = [] {
  std::array<std::string_view, kTunable.size()> keys;
  for (std::size_t i = 0; i < keys.size(); ++i) keys[i] = kTunable[i].key;
  return keys;
}();

}  // namespace

std::span<const std::string_view> tunable_keys() noexcept { return kKeys; }

void copy_tunable(std::string_view key, const Config& from, Config& to) noexcept {
  for (const Tunable& one : kTunable)
    if (one.key == key) one.copy(from.teleoperation, to.teleoperation);
}

void require_consistent(const Config& config) {
  const Settings& settings = config.teleoperation;
  if (settings.stiff.translation_N_per_m < settings.soft.translation_N_per_m)
    throw std::invalid_argument("teleoperation.coupling.stiff_N_per_m is below soft_N_per_m of this run");
  if (settings.stiff.rotation_Nm_per_rad < settings.soft.rotation_Nm_per_rad)
    throw std::invalid_argument(
        "teleoperation.coupling.stiff_Nm_per_rad is below soft_Nm_per_rad of this run");
  if (settings.feedback.contact_share > 0 && !settings.tank.active)
    throw std::invalid_argument(
        "teleoperation.feedback.contact_share needs 'passivity', which is off in this run: the observed "
        "force "
        "comes late");
}

}  // namespace operation
