#include "tests/guest_kernel/uhid_device.h"

#include <fcntl.h>
#include <linux/uhid.h>
#include <poll.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <stdexcept>
#include <utility>

#include "tests/guest_kernel/device_node.h"

namespace guest {
namespace {

constexpr int kLookForTheEnd_ms = 10;

bool write_event(int uhid, const uhid_event& event) {
  return ::write(uhid, &event, sizeof(event)) == sizeof(event);
}

}  // namespace

UhidDevice::UhidDevice(const HidIdentity& identity, std::span<const std::uint8_t> report_descriptor,
                       std::function<void(std::span<const std::uint8_t>)> on_output)
    : uhid_(::open("/dev/uhid", O_RDWR | O_CLOEXEC)), on_output_(std::move(on_output)) {
  uhid_event event{};
  event.type = UHID_CREATE2;
  uhid_create2_req& request = event.u.create2;
  std::memcpy(request.name, "emulated", sizeof "emulated");
  request.bus = static_cast<std::uint16_t>(identity.bus);
  request.vendor = identity.vendor;
  request.product = identity.product;
  request.rd_size = static_cast<std::uint16_t>(report_descriptor.size());
  std::memcpy(request.rd_data, report_descriptor.data(), report_descriptor.size());
  if (!write_event(uhid_, event)) {
    ::close(uhid_);
    throw std::runtime_error("/dev/uhid: no emulated HID device; is the module uhid loaded?");
  }
  thread_ = std::jthread([this](const std::stop_token& stop) { serve(stop); });
}

void UhidDevice::send(std::span<const std::uint8_t> report) {
  uhid_event event{};
  event.type = UHID_INPUT2;
  event.u.input2.size = static_cast<std::uint16_t>(report.size());
  std::memcpy(event.u.input2.data, report.data(), report.size());
  if (!write_event(uhid_, event)) throw std::runtime_error("/dev/uhid: the kernel takes no report");
}

UhidDevice::~UhidDevice() {
  unplug();
  settle_udev();
}

void UhidDevice::unplug() {
  if (!thread_.joinable()) return;
  uhid_event event{};
  event.type = UHID_DESTROY;
  (void)write_event(uhid_, event);
  thread_.request_stop();
  thread_.join();
  ::close(uhid_);
}

void UhidDevice::serve(const std::stop_token& stop) {
  while (!stop.stop_requested()) {
    pollfd entry{uhid_, POLLIN, 0};
    uhid_event event{};
    if (::poll(&entry, 1, kLookForTheEnd_ms) <= 0 || ::read(uhid_, &event, sizeof(event)) <= 0) continue;
    uhid_event answer{};
    switch (event.type) {
      case UHID_OUTPUT: on_output_({event.u.output.data, event.u.output.size}); break;
      // It has no feature reports. Without an answer a request would wait for seconds.
      case UHID_GET_REPORT:
        answer.type = UHID_GET_REPORT_REPLY;
        answer.u.get_report_reply.id = event.u.get_report.id;
        answer.u.get_report_reply.err = EIO;
        (void)write_event(uhid_, answer);
        break;
      case UHID_SET_REPORT:
        answer.type = UHID_SET_REPORT_REPLY;
        answer.u.set_report_reply.id = event.u.set_report.id;
        answer.u.set_report_reply.err = EIO;
        (void)write_event(uhid_, answer);
        break;
      default: break;
    }
  }
}

}  // namespace guest
