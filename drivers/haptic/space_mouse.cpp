#include "drivers/haptic/space_mouse.h"

#include <array>
#include <cerrno>
#include <cstddef>
#include <span>

namespace drivers::haptic {
namespace {

/// More than any report of the family; a longer one is cut, and no SpaceMouse sends it.
constexpr std::size_t kReportBytes = 64;

bool switch_light(hid_device* device, bool on) noexcept {
  const auto report = space_mouse_light(on);
  return hid_write(device, report.data(), report.size()) == static_cast<int>(report.size());
}

}  // namespace

SpaceMouse::SpaceMouse(const SpaceMouseChoice& choice)
    : info_(choose_space_mouse(choice, find_space_mice())), device_(open_space_mouse(info_)) {
  if (!switch_light(device_.get(), true))
    info_.warnings.emplace_back("its light could not be switched on; all else works without");
}

SpaceMouse::~SpaceMouse() {
  if (!unplugged_) (void)switch_light(device_.get(), false);
}

SpaceMouseStatus SpaceMouse::poll(std::chrono::nanoseconds now, SpaceMouseSample& sample) noexcept {
  SpaceMouseStatus status;
  while (!unplugged_ && status.reports < kMaxReports) {
    std::array<std::uint8_t, kReportBytes> report{};
    errno = 0;
    const int size = hid_read_timeout(device_.get(), report.data(), report.size(), 0);
    // A signal to this thread ends even a poll() that does not wait.
    if (size == 0 || (size < 0 && errno == EINTR)) break;
    if (size < 0) {
      unplugged_ = true;
      break;
    }
    ++status.reports;
    reports_.take(std::span(report).first(static_cast<std::size_t>(size)), now);
  }
  if (unplugged_) {
    status.fault = HapticFault::kUnplugged;
    sample.deflection = {};
    sample.buttons = 0;
    return status;
  }
  status.overrun = status.reports >= kKernelQueue;
  if (status.overrun) reports_.release();
  sample = {now, reports_.deflection(now), reports_.buttons(), reports_.battery_percent()};
  return status;
}

}  // namespace drivers::haptic
