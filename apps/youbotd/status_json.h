/// @file
/// Parts of a status that come from the robot itself.
#pragma once
#include <nlohmann/json.hpp>
#include <optional>
#include <vector>

#include "drivers/station/traffic.h"
#include "hal/robot.h"

namespace youbotd {

nlohmann::json json_of(const std::optional<hal::BusLosses>& losses);
nlohmann::json json_of(const std::vector<hal::BusDevice>& devices);
nlohmann::json json_of(const drivers::station::LinkReport& link);

}  // namespace youbotd
