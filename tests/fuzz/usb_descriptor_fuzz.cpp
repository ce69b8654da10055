// Descriptors of a USB device: any bytes.
#include <algorithm>

#include "drivers/usb/usb_descriptors.h"
#include "tests/fuzz/fuzz_target.h"

namespace {

using drivers::usb::report_descriptors;
using fuzz::Bytes;
using fuzz::require;

// One of each kind: device, configuration, association, interface, HID, endpoint, one that is not known.
const Bytes kDevice{18, 1, 0, 2, 0, 0, 0, 8, 0x51, 0x14, 2, 4, 0, 1, 0, 0, 0, 1};
const Bytes kConfiguration{9,  2, 46, 0, 1, 1,    0, 0x80, 50, 8, 11, 0,    1,    3, 0, 0,
                           0,  9, 4,  0, 0, 1,    3, 0,    0,  0, 9,  0x21, 0x11, 1, 0, 1,
                           34, 7, 0,  7, 5, 0x81, 3, 8,    0,  8, 4,  0x30, 1,    2};

}  // namespace

std::vector<Bytes> fuzz::seeds() {
  Bytes both = kDevice;
  both.insert(both.end(), kConfiguration.begin(), kConfiguration.end());
  return {both, kDevice, kConfiguration};
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const Bytes bytes(data, data + size);
  const auto report = report_descriptors(bytes);
  require(report.malformed || !report.lines.empty());
  require(report.lines.size() <= size / 2);
  require(report.interfaces.size() <= size / 9);
  for (const std::string& line : report.lines) require(!line.empty());
  // One byte is no descriptor.
  Bytes longer = bytes;
  longer.push_back(0);
  require(report.malformed || report_descriptors(longer).malformed);
  return 0;
}
