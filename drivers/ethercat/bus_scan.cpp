#include "drivers/ethercat/bus_scan.h"

#include <algorithm>
#include <array>
#include <utility>

#include "drivers/ethercat/bus_error.h"
#include "drivers/ethercat/registers.h"

namespace drivers::ethercat {
namespace {

constexpr std::uint16_t kFirstStation = 0x1000;
/// A youBot with two arms has 17. More indicates a corrupt counter, and scanning them would take minutes.
constexpr std::uint16_t kMaxSlaves = 256;
constexpr int kMaxSiiRounds = 20'000;
constexpr int kMaxSiiErrors = 500;
constexpr int kMaxSiiSilence = 500;  // consecutive datagrams that a slave leaves unanswered

const auto kAll = [](std::size_t) { return false; };

void assign_stations(RegisterAccess& access, std::vector<Slave>& slaves) {
  access.each(
      slaves.size(), kAll,
      [&](FrameWriter& writer, std::uint8_t index, std::size_t i) {
        const Datagram datagram =
            writer.add(Command::kApwr, index,
                       address_of(position_address(static_cast<std::uint16_t>(i)), reg::kStationAddress), 2);
        if (datagram.counter == nullptr) return false;
        store_le(datagram.data.data(), slaves[i].station);
        return true;
      },
      [](const Datagram&, std::size_t) {});
}

/// Reads `length` bytes at `address` from every slave.
void read_each(RegisterAccess& access, const std::vector<Slave>& slaves, std::uint16_t address,
               std::size_t length, const std::string& step,
               const std::function<void(std::span<const std::uint8_t>, std::size_t)>& take) {
  access.each(
      slaves.size(), kAll,
      [&](FrameWriter& writer, std::uint8_t index, std::size_t i) {
        return writer.add(Command::kFprd, index, address_of(slaves[i].station, address), length).counter !=
               nullptr;
      },
      [&](const Datagram& datagram, std::size_t i) {
        if (datagram.working_counter() == 0)
          throw BusError("slave " + std::to_string(slaves[i].position), step,
                         "it does not answer; the bus changed during the scan or the slave is failing");
        take(datagram.data, i);
      });
}

void read_base_information(RegisterAccess& access, std::vector<Slave>& slaves) {
  read_each(access, slaves, reg::kType, 10, "read its ESC information",
            [&](std::span<const std::uint8_t> data, std::size_t i) {
              slaves[i].fmmu_count = data[reg::kFmmuCount];
              slaves[i].sync_manager_count = data[reg::kSyncManagerCount];
              slaves[i].port_descriptor = data[reg::kPortDescriptor];
              slaves[i].features = load_le<std::uint16_t>(&data[reg::kFeatures]);
            });
  read_each(access, slaves, reg::kDlStatus, 2, "read its port status",
            [&](std::span<const std::uint8_t> data, std::size_t i) {
              slaves[i].dl_status = load_le<std::uint16_t>(data.data());
            });
}

/// Port to which the next slave connects: the first port that exists and is unused.
std::uint8_t next_port(const Slave& slave) {
  for (const std::uint8_t port : kPortOrder)
    if ((slave.port_descriptor >> (2 * port) & 3) >= 2 && !slave.communicates(port)) return port;
  return 1;
}

/// Follows the frame's path through the ports.
void find_parents(std::vector<Slave>& slaves) {
  struct Branch {
    std::uint16_t position;
    std::vector<std::uint8_t> free_ports;  // last one first
  };
  std::vector<Branch> path;
  for (Slave& slave : slaves) {
    while (!path.empty() && path.back().free_ports.empty()) path.pop_back();
    if (!path.empty()) {
      slave.parent = path.back().position;
      slave.parent_port = path.back().free_ports.back();
      path.back().free_ports.pop_back();
    }
    Branch branch{slave.position, {}};
    for (std::size_t n = kPortOrder.size(); n-- > 0;)
      if (slave.communicates(kPortOrder[n])) branch.free_ports.push_back(kPortOrder[n]);
    path.push_back(std::move(branch));
  }
}

const char* describe_sii(std::uint16_t status) {
  if ((status & 0x2000) != 0) return "the EEPROM does not acknowledge";
  if ((status & 0x0800) != 0) return "its checksum is wrong; is the EEPROM programmed?";
  if ((status & reg::kSiiErrors) != 0) return "the slave reports that it is not loaded";
  return "it stays busy";
}

/// All EEPROMs in parallel: one round asks each slave for its next word, the following rounds poll.
void read_sii(RegisterAccess& access, std::vector<Slave>& slaves) {
  struct Progress {
    SiiReader reader;
    bool asked = false;
    int errors = 0;  // consecutive
    int silence = 0;
    std::uint16_t status = 0;

    bool answered(const Datagram& datagram) {
      silence = datagram.working_counter() == 0 ? silence + 1 : 0;
      return silence == 0;
    }
  };
  std::vector<Progress> progress(slaves.size());
  const auto done = [&](std::size_t i) {
    return !progress[i].reader.next_word().has_value() || progress[i].errors > kMaxSiiErrors ||
           progress[i].silence > kMaxSiiSilence;
  };

  // Take the EEPROM from the slave's own processor (0x0500 bit 0, bit 1 forces), then use it.
  for (const std::uint8_t owner : {std::uint8_t{2}, std::uint8_t{0}})
    (void)access.broadcast_write(reg::kSiiConfiguration, std::array{owner});

  for (int round = 0; round < kMaxSiiRounds; ++round) {
    bool all_done = true;
    for (std::size_t i = 0; i < slaves.size(); ++i) all_done = all_done && done(i);
    if (all_done) break;
    access.each(
        slaves.size(), [&](std::size_t i) { return done(i) || progress[i].asked; },
        [&](FrameWriter& writer, std::uint8_t index, std::size_t i) {
          const Datagram datagram =
              writer.add(Command::kFpwr, index, address_of(slaves[i].station, reg::kSiiControl), 6);
          if (datagram.counter == nullptr) return false;
          // An error, perhaps from a previous master, blocks the interface until an empty command clears it.
          store_le(&datagram.data[0], progress[i].errors % 2 == 0 ? reg::kSiiReadCommand : std::uint16_t{0});
          store_le(&datagram.data[2], std::uint32_t{*progress[i].reader.next_word()});
          return true;
        },
        [&](const Datagram& datagram, std::size_t i) {
          if (!progress[i].answered(datagram)) return;
          if (progress[i].errors % 2 == 0)
            progress[i].asked = true;
          else
            ++progress[i].errors;  // cleared: ask again
        });
    access.each(
        slaves.size(), [&](std::size_t i) { return done(i) || !progress[i].asked; },
        [&](FrameWriter& writer, std::uint8_t index, std::size_t i) {
          return writer.add(Command::kFprd, index, address_of(slaves[i].station, reg::kSiiControl), 14)
                     .counter != nullptr;
        },
        [&](const Datagram& datagram, std::size_t i) {
          if (!progress[i].answered(datagram)) return;
          const auto status = load_le<std::uint16_t>(datagram.data.data());
          if ((status & reg::kSiiBusy) != 0) return;
          progress[i].asked = false;
          progress[i].status = status;
          if ((status & reg::kSiiErrors) != 0) {
            ++progress[i].errors;
            return;
          }
          progress[i].errors = 0;
          const std::size_t bytes = (status & reg::kSiiReads8Bytes) != 0 ? 8 : 4;
          progress[i].reader.store(datagram.data.subspan(6, bytes));
        });
  }
  for (std::size_t i = 0; i < slaves.size(); ++i) {
    slaves[i].sii = progress[i].reader.info();
    const bool unfinished = progress[i].reader.next_word().has_value();
    if (const std::string& error = progress[i].reader.error(); unfinished || !error.empty())
      throw BusError(slaves[i].label(), "read its SII EEPROM",
                     !unfinished               ? error
                     : progress[i].silence > 0 ? "it does not answer any more; check its power and cable"
                                               : describe_sii(progress[i].status));
  }
}

ProcessDataWindow window(const Slave& slave, SyncManagerUse use, const std::vector<PdoInfo>& pdos) {
  ProcessDataWindow result;
  for (std::size_t i = 0; i < slave.sii.sync_managers.size(); ++i) {
    const SyncManagerInfo& manager = slave.sii.sync_managers[i];
    if (manager.use != use) continue;
    unsigned bits = 0;
    for (const PdoInfo& pdo : pdos)
      if (pdo.sync_manager == i) bits += pdo.bits;
    // Without assigned PDOs the sync manager's own length applies.
    result.bytes = static_cast<std::uint16_t>(bits > 0 ? (bits + 7) / 8 : manager.length);
    result.sync_manager = static_cast<std::uint16_t>(i);
    result.start = manager.start;
    result.control = manager.control;
    return result;
  }
  return result;
}

void lay_out_image(std::vector<Slave>& slaves) {
  std::uint32_t offset = 0;
  for (Slave& slave : slaves) {
    slave.mailbox_fits = slave.sii.has_mailbox() && slave.sync_manager_count >= 2;
    slave.outputs = window(slave, SyncManagerUse::kOutputs, slave.sii.output_pdos);
    slave.inputs = window(slave, SyncManagerUse::kInputs, slave.sii.input_pdos);
    for (ProcessDataWindow* part : {&slave.outputs, &slave.inputs}) {
      part->image_offset = offset;
      offset += part->bytes;
    }
  }
}

std::string quoted(const std::vector<std::string>& names) {
  std::string text;
  for (const std::string& name : names) text += (text.empty() ? "'" : " or '") + name + "'";
  return text;
}

}  // namespace

std::vector<Slave> scan_bus(RegisterAccess& access, const std::string& interface) {
  std::array<std::uint8_t, 1> type{};
  const std::uint16_t count = access.broadcast_read(reg::kType, type);
  if (count == 0)
    throw BusError(
        interface, "count slaves",
        "frames come back, but no EtherCAT slave touched them; is the other end the robot's EtherCAT socket, "
        "and no switch or looped cable?");
  if (count > kMaxSlaves)
    throw BusError(interface, "count slaves",
                   "the reply's working counter says " + std::to_string(count) + ", more than the " +
                       std::to_string(kMaxSlaves) +
                       " that can be; does another master or a switch change frames?");
  std::vector<Slave> slaves(count);
  for (std::uint16_t i = 0; i < count; ++i) {
    slaves[i].position = static_cast<std::uint16_t>(i + 1);
    slaves[i].station = static_cast<std::uint16_t>(kFirstStation + i + 1);
  }
  assign_stations(access, slaves);
  read_base_information(access, slaves);
  find_parents(slaves);
  read_sii(access, slaves);
  lay_out_image(slaves);
  return slaves;
}

void check_topology(const std::vector<Slave>& found, const std::vector<ExpectedSlave>& expected,
                    const std::string& interface) {
  for (std::size_t i = 0; i < expected.size(); ++i) {
    const ExpectedSlave& wanted = expected[i];
    const std::string place = "slave " + std::to_string(i + 1) + ", " + wanted.role;
    if (i >= found.size()) {
      const std::string before =
          found.empty() ? interface : found.back().label() + ", port " + std::to_string(next_port(found.back()));
      throw BusError(place, "check the bus",
                     "missing: expected " + quoted(wanted.names) + ", but the bus ends after " +
                         std::to_string(found.size()) + " of " + std::to_string(expected.size()) +
                         " slaves; check the cable from " + before + " and the power of what follows");
    }
    // The youBot's names are known from drivers based on SOEM, which may not use the general category's.
    if (std::none_of(wanted.names.begin(), wanted.names.end(),
                     [&](const std::string& name) { return found[i].sii.is_called(name); }))
      throw BusError(place, "check the bus",
                     "expected " + quoted(wanted.names) + ", found '" + found[i].sii.name + "'" +
                         (found[i].parent > 0 ? " behind " + found[found[i].parent - 1U].label() + ", port " +
                                                    std::to_string(found[i].parent_port)
                                              : std::string()) +
                         "; is a slave before it missing, or the cabling changed?");
  }
  if (found.size() > expected.size())
    throw BusError(found[expected.size()].label(), "check the bus",
                   "not expected: the robot ends after " + std::to_string(expected.size()) + " slaves");
}

std::size_t image_bytes(const std::vector<Slave>& slaves) {
  std::size_t bytes = 0;
  for (const Slave& slave : slaves) bytes += std::size_t{slave.outputs.bytes} + slave.inputs.bytes;
  return bytes;
}

}  // namespace drivers::ethercat
