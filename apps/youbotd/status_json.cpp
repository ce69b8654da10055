#include "apps/youbotd/status_json.h"

#include <array>

namespace youbotd {

using nlohmann::json;

json json_of(const std::optional<hal::BusLosses>& losses) {
  if (!losses) return nullptr;
  constexpr std::array<const char*, 3> kLevels{"ok", "warning", "fault"};
  return {{"level", kLevels[static_cast<std::size_t>(losses->level)]},
          {"bridged_of_1000_cycles", losses->cycles},
          {"lost", losses->lost},
          {"incomplete", losses->incomplete},
          {"late", losses->late},
          {"twice", losses->twice},
          {"damaged", losses->damaged}};
}

json json_of(const std::vector<hal::BusDevice>& devices) {
  json list = json::array();
  for (const hal::BusDevice& device : devices)
    list.push_back({{"name", device.name}, {"answers", device.answers}, {"works", device.works}});
  return list;
}

}  // namespace youbotd
