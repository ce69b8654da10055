#include "drivers/tmcl/youbot_topology.h"

#include <algorithm>
#include <array>
#include <cstdio>

#include "drivers/ethercat/bus_error.h"

namespace drivers::tmcl {
namespace {

constexpr std::array<const char*, 4> kWheelPlaces{"front-left", "front-right", "rear-left", "rear-right"};

void append_base(std::vector<YoubotBoard>& boards) {
  boards.push_back({BoardKind::kPower, -1, 0});
  for (int wheel = 0; wheel < 4; ++wheel) boards.push_back({BoardKind::kWheel, 0, wheel});
}

void append_arm(std::vector<YoubotBoard>& boards, int arm) {
  boards.push_back({BoardKind::kPower, arm, 0});
  for (int joint = 0; joint < 5; ++joint) boards.push_back({BoardKind::kArmJoint, arm, joint});
}

ethercat::ExpectedSlave expected(const YoubotBoard& board) {
  const std::string arm = board.arm == 1 ? "second arm" : "arm";
  switch (board.kind) {
    case BoardKind::kPower:
      if (board.arm < 0) return {"power board of the base", {"KR-845"}};
      return {"power board of the " + arm, {"KR-843"}};
    case BoardKind::kWheel:
      return {"wheel " + std::to_string(board.index + 1) + " (" +
                  kWheelPlaces[static_cast<std::size_t>(board.index)] + ")",
              {"TMCM-1632", "TMCM-174"}};
    case BoardKind::kArmJoint:
      return {"joint " + std::to_string(board.index + 1) + " of the " + arm, {"TMCM-1610", "TMCM-KR-841"}};
  }
  return {};
}

/// From ETG's list of vendors. The power boards' vendor is not known.
constexpr std::uint32_t kTrinamic = 0x286;

bool is_youbot_board(const ethercat::Slave& slave) {
  const auto is_called = [&slave](const std::string& name) { return slave.sii.is_called(name); };
  for (const BoardKind kind : {BoardKind::kPower, BoardKind::kWheel, BoardKind::kArmJoint})
    for (const int arm : {-1, 0})
      if (std::ranges::any_of(expected({.kind = kind, .arm = arm}).names, is_called))
        return kind == BoardKind::kPower || slave.sii.vendor == kTrinamic;
  return false;
}

}  // namespace

void require_youbot_boards(const std::vector<ethercat::Slave>& slaves) {
  const auto stranger = std::ranges::find_if_not(slaves, is_youbot_board);
  if (stranger == slaves.end()) return;
  std::array<char, 64> identity{};
  std::snprintf(identity.data(), identity.size(), "vendor 0x%08X, product 0x%08X",
                unsigned{stranger->sii.vendor}, unsigned{stranger->sii.product});
  throw ethercat::BusError(
      stranger->label(), "check that it is a youBot's board",
      std::string("it is another device (") + identity.data() +
          "), which is not commanded; nothing was changed: unplug it, or name another interface");
}

std::string joint_name(const YoubotBoard& board) {
  const char* const limb = board.kind == BoardKind::kWheel ? "wheel-" : board.arm == 0 ? "arm-" : "arm2-";
  return limb + std::to_string(board.index + 1);
}

std::vector<YoubotBoard> youbot_boards(YoubotKind kind) {
  std::vector<YoubotBoard> boards;
  if (kind != YoubotKind::kArm) append_base(boards);
  if (kind != YoubotKind::kBase) append_arm(boards, 0);
  if (kind == YoubotKind::kBaseAndTwoArms) append_arm(boards, 1);
  return boards;
}

YoubotKind youbot_around(YoubotKind kind, std::size_t slaves) {
  if (kind == YoubotKind::kArm) return kind;  // the others begin with a base
  for (const YoubotKind larger : {YoubotKind::kBase, YoubotKind::kBaseAndArm, YoubotKind::kBaseAndTwoArms})
    if (larger >= kind && youbot_boards(larger).size() == slaves) return larger;
  return kind;
}

std::vector<ethercat::ExpectedSlave> youbot_topology(YoubotKind kind) {
  std::vector<ethercat::ExpectedSlave> topology;
  for (const YoubotBoard& board : youbot_boards(kind)) topology.push_back(expected(board));
  return topology;
}

}  // namespace drivers::tmcl
