#include "tests/guest_kernel/usbip_device.h"

#include <linux/usb/ch9.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <fstream>
#include <sstream>
#include <stdexcept>
#include <utility>

#include "tests/guest_kernel/device_node.h"
#include "tests/guest_kernel/wait_until.h"

namespace guest {
namespace {

constexpr const char* kController = "/sys/devices/platform/vhci_hcd.0/";
constexpr std::uint32_t kDeviceId = 0x10002;  // bus and number at the far end, which is none: anything
constexpr int kAskAgain_ms = 1;
constexpr std::uint16_t kEnglish = 0x0409;

// Words of a header, most significant byte first.
enum Word : std::size_t {
  kCommand = 0,
  kNumber = 4,
  kDirection = 12,
  kEndpoint = 16,
  kStatus = 20,
  kSize = 24
};
constexpr std::size_t kUnlinkedNumber = 20;
constexpr std::size_t kSetup = 40;
enum Command : std::uint32_t { kSubmit = 1, kUnlink = 2, kSubmitted = 3, kUnlinked = 4 };

std::uint32_t get_word(std::span<const std::uint8_t> bytes, std::size_t place) {
  std::uint32_t value = 0;
  for (const std::uint8_t byte : bytes.subspan(place, 4)) value = value << 8U | byte;
  return value;
}
void put_word(std::span<std::uint8_t> bytes, std::size_t place, std::uint32_t value) {
  for (std::size_t i = 0; i < 4; ++i) bytes[place + i] = static_cast<std::uint8_t>(value >> (24 - 8 * i));
}
// In descriptors and set-up packets it is the other way round.
std::uint16_t get_short(std::span<const std::uint8_t> bytes, std::size_t place) {
  return static_cast<std::uint16_t>(bytes[place] | bytes[place + 1] << 8U);
}
void append_short(Bytes& bytes, std::size_t value) {
  bytes.push_back(static_cast<std::uint8_t>(value));
  bytes.push_back(static_cast<std::uint8_t>(value >> 8U));
}

bool read_all(int socket, std::span<std::uint8_t> bytes) {
  while (!bytes.empty()) {
    const ssize_t size = ::read(socket, bytes.data(), bytes.size());
    if (size <= 0) return false;
    bytes = bytes.subspan(static_cast<std::size_t>(size));
  }
  return true;
}

/// The number of a port that is free, and fast enough. Lines: "hs  0000 004 000 00000000 000000 0-0", of
/// which the third word is the state; 4 is free.
int free_port() {
  std::ifstream status(std::string(kController) + "status");
  std::string line;
  while (std::getline(status, line)) {
    std::istringstream words(line);
    std::string hub;
    int port = 0;
    int state = 0;
    if (words >> hub >> port >> state && hub == "hs" && state == 4) return port;
  }
  throw std::runtime_error(std::string(kController) + "status: no free port; is the module vhci-hcd loaded?");
}

void plug_in(int socket, UsbSpeed speed) {
  const int port = free_port();
  std::ofstream attach(std::string(kController) + "attach");
  attach << port << ' ' << socket << ' ' << kDeviceId << ' ' << static_cast<int>(speed) << std::flush;
  if (!attach) throw std::runtime_error(std::string(kController) + "attach: the kernel refuses the device");
}

Bytes text_descriptor(const std::string& text) {
  Bytes bytes{static_cast<std::uint8_t>(2 + 2 * text.size()), USB_DT_STRING};
  for (const char letter : text) append_short(bytes, static_cast<std::uint8_t>(letter));
  return bytes;
}

}  // namespace

UsbipDevice::UsbipDevice(UsbDescription description, UsbFunction& function)
    : description_(std::move(description)), function_(function) {
  std::array<int, 2> ends{};
  if (::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends.data()) != 0)
    throw std::runtime_error("no socket for an emulated USB device");
  socket_ = ends[0];
  try {
    plug_in(ends[1], description_.speed);
  } catch (...) {
    ::close(ends[1]);
    ::close(ends[0]);
    throw;
  }
  ::close(ends[1]);  // the kernel has its own hold on it
  thread_ = std::thread([this] { serve(); });
}

UsbipDevice::~UsbipDevice() {
  unplug();
  const UsbIdentity& identity = description_.identity;
  wait_until([&] { return !find_usb_node(identity.vendor, identity.product); });
  settle_udev();
}

void UsbipDevice::unplug() {
  if (!thread_.joinable()) return;
  ::shutdown(socket_, SHUT_RDWR);
  thread_.join();
  ::close(socket_);
}

void UsbipDevice::serve() {
  while (true) {
    pollfd entry{socket_, POLLIN, 0};
    const int ready = ::poll(&entry, 1, waiting_.empty() ? -1 : kAskAgain_ms);
    if (ready > 0 && !take_packet()) return;
    fill_waiting();
  }
}

bool UsbipDevice::take_packet() {
  Header header{};
  if (!read_all(socket_, header)) return false;
  if (get_word(header, kCommand) == kUnlink) {
    unlinked(header);
    return true;
  }
  Bytes data;
  if (get_word(header, kDirection) == 0) data.resize(get_word(header, kSize));
  if (!read_all(socket_, data)) return false;
  submitted(header, std::move(data));
  return true;
}

void UsbipDevice::submitted(const Header& header, Bytes data) {
  const std::uint32_t number = get_word(header, kNumber);
  const auto endpoint = static_cast<std::uint8_t>(get_word(header, kEndpoint));
  if (endpoint == 0) {
    const auto setup = std::span(header).subspan(kSetup, 8);
    control(number, {setup[0], setup[1], get_short(setup, 2), get_short(setup, 4), get_short(setup, 6)},
            std::move(data));
  } else if (get_word(header, kDirection) != 0) {
    waiting_.push_back(
        {number, static_cast<std::uint8_t>(endpoint | USB_DIR_IN), get_word(header, kSize), {}});
  } else if (out(endpoint, data) == Handshake::kAck) {
    complete(number, 0, {}, data.size());
  } else {
    complete(number, EPIPE, {}, 0);
  }
}

/// The host no longer wants an answer. Received data is not lost: then the transfer ends as it is, and the
/// kernel learns that it cancelled too late.
void UsbipDevice::unlinked(const Header& header) {
  const std::uint32_t victim = get_word(header, kUnlinkedNumber);
  const auto found = std::ranges::find(waiting_, victim, &Waiting::number);
  const bool in_time = found != waiting_.end() && found->bytes.empty();
  if (found != waiting_.end()) {
    if (!in_time) complete(victim, 0, found->bytes, found->bytes.size());
    waiting_.erase(found);
  }
  Header reply{};
  put_word(reply, kCommand, kUnlinked);
  put_word(reply, kNumber, get_word(header, kNumber));
  put_word(reply, kStatus, static_cast<std::uint32_t>(in_time ? -ECONNRESET : 0));
  send(reply, {});
}

void UsbipDevice::control(std::uint32_t number, const UsbSetup& setup, Bytes data) {
  const std::size_t sent = data.size();
  const bool is_standard = (setup.request_type & USB_TYPE_MASK) == USB_TYPE_STANDARD;
  Handshake handshake = is_standard ? standard(setup, data) : Handshake::kStall;
  if (handshake != Handshake::kAck) handshake = function_.control(setup, data);
  if (handshake != Handshake::kAck) {
    complete(number, EPIPE, {}, 0);
  } else if ((setup.request_type & USB_DIR_IN) == 0) {
    complete(number, 0, {}, sent);
  } else {
    data.resize(std::min<std::size_t>(data.size(), setup.length));
    complete(number, 0, data, data.size());
  }
}

Handshake UsbipDevice::out(std::uint8_t endpoint, std::span<const std::uint8_t> data) {
  if (halted_.contains(endpoint)) return Handshake::kStall;
  const Handshake handshake = function_.out(endpoint, data);
  if (handshake == Handshake::kStall) halted_.insert(endpoint);
  return handshake;
}

Handshake UsbipDevice::in(std::uint8_t endpoint, Bytes& packet) {
  if (halted_.contains(endpoint)) return Handshake::kStall;
  const Handshake handshake = function_.in(endpoint, packet);
  if (handshake == Handshake::kStall) halted_.insert(endpoint);
  return handshake;
}

Handshake UsbipDevice::standard(const UsbSetup& setup, Bytes& data) {
  switch (setup.request) {
    case USB_REQ_GET_STATUS: data = {0, 0}; return Handshake::kAck;
    case USB_REQ_CLEAR_FEATURE:
      if (setup.request_type == USB_RECIP_ENDPOINT && setup.value == USB_ENDPOINT_HALT)
        halted_.erase(static_cast<std::uint8_t>(setup.index));
      return Handshake::kAck;
    case USB_REQ_SET_FEATURE:
    case USB_REQ_SET_CONFIGURATION:
    case USB_REQ_SET_INTERFACE: return Handshake::kAck;
    case USB_REQ_GET_DESCRIPTOR:
      data = descriptor(setup);
      return data.empty() ? Handshake::kStall : Handshake::kAck;
    default: return Handshake::kStall;
  }
}

/// Empty if it does not exist.
Bytes UsbipDevice::descriptor(const UsbSetup& setup) const {
  const UsbIdentity& identity = description_.identity;
  const std::array names{identity.manufacturer_name, identity.product_name, identity.serial};
  const std::size_t number = setup.value & 0xFFU;
  switch (setup.value >> 8U) {
    case USB_DT_DEVICE: {
      Bytes bytes{USB_DT_DEVICE_SIZE, USB_DT_DEVICE, 0x00, 0x02, 0, 0, 0, 64};
      append_short(bytes, identity.vendor);
      append_short(bytes, identity.product);
      append_short(bytes, 0x0100);
      for (std::size_t i = 0; i < names.size(); ++i)
        bytes.push_back(static_cast<std::uint8_t>(names[i].empty() ? 0 : i + 1));
      bytes.push_back(1);
      return bytes;
    }
    case USB_DT_CONFIG: {
      const std::vector<UsbEndpoint>& endpoints = description_.endpoints;
      const std::size_t size = USB_DT_CONFIG_SIZE + USB_DT_INTERFACE_SIZE +
                               description_.class_descriptor.size() + endpoints.size() * USB_DT_ENDPOINT_SIZE;
      Bytes bytes{USB_DT_CONFIG_SIZE, USB_DT_CONFIG};
      append_short(bytes, size);
      const std::uint8_t count = static_cast<std::uint8_t>(endpoints.size());
      bytes.insert(bytes.end(), {1, 1, 0, USB_CONFIG_ATT_ONE, 50});
      bytes.insert(bytes.end(), {USB_DT_INTERFACE_SIZE, USB_DT_INTERFACE, 0, 0, count,
                                 description_.interface_class, 0, 0, 0});
      bytes.insert(bytes.end(), description_.class_descriptor.begin(), description_.class_descriptor.end());
      for (const UsbEndpoint& endpoint : endpoints) {
        const std::uint8_t kind = endpoint.interrupt ? USB_ENDPOINT_XFER_INT : USB_ENDPOINT_XFER_BULK;
        bytes.insert(bytes.end(), {USB_DT_ENDPOINT_SIZE, USB_DT_ENDPOINT, endpoint.address, kind});
        append_short(bytes, endpoint.packet_bytes);
        bytes.push_back(endpoint.interrupt ? 1 : 0);
      }
      return bytes;
    }
    case USB_DT_STRING: {
      if (number == 0) return {4, USB_DT_STRING, kEnglish & 0xFFU, kEnglish >> 8U};
      if (number > names.size() || names[number - 1].empty()) return {};
      return text_descriptor(names[number - 1]);
    }
    default: return {};
  }
}

std::size_t UsbipDevice::packet_bytes(std::uint8_t endpoint) const {
  const auto found = std::ranges::find(description_.endpoints, endpoint, &UsbEndpoint::address);
  return found != description_.endpoints.end() ? found->packet_bytes : 64;
}

void UsbipDevice::fill_waiting() {
  // Of an endpoint's transfers the first gets the packets; those behind it wait for their turn.
  std::uint32_t busy = 0;
  for (auto transfer = waiting_.begin(); transfer != waiting_.end();) {
    const std::uint32_t bit = 1U << (transfer->endpoint & USB_ENDPOINT_NUMBER_MASK);
    if ((busy & bit) != 0 || !fill(*transfer)) {
      busy |= bit;
      ++transfer;
    } else {
      transfer = waiting_.erase(transfer);
    }
  }
}

/// True when it is over.
bool UsbipDevice::fill(Waiting& transfer) {
  while (transfer.bytes.size() < transfer.room) {
    Bytes packet;
    switch (in(transfer.endpoint, packet)) {
      case Handshake::kNak: return false;
      case Handshake::kStall:
        complete(transfer.number, EPIPE, transfer.bytes, transfer.bytes.size());
        return true;
      case Handshake::kAck: break;
    }
    const bool is_short = packet.size() < packet_bytes(transfer.endpoint);
    transfer.bytes.insert(transfer.bytes.end(), packet.begin(), packet.end());
    if (is_short) break;
  }
  if (transfer.bytes.size() > transfer.room) {
    complete(transfer.number, EOVERFLOW, {}, 0);
  } else {
    complete(transfer.number, 0, transfer.bytes, transfer.bytes.size());
  }
  return true;
}

void UsbipDevice::complete(std::uint32_t number, int error, std::span<const std::uint8_t> data,
                           std::size_t size) {
  Header reply{};
  put_word(reply, kCommand, kSubmitted);
  put_word(reply, kNumber, number);
  put_word(reply, kStatus, static_cast<std::uint32_t>(-error));
  put_word(reply, kSize, static_cast<std::uint32_t>(size));
  send(reply, data);
}

/// A kernel that no longer listens has unplugged the device itself: the next read reports it.
void UsbipDevice::send(const Header& header, std::span<const std::uint8_t> data) const {
  Bytes packet(header.begin(), header.end());
  packet.insert(packet.end(), data.begin(), data.end());
  (void)!::send(socket_, packet.data(), packet.size(), MSG_NOSIGNAL);
}

}  // namespace guest
