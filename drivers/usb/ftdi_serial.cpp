#include "drivers/usb/ftdi_serial.h"

#include <algorithm>

namespace drivers::usb::ftdi {

std::span<std::uint8_t> strip_modem_status(std::span<std::uint8_t> packets) noexcept {
  std::size_t kept = 0;
  for (std::size_t begin = 0; begin < packets.size(); begin += kPacketBytes) {
    const auto packet = packets.subspan(begin, std::min(kPacketBytes, packets.size() - begin));
    if (packet.size() <= kModemStatusBytes) continue;
    const auto data = packet.subspan(kModemStatusBytes);
    // Copies forward, to the left: overlap is allowed.
    std::copy(data.begin(), data.end(), packets.begin() + static_cast<std::ptrdiff_t>(kept));
    kept += data.size();
  }
  return packets.first(kept);
}

}  // namespace drivers::usb::ftdi
