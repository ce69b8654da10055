#include "sim/bus/sii_interface.h"

#include <algorithm>
#include <utility>

#include "drivers/ethercat/frame.h"
#include "drivers/ethercat/registers.h"
#include "sim/bus/sii_image.h"

namespace sim::bus {
namespace {

namespace reg = drivers::ethercat::reg;
using drivers::ethercat::load_le;
using drivers::ethercat::store_le;

// Offsets from 0x0500.
constexpr std::size_t kControl = reg::kSiiControl - reg::kSiiConfiguration;
constexpr std::size_t kAddress = reg::kSiiAddress - reg::kSiiConfiguration;
constexpr std::size_t kData = reg::kSiiData - reg::kSiiConfiguration;
constexpr std::size_t kEndOfRegisters = kData + 8;

constexpr std::uint8_t kGivenToFirmware = 0x01;  // in the configuration register
constexpr std::uint16_t kWriteEnable = 0x0001;
constexpr std::uint16_t kTwoAddressBytes = 0x0080;
constexpr std::uint16_t kCommandMask = 0x0700;
constexpr std::uint16_t kReadCommand = 0x0100;
constexpr std::uint16_t kWriteCommand = 0x0200;
constexpr std::uint16_t kReload = 0x0400;
constexpr std::uint16_t kNotLoaded = 0x1800;  // checksum wrong, device information missing
constexpr std::uint16_t kCommandError = 0x2000;
constexpr std::uint16_t kWriteEnableError = 0x4000;

}  // namespace

SiiInterface::SiiInterface(std::vector<std::uint8_t> image, Timing timing, std::span<std::uint8_t> registers)
    : image_(std::move(image)), timing_(timing), registers_(registers) {
  reset();
}

void SiiInterface::reset() noexcept {
  std::fill_n(registers_.begin(), kEndOfRegisters, std::uint8_t{0});
  busy_for_ = {};
  command_ = errors_ = 0;
  load_configuration();
  set_status(0);
}

void SiiInterface::load_configuration() noexcept {
  loaded_ = image_.size() > kSiiChecksummedBytes &&
            sii_checksum(std::span(image_).first<kSiiChecksummedBytes>()) == image_[kSiiChecksummedBytes];
}

std::uint16_t SiiInterface::word(std::uint32_t address) const noexcept {
  const std::uint64_t byte = 2ULL * address;
  return byte + 1 < image_.size() ? load_le<std::uint16_t>(&image_[byte]) : std::uint16_t{0xFFFF};
}

void SiiInterface::set_status(std::uint16_t bits) noexcept {
  unsigned status = bits | errors_;
  if (timing_.reads_8_bytes) status |= reg::kSiiReads8Bytes;
  if (image_.size() > 2048) status |= kTwoAddressBytes;
  if (!loaded_) status |= kNotLoaded;
  store_le(&registers_[kControl], static_cast<std::uint16_t>(status));
}

void SiiInterface::write(std::size_t offset, std::span<const std::uint8_t> bytes) noexcept {
  std::uint16_t control = 0;
  bool commanded = false;
  for (std::size_t i = 0; i < bytes.size() && offset + i < kEndOfRegisters; ++i) {
    const std::size_t at = offset + i;
    if (at == 0) registers_[0] = bytes[i] & 0x03;
    // While busy, or assigned to the firmware, everything except the configuration is locked.
    if (at < kControl || command_ != 0 || (registers_[0] & kGivenToFirmware) != 0) continue;
    if (at < kAddress) {
      control = static_cast<std::uint16_t>(control | bytes[i] << (8 * (at - kControl)));
      commanded = commanded || at == kControl + 1;  // the command byte
    } else {
      registers_[at] = bytes[i];
    }
  }
  if (commanded) start(control);
}

void SiiInterface::start(std::uint16_t control) noexcept {
  const auto command = static_cast<std::uint16_t>(control & kCommandMask);
  if (command == 0) {
    errors_ = 0;
  } else if (errors_ != 0) {
    return;  // must be cleared first
  } else if (command != kReadCommand && command != kWriteCommand && command != kReload) {
    errors_ = kCommandError;
  } else if (command == kWriteCommand && (control & kWriteEnable) == 0) {
    errors_ = kWriteEnableError;
  } else {
    command_ = command;
    busy_for_ = command == kReadCommand    ? timing_.read_time
                : command == kWriteCommand ? timing_.write_time
                                           : 4 * timing_.read_time;
    set_status(static_cast<std::uint16_t>(reg::kSiiBusy | command));
    if (busy_for_.count() <= 0) finish();
    return;
  }
  set_status(0);
}

void SiiInterface::advance(std::chrono::nanoseconds step) noexcept {
  if (command_ == 0) return;
  busy_for_ -= step;
  if (busy_for_.count() <= 0) finish();
}

void SiiInterface::finish() noexcept {
  const auto address = load_le<std::uint32_t>(&registers_[kAddress]);
  switch (std::exchange(command_, std::uint16_t{0})) {
    case kReadCommand:
      for (std::uint32_t i = 0; i < (timing_.reads_8_bytes ? 4U : 2U); ++i) {
        store_le(&registers_[kData + 2 * i], word(address + i));
      }
      break;
    case kWriteCommand:
      if (2ULL * address + 1 < image_.size())
        std::copy_n(&registers_[kData], 2, &image_[2 * std::size_t{address}]);
      break;
    default:  // reload
      load_configuration();
      break;
  }
  set_status(0);
}

}  // namespace sim::bus
