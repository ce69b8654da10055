// HID reports of a SpaceMouse. Input: for each report the time before it in units of 10 ms, its length, its
// bytes. The same input is also a report descriptor.
#include <algorithm>
#include <cmath>

#include "drivers/haptic/hid_nodes.h"
#include "drivers/haptic/space_mouse_report.h"
#include "tests/fuzz/fuzz_target.h"

namespace {

using drivers::haptic::SpaceMouseDeflection;
using drivers::haptic::SpaceMouseReports;
using fuzz::require;

void check(const SpaceMouseDeflection& deflection) {
  for (const auto& axes : {deflection.translation, deflection.rotation})
    for (const double axis : axes) require(std::abs(axis) <= 1);
}

}  // namespace

std::vector<fuzz::Bytes> fuzz::seeds() {
  return {{0, 7, 1, 0x5E, 0x01, 0xA2, 0xFE, 0, 0, 1, 7, 2, 1, 0, 0xFF, 0xFF, 0, 0x80},
          {1, 13, 1, 1, 0, 2, 0, 3, 0, 4, 0, 5, 0, 6, 0, 1, 5, 3, 1, 0, 0, 0},
          {0, 3, 3, 3, 0, 0, 2, 23, 77, 16, 7, 1, 0, 0, 0, 0, 0, 0},
          {0, 7, 1, 0xFF, 0x7F, 0x00, 0x80, 0, 0, 15, 1, 1, 1, 0},
          {0x05, 0x01, 0x0B, 0x08, 0x00, 0x01, 0x00, 0xFE, 0x01, 0xF0, 0x00, 0x09, 0x08, 0xA1, 0x01, 0xC0}};
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  // A collection needs three items' worth of bytes: page, usage and the collection itself.
  using drivers::haptic::has_collection;
  if (has_collection({data, size}, {.page = 1, .usage = 8})) require(size >= 5);
  fuzz::Input input(data, size);
  SpaceMouseReports reports;
  std::chrono::milliseconds now{1000};
  std::uint64_t unknown = 0;
  while (!input.empty()) {
    now += std::chrono::milliseconds(10 * input.byte());
    const fuzz::Bytes report = input.bytes(input.byte());
    const SpaceMouseDeflection before = reports.deflection(now);
    const std::uint32_t buttons = reports.buttons();
    if (!reports.take(report, now)) {
      ++unknown;
      require(reports.deflection(now) == before && reports.buttons() == buttons);
    }
    require(reports.unknown_reports() == unknown);
    check(reports.deflection(now));
    // A silent device counts as released.
    const auto later = now + SpaceMouseReports::kSilence + std::chrono::milliseconds(1);
    require(reports.deflection(later) == SpaceMouseDeflection{});
  }
  reports.release();
  require(reports.deflection(now) == SpaceMouseDeflection{});
  return 0;
}
