#include "tests/support/mock_usb_device.h"

#include <fcntl.h>
#include <linux/usbdevice_fs.h>
#include <pty.h>
#include <sys/ioctl.h>
#include <termios.h>
#include <umockdev.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstddef>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <deque>
#include <map>
#include <mutex>
#include <set>
#include <stdexcept>
#include <system_error>
#include <utility>

namespace support {
namespace {

namespace fs = std::filesystem;

constexpr int kEndpointIn = 0x80;

[[noreturn]] void fail(const std::string& what, GError* error) {
  std::string text = "umockdev: " + what + ": " + (error != nullptr ? error->message : "no reason given");
  if (error != nullptr) g_error_free(error);
  throw std::runtime_error(text);
}

std::string three_digits(int number) {
  std::array<char, 16> text{};
  (void)std::snprintf(text.data(), text.size(), "%03d", number);
  return text.data();
}

std::string hex(const UsbBytes& bytes) {
  std::string text;
  for (const std::uint8_t byte : bytes) {
    std::array<char, 3> digits{};
    (void)std::snprintf(digits.data(), digits.size(), "%02x", static_cast<unsigned>(byte));
    text += digits.data();
  }
  return text;
}

std::string hex4(std::uint16_t number) {
  std::array<char, 8> text{};
  (void)std::snprintf(text.data(), text.size(), "%04x", static_cast<unsigned>(number));
  return text.data();
}

std::uint8_t low(int number) { return static_cast<std::uint8_t>(number & 0xFF); }
std::uint8_t high(int number) { return static_cast<std::uint8_t>(number >> 8 & 0xFF); }

/// A line of umockdev's description of a device.
std::string attribute(const std::string& name, const std::string& value) {
  return value.empty() ? "" : "A: " + name + "=" + value + "\\n\n";
}

}  // namespace

// umockdev's own question for that says no under its own wrapper (0.17).
bool in_mock_kernel() {
  const char* const preloaded = std::getenv("LD_PRELOAD");
  return preloaded != nullptr && std::strstr(preloaded, "libumockdev-preload") != nullptr;
}

UsbBytes bulk_pair_descriptors(std::uint16_t vendor, std::uint16_t product, std::uint16_t packet_bytes) {
  const std::uint8_t size_low = low(packet_bytes);
  const std::uint8_t size_high = high(packet_bytes);
  return {// device: USB 2.0, no class, endpoint 0 of 8 bytes, release 2.00, no strings, one configuration
          18, 1, 0x00, 0x02, 0, 0, 0, 8, low(vendor), high(vendor), low(product), high(product), 0x00, 0x02,
          0, 0, 0, 1,
          // configuration 1: 32 bytes, one interface, powered by the bus, 90 mA
          9, 2, 32, 0, 1, 1, 0, 0x80, 45,
          // interface 0: two endpoints, vendor's class
          9, 4, 0, 0, 2, 0xFF, 0xFF, 0xFF, 0,
          // endpoints
          7, 5, 0x81, 2, size_low, size_high, 0,  //
          7, 5, 0x02, 2, size_low, size_high, 0};
}

struct MockUsbBus::Testbed {
  UMockdevTestbed* umockdev = umockdev_testbed_new();
  ~Testbed() { g_object_unref(umockdev); }

  void add(const std::string& description) const {
    GError* error = nullptr;
    if (umockdev_testbed_add_from_string(umockdev, description.c_str(), &error) == 0) fail("add", error);
  }
};

MockUsbBus::MockUsbBus() : testbed_(std::make_unique<Testbed>()) {
  // Device, configuration, interface, and the interrupt endpoint at which a hub reports changes.
  const std::string hub =
      "12010002090001406b1d020001060302010109021900010100e0000904000001090000000705810304000c";
  testbed_->add(
      "P: /devices/usb1\nN: bus/usb/001/001\nE: SUBSYSTEM=usb\nE: DEVTYPE=usb_device\nE: BUSNUM=001\n"
      "E: DEVNUM=001\nE: DEVNAME=/dev/bus/usb/001/001\n" +
      attribute("bConfigurationValue", "1") + attribute("busnum", "1") + attribute("devnum", "1") +
      attribute("speed", "480") + attribute("idVendor", "1d6b") + attribute("idProduct", "0002") +
      "H: descriptors=" + hub + "\n\n");
}

MockUsbBus::~MockUsbBus() = default;

fs::path MockUsbBus::root() const {
  gchar* const path = umockdev_testbed_get_root_dir(testbed_->umockdev);
  fs::path root = path;
  g_free(path);
  return root;
}

// The handler's closure shares it: umockdev's thread may still be in it when the device's object goes.
struct MockUsbDevice::State {
  /// A transfer of the host's. The reference keeps the host's copy of the usbdevfs_urb.
  struct Transfer {
    UMockdevIoctlClient* client = nullptr;
    UMockdevIoctlData* data = nullptr;
    usbdevfs_urb& urb() const { return *reinterpret_cast<usbdevfs_urb*>(data->data); }
    int endpoint() const { return urb().endpoint; }
  };
  struct Packet {
    UsbBytes bytes;
    int error = 0;
  };

  UMockdevTestbed* testbed = nullptr;
  UMockdevIoctlBase* base = nullptr;
  MockUsbOptions options;
  std::string node;
  std::string sysfs;

  mutable std::recursive_mutex mutex;  // callbacks call send()
  std::function<int(const ControlRequest&)> control;
  std::function<int(int, const UsbBytes&)> out;
  MockUsbCounts counts;
  std::set<UMockdevIoctlClient*> clients;
  std::map<unsigned, UMockdevIoctlClient*> claims;
  std::deque<Transfer> pending;   // under way
  std::deque<Transfer> returned;  // for the host to fetch
  std::map<int, std::deque<Packet>> packets;
  std::set<int> halted;
  bool holding = false;
  int taken = 0;
  bool refusing = false;
  bool driver_bound = false;
  bool gone = false;
  bool ready = true;
  int terminal = -1;  // the pseudo-terminal's two ends
  int far_terminal = -1;

  void open_terminal();
  void set_ready(bool value);
  gboolean handle(UMockdevIoctlClient* client);
  void vanish(UMockdevIoctlClient* client);
  void unplug();

  void submit(UMockdevIoctlClient* client, UMockdevIoctlData* argument);
  void start(const Transfer& transfer);
  void finish(const Transfer& transfer, int status, std::size_t size);
  void take_out(const Transfer& transfer);
  void serve(int endpoint);
  bool discard(std::uintptr_t address);
  int claim(UMockdevIoctlClient* client, unsigned interface);
  UMockdevIoctlData* fetch(UMockdevIoctlClient* client);
};

// ---- readiness ----

void MockUsbDevice::State::open_terminal() {
  if (openpty(&far_terminal, &terminal, nullptr, nullptr, nullptr) != 0)
    throw std::runtime_error("no pseudo-terminal: " + std::generic_category().message(errno));
  termios settings{};
  tcgetattr(terminal, &settings);
  cfmakeraw(&settings);
  tcsetattr(terminal, TCSANOW, &settings);
  set_ready(false);
}

/// A terminal whose output is stopped cannot be written to.
void MockUsbDevice::State::set_ready(bool value) {
  if (terminal < 0 || ready == value) return;
  ready = value;
  tcflow(terminal, value ? TCOON : TCOOFF);
}

// ---- requests of the host ----

namespace {

/// The part of a request's argument that a pointer points to.
class Resolved {
 public:
  Resolved(UMockdevIoctlData* argument, std::size_t offset, std::size_t size)
      : data_(umockdev_ioctl_data_resolve(argument, offset, size, nullptr)) {}
  Resolved(const Resolved&) = delete;
  Resolved& operator=(const Resolved&) = delete;
  ~Resolved() {
    if (data_ != nullptr) umockdev_ioctl_data_unref(data_);
  }
  template <typename T>
  T& as() const {
    return *reinterpret_cast<T*>(data_->data);
  }

 private:
  UMockdevIoctlData* data_;
};

}  // namespace

gboolean MockUsbDevice::State::handle(UMockdevIoctlClient* client) {
  const std::lock_guard lock(mutex);
  UMockdevIoctlData* const argument = umockdev_ioctl_client_get_arg(client);
  const auto answer = [client](int error) {
    umockdev_ioctl_client_complete(client, error == 0 ? 0 : -1, error);
    return TRUE;
  };
  if (clients.insert(client).second) ++counts.opens;
  const unsigned long request = umockdev_ioctl_client_get_request(client);
  if (request == USBDEVFS_REAPURBNDELAY || request == USBDEVFS_REAPURB) {
    UMockdevIoctlData* const urb = fetch(client);
    if (urb == nullptr) return answer(gone ? ENODEV : EAGAIN);
    UMockdevIoctlData* const pointer = umockdev_ioctl_data_resolve(argument, 0, sizeof(void*), nullptr);
    umockdev_ioctl_data_set_ptr(pointer, 0, urb);
    umockdev_ioctl_data_unref(pointer);
    (void)answer(0);
    umockdev_ioctl_data_unref(urb);
    return TRUE;
  }
  if (gone) return answer(ENODEV);
  switch (request) {
    case USBDEVFS_GET_CAPABILITIES:
      Resolved(argument, 0, sizeof(std::uint32_t)).as<std::uint32_t>() =
          USBDEVFS_CAP_ZERO_PACKET | USBDEVFS_CAP_BULK_CONTINUATION | USBDEVFS_CAP_NO_PACKET_SIZE_LIM |
          USBDEVFS_CAP_REAP_AFTER_DISCONNECT;
      return answer(0);
    case USBDEVFS_CLAIMINTERFACE:
      return answer(claim(client, Resolved(argument, 0, sizeof(unsigned)).as<unsigned>()));
    case USBDEVFS_DISCONNECT_CLAIM: {
      const unsigned interface =
          Resolved(argument, 0, sizeof(usbdevfs_disconnect_claim)).as<usbdevfs_disconnect_claim>().interface;
      if (std::exchange(driver_bound, false)) ++counts.detached;
      return answer(claim(client, interface));
    }
    case USBDEVFS_RELEASEINTERFACE:
      ++counts.releases;
      claims.erase(Resolved(argument, 0, sizeof(unsigned)).as<unsigned>());
      return answer(0);
    case USBDEVFS_GETDRIVER: {
      const Resolved resolved(argument, 0, sizeof(usbdevfs_getdriver));
      auto& driver = resolved.as<usbdevfs_getdriver>();
      if (!driver_bound && !claims.contains(driver.interface)) return answer(ENODATA);
      (void)std::snprintf(driver.driver, sizeof driver.driver, "%s",
                          driver_bound ? options.driver.c_str() : "usbfs");
      return answer(0);
    }
    case USBDEVFS_IOCTL: {
      const int code = Resolved(argument, 0, sizeof(usbdevfs_ioctl)).as<usbdevfs_ioctl>().ioctl_code;
      if (code != static_cast<int>(USBDEVFS_CONNECT)) return answer(ENODATA);
      ++counts.attached;
      driver_bound = !options.driver.empty();
      return answer(0);
    }
    case USBDEVFS_CLEAR_HALT: {
      const int endpoint = static_cast<int>(Resolved(argument, 0, sizeof(unsigned)).as<unsigned>());
      ++counts.clear_halts;
      counts.under_way_at_clear_halt +=
          static_cast<int>(std::ranges::count(pending, endpoint, &Transfer::endpoint));
      halted.erase(endpoint);
      return answer(0);
    }
    case USBDEVFS_SUBMITURB: submit(client, argument); return TRUE;
    case USBDEVFS_DISCARDURB: {
      std::uintptr_t address = 0;
      std::memcpy(&address, argument->data, sizeof address);
      return answer(discard(address) ? 0 : EINVAL);
    }
    default: break;
  }
  std::fprintf(stderr, "mocked USB device: request %#lx is not known\n", request);
  return answer(ENOTTY);
}

int MockUsbDevice::State::claim(UMockdevIoctlClient* client, unsigned interface) {
  if (refusing || driver_bound) return EBUSY;
  const auto [place, fresh] = claims.emplace(interface, client);
  if (!fresh && place->second != client) return EBUSY;
  ++counts.claims;
  return 0;
}

/// The host closed the node.
void MockUsbDevice::State::vanish(UMockdevIoctlClient* client) {
  const std::lock_guard lock(mutex);
  clients.erase(client);
  std::erase_if(claims, [client](const auto& claim) { return claim.second == client; });
  for (auto* const list : {&pending, &returned}) {
    std::erase_if(*list, [client](const Transfer& transfer) {
      if (transfer.client == client) umockdev_ioctl_data_unref(transfer.data);
      return transfer.client == client;
    });
  }
}

// ---- transfers ----

void MockUsbDevice::State::submit(UMockdevIoctlClient* client, UMockdevIoctlData* argument) {
  const Transfer transfer{client, umockdev_ioctl_data_resolve(argument, 0, sizeof(usbdevfs_urb), nullptr)};
  if (transfer.urb().buffer_length > 0) {
    // Brings the host's bytes here and stays a part of the urb, with which they go back.
    umockdev_ioctl_data_unref(
        umockdev_ioctl_data_resolve(transfer.data, offsetof(usbdevfs_urb, buffer),
                                    static_cast<std::size_t>(transfer.urb().buffer_length), nullptr));
  }
  start(transfer);
  umockdev_ioctl_client_complete(client, 0, 0);
}

void MockUsbDevice::State::start(const Transfer& transfer) {
  if (transfer.urb().type == USBDEVFS_URB_TYPE_CONTROL) {
    const auto* const setup = static_cast<const std::uint8_t*>(transfer.urb().buffer);
    const auto word = [setup](int at) { return static_cast<std::uint16_t>(setup[at] | setup[at + 1] << 8); };
    const ControlRequest request{setup[0], setup[1], word(2), word(4)};
    const bool to_device = (request.type & kEndpointIn) == 0;
    finish(transfer, !to_device ? -EPIPE : control ? control(request) : 0, 0);
  } else if ((transfer.endpoint() & kEndpointIn) != 0) {
    ++counts.in_submitted;
    if (halted.contains(transfer.endpoint())) return finish(transfer, -EPIPE, 0);
    pending.push_back(transfer);
    serve(transfer.endpoint());
  } else {
    ++counts.out_submitted;
    if (halted.contains(transfer.endpoint())) return finish(transfer, -EPIPE, 0);
    holding ? pending.push_back(transfer) : take_out(transfer);
  }
}

void MockUsbDevice::State::finish(const Transfer& transfer, int status, std::size_t size) {
  transfer.urb().status = status;
  transfer.urb().actual_length = static_cast<int>(size);
  returned.push_back(transfer);
  set_ready(true);
}

void MockUsbDevice::State::take_out(const Transfer& transfer) {
  const auto* const begin = static_cast<const std::uint8_t*>(transfer.urb().buffer);
  const UsbBytes bytes(begin, begin + transfer.urb().buffer_length);
  // Returned before the device's answer.
  finish(transfer, 0, bytes.size());
  const int error = out ? out(transfer.endpoint(), bytes) : 0;
  if (error == 0) return;
  if (error == -EPIPE) halted.insert(transfer.endpoint());
  transfer.urb().status = error;
  transfer.urb().actual_length = 0;
}

/// Packets to the transfers that wait for them.
void MockUsbDevice::State::serve(int endpoint) {
  std::deque<Packet>& queue = packets[endpoint];
  while (!queue.empty() && !halted.contains(endpoint)) {
    const auto found = std::ranges::find(pending, endpoint, &Transfer::endpoint);
    if (found == pending.end()) return;
    const Transfer transfer = *found;
    pending.erase(found);
    const Packet packet = std::move(queue.front());
    queue.pop_front();
    if (packet.error == -EPIPE) halted.insert(endpoint);
    const std::size_t room = static_cast<std::size_t>(transfer.urb().buffer_length);
    const std::size_t size = std::min(packet.bytes.size(), room);
    std::copy_n(packet.bytes.begin(), size, static_cast<std::uint8_t*>(transfer.urb().buffer));
    finish(transfer, packet.error != 0 ? packet.error : packet.bytes.size() > room ? -EOVERFLOW : 0, size);
  }
}

/// Empty when the host has nothing to fetch.
UMockdevIoctlData* MockUsbDevice::State::fetch(UMockdevIoctlClient* client) {
  const auto own = [client](const Transfer& transfer) { return transfer.client == client; };
  const auto found = std::ranges::find_if(returned, own);
  UMockdevIoctlData* const data = found == returned.end() ? nullptr : found->data;
  if (found != returned.end()) returned.erase(found);
  set_ready(!returned.empty());
  return data;
}

bool MockUsbDevice::State::discard(std::uintptr_t address) {
  const auto meant = [address](const Transfer& transfer) { return transfer.data->client_addr == address; };
  const auto found = std::ranges::find_if(pending, meant);
  if (found == pending.end()) return false;
  const Transfer transfer = *found;
  pending.erase(found);
  ++counts.discarded;
  const bool is_out = (transfer.endpoint() & kEndpointIn) == 0;
  finish(transfer, -ENOENT, is_out ? static_cast<std::size_t>(taken) : 0);
  return true;
}

// ---- plugging ----

void MockUsbDevice::State::unplug() {
  {
    const std::lock_guard lock(mutex);
    if (std::exchange(gone, true)) return;
    for (const Transfer& transfer : std::exchange(pending, {})) finish(transfer, -ESHUTDOWN, 0);
    for (int* const end : {&terminal, &far_terminal}) close(std::exchange(*end, -1));
  }
  const std::string interface = sysfs + "/" + fs::path(sysfs).filename().string() + ":1.0";
  for (const std::string& path : {interface, sysfs}) {
    umockdev_testbed_uevent(testbed, path.c_str(), "remove");
    umockdev_testbed_remove_device(testbed, path.c_str());
  }
}

MockUsbDevice::MockUsbDevice(MockUsbBus& bus, MockUsbOptions options) : state_(std::make_shared<State>()) {
  State& state = *state_;
  state.testbed = bus.testbed_->umockdev;
  state.options = std::move(options);
  const MockUsbOptions& given = state.options;
  const std::string name = "1-" + std::to_string(given.port);
  const std::string node = "bus/usb/001/" + three_digits(given.address);
  state.node = "/dev/" + node;
  state.sysfs = "/sys/devices/usb1/" + name;
  state.driver_bound = !given.driver.empty();

  state.base = umockdev_ioctl_base_new();
  const auto connect = [&](const char* signal, GCallback callback) {
    const GClosureNotify release = [](gpointer shared, GClosure*) {
      delete static_cast<std::shared_ptr<State>*>(shared);
    };
    g_signal_connect_data(state.base, signal, callback, new std::shared_ptr<State>(state_), release,
                          GConnectFlags{});
  };
  connect("handle-ioctl", G_CALLBACK(+[](UMockdevIoctlBase*, UMockdevIoctlClient* client, gpointer shared) {
            return (*static_cast<std::shared_ptr<State>*>(shared))->handle(client);
          }));
  connect("client-vanished",
          G_CALLBACK(+[](UMockdevIoctlBase*, UMockdevIoctlClient* client, gpointer shared) {
            (*static_cast<std::shared_ptr<State>*>(shared))->vanish(client);
          }));
  GError* error = nullptr;
  if (umockdev_testbed_attach_ioctl(state.testbed, state.node.c_str(), state.base, &error) == 0)
    fail("attach " + state.node, error);

  state.open_terminal();
  const UsbBytes descriptors =
      given.descriptors.empty() ? bulk_pair_descriptors(given.vendor, given.product) : given.descriptors;
  const std::string numbers = "E: BUSNUM=001\nE: DEVNUM=" + three_digits(given.address) + "\n";
  const std::string driver_link =
      given.driver.empty() ? "" : "L: driver=../../../../bus/usb/drivers/" + given.driver + "\n";
  bus.testbed_->add("P: /devices/usb1/" + name + "\nN: " + node +
                    "\nE: SUBSYSTEM=usb\nE: DEVTYPE=usb_device\nE: DEVNAME=" + state.node + "\n" + numbers +
                    attribute("bConfigurationValue", "1") + attribute("busnum", "1") +
                    attribute("devnum", std::to_string(given.address)) +
                    attribute("speed", std::to_string(given.speed_Mbit_per_s)) +
                    attribute("idVendor", hex4(given.vendor)) + attribute("idProduct", hex4(given.product)) +
                    attribute("manufacturer", given.manufacturer) + attribute("product", given.product_name) +
                    attribute("serial", given.serial) + "H: descriptors=" + hex(descriptors) +
                    "\n\nP: /devices/usb1/" + name + "/" + name +
                    ":1.0\nE: SUBSYSTEM=usb\nE: DEVTYPE=usb_interface\n" +
                    attribute("bInterfaceNumber", "00") + driver_link + "\n");
  const fs::path file = bus.root() / state.node.substr(1);
  std::array<char, 64> terminal{};
  ptsname_r(state.far_terminal, terminal.data(), terminal.size());
  fs::remove(file);
  fs::create_symlink(terminal.data(), file);
}

MockUsbDevice::~MockUsbDevice() {
  unplug();
  on_control({});
  on_out({});
  umockdev_testbed_detach_ioctl(state_->testbed, state_->node.c_str(), nullptr);
  g_object_unref(state_->base);
}

void MockUsbDevice::on_control(std::function<int(const ControlRequest&)> callback) {
  const std::lock_guard lock(state_->mutex);
  state_->control = std::move(callback);
}

void MockUsbDevice::on_out(std::function<int(int, const UsbBytes&)> callback) {
  const std::lock_guard lock(state_->mutex);
  state_->out = std::move(callback);
}

void MockUsbDevice::send(int endpoint, const UsbBytes& packet) {
  const std::lock_guard lock(state_->mutex);
  state_->packets[endpoint].push_back({packet, 0});
  state_->serve(endpoint);
}

void MockUsbDevice::fail_in(int endpoint, int error) {
  const std::lock_guard lock(state_->mutex);
  state_->packets[endpoint].push_back({{}, error});
  state_->serve(endpoint);
}

void MockUsbDevice::forget(int endpoint) {
  const std::lock_guard lock(state_->mutex);
  state_->packets[endpoint].clear();
}

void MockUsbDevice::hold_out(int taken) {
  const std::lock_guard lock(state_->mutex);
  state_->holding = true;
  state_->taken = taken;
}

void MockUsbDevice::release_out() {
  const std::lock_guard lock(state_->mutex);
  state_->holding = false;
  for (const State::Transfer& transfer : std::exchange(state_->pending, {})) {
    (transfer.endpoint() & kEndpointIn) != 0 ? state_->pending.push_back(transfer)
                                             : state_->take_out(transfer);
  }
}

void MockUsbDevice::refuse_claims(bool refuse) {
  const std::lock_guard lock(state_->mutex);
  state_->refusing = refuse;
}

void MockUsbDevice::unplug() { state_->unplug(); }

MockUsbCounts MockUsbDevice::counts() const {
  const std::lock_guard lock(state_->mutex);
  return state_->counts;
}

int MockUsbDevice::listening() const {
  const std::lock_guard lock(state_->mutex);
  return static_cast<int>(std::ranges::count_if(state_->pending, [](const State::Transfer& transfer) {
    return (transfer.endpoint() & kEndpointIn) != 0;
  }));
}

int MockUsbDevice::waiting() const {
  const std::lock_guard lock(state_->mutex);
  std::size_t count = 0;
  for (const auto& [endpoint, queue] : state_->packets) count += queue.size();
  return static_cast<int>(count);
}

std::string MockUsbDevice::node() const { return state_->node; }

}  // namespace support
