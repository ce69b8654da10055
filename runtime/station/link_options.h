/// @file
/// Settings of the link between two stations.
#pragma once
#include <chrono>
#include <filesystem>
#include <memory>
#include <string>

#include "control/delayed_port.h"
#include "control/hand_presence.h"
#include "drivers/station/endpoint.h"
#include "hal/newest_value.h"
#include "runtime/configuration/toml_reader.h"

namespace runtime {

enum class Role : std::uint8_t {
  kBoth,      ///< haptic device and robot at one computer
  kRobot,     ///< the robot's station: its haptic device is the operator's, over the link
  kOperator,  ///< the operator's station: without a robot
};

struct LinkOptions {
  std::string listen;              ///< of the robot's station: "0.0.0.0:7777"
  std::string peer;                ///< of the operator's: "robot.local:7777"
  std::filesystem::path key_file;  ///< of drivers::station::make_key_file()
  drivers::station::EndpointConfig endpoint;
  control::DelayedPortConfig port;
  control::HandPresence::Config presence;  ///< of the hand at the operator's station
};

/// Applies the content of the `[link]` table; docs/two-stations.md shows every key. Relative paths start at
/// `folder`. Refuses what the role lacks.
void read_link(TomlTable& table, Role role, const std::filesystem::path& folder, LinkOptions& options);

/// What a station knows of its link, from the thread that has it to one that reports it.
using LinkMonitor = hal::NewestValue<drivers::station::LinkReport>;

/// For logs: "connected, round trip 31.2 ms (least 30.1), 0.8 % lost here and 1.1 % there".
std::string describe(const drivers::station::LinkReport& report);

}  // namespace runtime
