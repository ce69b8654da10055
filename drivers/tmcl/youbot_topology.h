/// @file
/// Layout of a youBot's bus (official driver's configuration, KU Leuven driver).
#pragma once
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "drivers/ethercat/bus_scan.h"
#include "drivers/tmcl/youbot_kind.h"

namespace drivers::tmcl {

enum class BoardKind : std::uint8_t { kPower, kWheel, kArmJoint };

struct YoubotBoard {
  BoardKind kind = BoardKind::kPower;
  int arm = 0;    ///< 0 or 1; -1: the base's power board
  int index = 0;  ///< wheel 0 … 3, joint 0 … 4
};

/// The joint driven by a wheel's or arm joint's board: "wheel-1", "arm-1"; of a second arm "arm2-1".
std::string joint_name(const YoubotBoard& board);

/// Check before any state change: every slave has the name of a youBot board, and motor controllers have
/// Trinamic's vendor number; their product numbers are not known. Slaves may be missing.
/// @throws ethercat::BusError naming the first that is another device.
void require_youbot_boards(const std::vector<ethercat::Slave>& slaves);

/// In bus order, power boards included.
std::vector<YoubotBoard> youbot_boards(YoubotKind kind);
/// The variant with as many `slaves` that begins with all of `kind`, such as a base with an arm for a base;
/// `kind` itself if there is none.
YoubotKind youbot_around(YoubotKind kind, std::size_t slaves);
/// The same as accepted names: both generations of hardware.
std::vector<ethercat::ExpectedSlave> youbot_topology(YoubotKind kind);

}  // namespace drivers::tmcl
