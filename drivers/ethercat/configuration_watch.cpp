#include "drivers/ethercat/configuration_watch.h"

#include <algorithm>
#include <utility>

#include "drivers/ethercat/registers.h"

namespace drivers::ethercat {
namespace {

SetupStep address_step(const Slave& slave) {
  SetupStep step{.address = reg::kStationAddress, .length = 2};
  store_le(step.data.data(), slave.station);
  return step;
}

/// In a sync manager the slave itself sets the status and its own bits, and a mailbox toggles the repeat bit;
/// the last bytes of an FMMU are reserved.
std::uint8_t bits_of_the_master(std::uint16_t address, std::size_t byte) noexcept {
  constexpr std::size_t kReservedOfFmmu = 13;
  if (address < reg::kFmmu) return 0xFF;
  if (address < reg::kSyncManager) return byte < kReservedOfFmmu ? 0xFF : 0;
  if (byte == reg::kSyncManagerStatus || byte == reg::kSyncManagerPdi) return 0;
  return byte == reg::kSyncManagerActivate ? static_cast<std::uint8_t>(~reg::kRepeatRequest) : 0xFF;
}

bool holds(const SetupStep& written, std::span<const std::uint8_t> data) noexcept {
  for (std::size_t i = 0; i < written.length; ++i)
    if (((data[i] ^ written.data[i]) & bits_of_the_master(written.address, i)) != 0) return false;
  return true;
}

}  // namespace

ConfigurationWatch::ConfigurationWatch(const std::vector<Slave>& slaves) {
  for (std::size_t i = 0; i < slaves.size(); ++i) {
    first_.push_back(looks_.size());
    // First the registers that process data need, because their loss makes a slave suspect.
    for (const std::vector<SetupStep>& steps :
         {steps_to_safe_op(slaves[i]), steps_to_pre_op(slaves[i]), {address_step(slaves[i])}})
      for (const SetupStep& step : steps)
        if (step.address != 0) looks_.push_back({.slave = i, .written = step});
  }
}

bool ConfigurationWatch::add(FrameWriter& writer, std::uint8_t index) const noexcept {
  const SetupStep& written = next().written;
  const std::uint16_t place = position_address(static_cast<std::uint16_t>(next().slave));
  return writer.add(Command::kAprd, index, address_of(place, written.address), written.length).counter !=
         nullptr;
}

bool ConfigurationWatch::answer(const Datagram& datagram) noexcept {
  const SetupStep& written = next().written;
  if (datagram.working_counter() != 1 || holds(written, datagram.data)) {
    turn_to((turn_ + 1) % looks_.size());
    return false;
  }
  const auto seen = std::span(seen_).first(written.length);
  if (std::exchange(doubted_, true) && std::ranges::equal(seen, datagram.data)) {
    turn_to((turn_ + 1) % looks_.size());
    return true;
  }
  std::ranges::copy(datagram.data, seen.begin());
  return false;
}

void ConfigurationWatch::suspect(std::size_t slave) noexcept {
  if (next().slave != slave || !doubted_) turn_to(first_[slave]);
}

void ConfigurationWatch::turn_to(std::size_t look) noexcept {
  turn_ = look;
  doubted_ = false;
}

}  // namespace drivers::ethercat
