#include "sim/bus/slave_description.h"

#include <stdexcept>

#include "drivers/ethercat/registers.h"

namespace sim::bus {
namespace {

// Sync manager control (register +4): mode, direction, interrupt to the firmware, watchdog trigger.
constexpr std::uint8_t kMailboxOutControl = 0x26;
constexpr std::uint8_t kMailboxInControl = 0x22;
constexpr std::uint8_t kOutputsControl = 0x64;
constexpr std::uint8_t kInputsControl = 0x20;

unsigned bits_of(const ProcessImage& image) {
  unsigned bits = 0;
  for (const PdoEntry& entry : image.entries) bits += entry.bits;
  return bits;
}

}  // namespace

std::vector<SyncManagerSetting> sync_managers_of(const SlaveDescription& description) {
  std::vector<SyncManagerSetting> managers;
  const auto add = [&managers](SyncManagerUse use, std::uint16_t start, std::uint16_t length,
                               std::uint8_t control) {
    managers.push_back({.use = use, .start = start, .length = length, .control = control});
  };
  if (description.mailbox_out.length > 0) {
    add(SyncManagerUse::kMailboxOut, description.mailbox_out.start, description.mailbox_out.length,
        kMailboxOutControl);
    add(SyncManagerUse::kMailboxIn, description.mailbox_in.start, description.mailbox_in.length,
        kMailboxInControl);
  }
  if (description.outputs.bytes + description.inputs.bytes > 0) {
    add(SyncManagerUse::kOutputs, description.outputs.start, description.outputs.bytes, kOutputsControl);
    add(SyncManagerUse::kInputs, description.inputs.start, description.inputs.bytes, kInputsControl);
  }
  return managers;
}

void validate(const SlaveDescription& description) {
  using drivers::ethercat::reg::kProcessMemory;
  std::string problems;
  const auto require = [&problems](bool holds, const std::string& problem) {
    if (!holds) problems += (problems.empty() ? "" : "; ") + problem;
  };

  require(!description.name.empty() && description.name.size() <= 255,
          "a name of 1 to 255 characters is needed");
  require(description.order_code.size() <= 255, "an order code of at most 255 characters is needed");
  require(description.group.size() <= 255, "a group of at most 255 characters is needed");
  require(description.fmmu_count >= 3 && description.fmmu_count <= 16,
          "an FMMU count from 3 to 16 is needed");
  require(description.sync_manager_count <= 16, "there are at most 16 sync managers");
  require(description.ram_kilobytes >= 1 && description.ram_kilobytes <= 60,
          "1 to 60 KiB of memory are needed");
  require((description.mailbox_out.length > 0) == (description.mailbox_in.length > 0),
          "a mailbox needs both directions");
  require((description.boot_mailbox_out.length > 0) == (description.boot_mailbox_in.length > 0),
          "a bootstrap mailbox needs both directions");
  require(bits_of(description.outputs) <= 8U * description.outputs.bytes,
          "the output entries exceed the outputs");
  require(bits_of(description.inputs) <= 8U * description.inputs.bytes,
          "the input entries exceed the inputs");

  const std::vector<SyncManagerSetting> managers = sync_managers_of(description);
  require(managers.size() <= description.sync_manager_count, "more sync managers are needed than there are");
  const unsigned memory_end = kProcessMemory + 1024U * description.ram_kilobytes;
  const auto end_of = [](const SyncManagerSetting& manager) {  // process data has three buffers
    const bool mailbox =
        manager.use == SyncManagerUse::kMailboxOut || manager.use == SyncManagerUse::kMailboxIn;
    return manager.start + (mailbox ? 1U : 3U) * manager.length;
  };
  for (std::size_t i = 0; i < managers.size(); ++i) {
    if (managers[i].length == 0) continue;
    const std::string name = "sync manager " + std::to_string(i);
    require(managers[i].length > 1, name + " guards a single byte, which a sync manager does not");
    require(managers[i].start >= kProcessMemory && end_of(managers[i]) <= memory_end,
            name + " leaves process memory");
    for (std::size_t j = 0; j < i; ++j) {
      if (managers[j].length == 0) continue;
      require(managers[j].start >= end_of(managers[i]) || managers[i].start >= end_of(managers[j]),
              name + " overlaps sync manager " + std::to_string(j));
    }
  }
  if (!problems.empty())
    throw std::invalid_argument("slave description \"" + description.name + "\": " + problems);
}

}  // namespace sim::bus
