#include "apps/youbot_sim/fault_file.h"

#include <chrono>
#include <cmath>
#include <cstdint>

#include "drivers/ethercat/frame.h"
#include "runtime/configuration/toml_reader.h"

namespace youbot_sim {
namespace {

using sim::bus::BoardFault;
using sim::bus::FaultEvent;
using sim::bus::FaultKind;

constexpr double kYear_s = 3e7;

void read_time(runtime::TomlTable& table, std::string_view key, std::chrono::nanoseconds& time) {
  double seconds = std::chrono::duration<double>(time).count();
  table.number(key, seconds, {.min = 0, .max = kYear_s});
  time = std::chrono::nanoseconds(std::llround(1e9 * seconds));
}

template <typename T>
void read_integer(runtime::TomlTable& table, std::string_view key, T& value,
                  const runtime::NumberRules& rules) {
  int number = static_cast<int>(value);
  table.integer(key, number, rules);
  value = static_cast<T>(number);
}

FaultEvent read_event(runtime::TomlTable& table, std::size_t slaves) {
  FaultEvent event;
  table.choice("kind", event.kind,
               {{"drop_request", FaultKind::kDropRequest},
                {"drop_reply", FaultKind::kDropReply},
                {"delay", FaultKind::kDelay},
                {"duplicate", FaultKind::kDuplicate},
                {"truncate", FaultKind::kTruncate},
                {"corrupt", FaultKind::kCorrupt},
                {"wrong_counter", FaultKind::kWrongCounter},
                {"damage_on_cable", FaultKind::kDamageOnCable},
                {"slave_off", FaultKind::kSlaveOff},
                {"cable_out", FaultKind::kCableOut},
                {"brown_out", FaultKind::kBrownOut},
                {"mailbox_hung", FaultKind::kMailboxHung},
                {"board_fault", FaultKind::kBoardFault},
                {"foreign_write", FaultKind::kForeignWrite}},
               {.required = true});
  read_time(table, "at_s", event.at);
  int at_frame = -1;
  table.integer("at_frame", at_frame, {.min = 0});
  if (at_frame >= 0) event.at_frame = static_cast<std::uint64_t>(at_frame);
  read_integer(table, "count", event.count, {.min = 1});
  read_time(table, "duration_s", event.duration);
  int slave = 1;
  table.integer("slave", slave, {.min = 1, .max = static_cast<double>(slaves)});
  event.slave = static_cast<std::uint32_t>(slave - 1);
  read_time(table, "delay_s", event.delay);
  if (event.kind == FaultKind::kDelay && event.delay.count() == 0)
    table.refuse("delay_s", "is zero or missing: the kind delay needs one");
  read_integer(table, "offset", event.offset, {.min = 0});
  read_integer(table, "mask", event.mask, {.min = 1, .max = 255});
  read_integer(table, "counter_change", event.counter_change, {});
  read_integer(table, "datagram", event.datagram, {.min = 0});
  read_integer(table, "value", event.value, {.min = 0, .max = 0xFFFF});
  if (event.kind == FaultKind::kForeignWrite) {
    if (event.offset > 0xFFFF) table.refuse("offset", "is above 65535: there is no such register");
    if (event.count > drivers::ethercat::kMaxDatagramBytes / 2)
      table.refuse("count", "is more than fits a frame");
  }
  table.choice("board_fault", event.board_fault,
               {{"stuck_encoder", BoardFault::kStuckEncoder},
                {"hall_sensor", BoardFault::kHallSensor},
                {"undervoltage", BoardFault::kUndervoltage},
                {"overvoltage", BoardFault::kOvervoltage},
                {"overtemperature", BoardFault::kOvertemperature}});
  return event;
}

}  // namespace

std::vector<FaultEvent> load_faults(const std::filesystem::path& path, std::size_t slaves) {
  runtime::TomlFile file = runtime::TomlFile::parse(path);
  std::vector<FaultEvent> events;
  runtime::TomlTable root = file.root();
  for (runtime::TomlTable& table : root.tables("fault")) events.push_back(read_event(table, slaves));
  file.finish();
  return events;
}

}  // namespace youbot_sim
