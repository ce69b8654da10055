#include "apps/youbotd/status_json.h"

#include <array>

#include "hal/seconds.h"

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

json json_of(const drivers::station::LinkReport& link) {
  return {{"connected", link.connected},
          {"age_s", hal::seconds(link.age)},
          {"round_trip_s", hal::seconds(link.round_trip)},
          {"least_round_trip_s", hal::seconds(link.shortest_round_trip)},
          {"clock_offset_s", hal::seconds(link.clock_offset)},
          {"lost", link.lost_permille / 1000.0},
          {"lost_there", link.lost_there_permille / 1000.0},
          {"repeated", link.repeated},
          {"sessions", link.sessions},
          {"newest", link.newest},
          {"recovered", link.recovered},
          {"late", link.late},
          {"refused", link.refused}};
}

}  // namespace youbotd
