#include "sim/bus/configuration_check.h"

#include <algorithm>

#include "drivers/ethercat/frame.h"
#include "drivers/ethercat/registers.h"
#include "sim/bus/al_state_machine.h"

namespace sim::bus {
namespace {

namespace reg = drivers::ethercat::reg;

// A sync manager as the master configured it.
struct Configured {
  std::uint32_t start = 0;
  std::uint32_t length = 0;
  std::uint8_t control = 0;
  bool enabled = false;

  std::uint32_t end() const noexcept { return start + ((control & 0x03) == 0x02 ? 1 : 3) * length; }
};

constexpr std::uint8_t kModeAndDirection = 0x0F;

Configured configured(std::span<const std::uint8_t> registers, std::size_t index) noexcept {
  const std::uint8_t* const own = &registers[index * reg::kSyncManagerBytes];
  return {.start = drivers::ethercat::load_le<std::uint16_t>(own),
          .length = drivers::ethercat::load_le<std::uint16_t>(own + 2),
          .control = own[4],
          .enabled = (own[reg::kSyncManagerActivate] & 0x01) != 0};
}

bool same_kind(const Configured& found, const SyncManagerSetting& expected) noexcept {
  return (found.control & kModeAndDirection) == (expected.control & kModeAndDirection) &&
         found.length == expected.length;
}

// Whether the FMMUs map every bit, if they touch the data at all.
bool mapped_whole(const Configured& manager, std::span<const Fmmu> fmmus, bool outputs) noexcept {
  std::uint64_t bit = 8ULL * manager.start;
  const std::uint64_t end = bit + 8ULL * manager.length;
  const auto last_of = [](const Fmmu& fmmu) { return fmmu.physical_first() + fmmu.bits(); };
  if (std::ranges::none_of(fmmus, [&](const Fmmu& fmmu) {
        return fmmu.bits() > 0 && fmmu.physical_first() < end && last_of(fmmu) > bit;
      })) {
    return true;
  }
  for (std::size_t pass = 0; pass < fmmus.size() && bit < end; ++pass) {  // each pass advances by one FMMU
    for (const Fmmu& fmmu : fmmus) {
      const bool right_way = outputs ? fmmu.writes() : fmmu.reads();
      if (right_way && fmmu.physical_first() <= bit) bit = std::max(bit, last_of(fmmu));
    }
  }
  return bit >= end;
}

}  // namespace

std::uint16_t mailbox_obstacle(std::span<const SyncManagerSetting> expected,
                               std::span<const std::uint8_t> registers, bool optional) noexcept {
  bool any_enabled = false;
  bool all_right = true;
  for (std::size_t i = 0; i < expected.size(); ++i) {
    if (expected[i].use != SyncManagerUse::kMailboxOut && expected[i].use != SyncManagerUse::kMailboxIn)
      continue;
    const Configured found = configured(registers, i);
    any_enabled = any_enabled || found.enabled;
    all_right =
        all_right && found.enabled && found.start == expected[i].start && same_kind(found, expected[i]);
  }
  return all_right || (optional && !any_enabled) ? al_code::kNone : al_code::kInvalidMailbox;
}

std::uint16_t process_data_obstacle(std::span<const SyncManagerSetting> expected,
                                    std::span<const std::uint8_t> registers, std::span<const Fmmu> fmmus,
                                    std::uint32_t memory_end) noexcept {
  for (std::size_t i = 0; i < expected.size(); ++i) {
    const bool outputs = expected[i].use == SyncManagerUse::kOutputs;
    if (!outputs && expected[i].use != SyncManagerUse::kInputs) continue;
    const Configured found = configured(registers, i);
    const bool fits = expected[i].length == 0 ? !found.enabled || found.length == 0
                                              : found.enabled && same_kind(found, expected[i]) &&
                                                    mapped_whole(found, fmmus, outputs);
    if (!fits) return outputs ? al_code::kInvalidOutputs : al_code::kInvalidInputs;
  }
  const std::size_t count = registers.size() / reg::kSyncManagerBytes;
  for (std::size_t i = 0; i < count; ++i) {
    const Configured one = configured(registers, i);
    if (!one.enabled || one.length == 0) continue;
    if (one.start < reg::kProcessMemory || one.end() > memory_end) return al_code::kInvalidSyncManager;
    for (std::size_t j = 0; j < i; ++j) {
      const Configured other = configured(registers, j);
      if (other.enabled && other.length > 0 && one.start < other.end() && other.start < one.end()) {
        return al_code::kInvalidSyncManager;
      }
    }
  }
  return al_code::kNone;
}

}  // namespace sim::bus
