#include "tests/support/mock_hidraw_device.h"

#include <fcntl.h>
#include <linux/hidraw.h>
#include <pty.h>
#include <sys/ioctl.h>
#include <termios.h>
#include <umockdev.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <deque>
#include <filesystem>
#include <mutex>
#include <stdexcept>
#include <system_error>
#include <thread>
#include <utility>

namespace support {
namespace {

struct Unref {
  void operator()(void* object) const { g_object_unref(object); }
};
struct Free {
  void operator()(void* memory) const { g_free(memory); }
};

std::runtime_error failed(const std::string& what) {
  return std::runtime_error(what + ": " + std::generic_category().message(errno));
}

void check(bool fulfilled, GError* error, const std::string& what) {
  if (fulfilled) return;
  const std::string why = error != nullptr ? error->message : "refused";
  g_clear_error(&error);
  throw std::runtime_error(what + ": " + why);
}

std::string hex(unsigned value, int digits) {
  std::array<char, 16> text{};
  (void)std::snprintf(text.data(), text.size(), "%0*X", digits, value);
  return text.data();
}

/// One end is the opened node, the other is ours.
class Terminal {
 public:
  Terminal() {
    if (openpty(&master_, &slave_, nullptr, nullptr, nullptr) != 0) throw failed("open a pseudo terminal");
    termios settings{};
    tcgetattr(slave_, &settings);
    cfmakeraw(&settings);
    tcsetattr(slave_, TCSANOW, &settings);
  }
  Terminal(const Terminal&) = delete;
  Terminal& operator=(const Terminal&) = delete;
  ~Terminal() { hang_up(); }

  void hang_up() {
    if (master_ >= 0) ::close(master_);
    if (slave_ >= 0) ::close(slave_);
    master_ = slave_ = -1;
  }
  std::string path() const {
    std::array<char, 64> name{};
    if (ptsname_r(master_, name.data(), name.size()) != 0) throw failed("name a pseudo terminal");
    return name.data();
  }
  /// The kernel passes bytes on in the background: waits until so many are there.
  void put_one_of(std::size_t waiting) {
    if (::write(master_, "r", 1) != 1) throw failed("write to a pseudo terminal");
    const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(60);
    for (int there = 0; std::cmp_less(there, waiting);) {
      if (::ioctl(slave_, FIONREAD, &there) != 0) throw failed("ask a pseudo terminal");
      if (std::chrono::steady_clock::now() > deadline)
        throw std::runtime_error("a pseudo terminal keeps a byte to itself");
      std::this_thread::yield();
    }
  }
  void take_one() {
    char byte = 0;
    (void)!::read(slave_, &byte, 1);
  }

 private:
  int master_ = -1;
  int slave_ = -1;
};

/// What one open() of the node has got.
struct Opener {
  Terminal terminal;
  std::deque<MockHidrawDevice::Bytes> reports;
};

}  // namespace

struct MockHidrawDevice::State {
  MockHidrawOptions options;
  std::string path;
  std::string sys_path;
  std::filesystem::path node;  // the symbolic link that is opened
  UMockdevTestbed* testbed = nullptr;

  mutable std::mutex mutex;
  std::unique_ptr<Opener> next;  // given to the next opener of the node
  std::vector<std::unique_ptr<Opener>> openers;
  std::vector<Bytes> outputs;
  int reads_without_report = 0;
  bool unplugged = false;

  void prepare_next() {
    next = std::make_unique<Opener>();
    std::filesystem::remove(node);
    std::filesystem::create_symlink(next->terminal.path(), node);
  }

  // umockdev's thread, from here on.

  /// An open() asks nothing that we could answer, but its first ioctl() follows.
  Opener& opener(UMockdevIoctlClient* client) {
    constexpr const char* kKey = "opener";
    if (void* known = g_object_get_data(G_OBJECT(client), kKey)) return *static_cast<Opener*>(known);
    openers.push_back(std::move(next));
    prepare_next();
    g_object_set_data(G_OBJECT(client), kKey, openers.back().get());
    return *openers.back();
  }

  void answer_ioctl(UMockdevIoctlClient* client) {
    const std::scoped_lock lock(mutex);
    if (unplugged) return umockdev_ioctl_client_complete(client, -1, ENODEV);
    opener(client);
    if (options.refuses_questions || umockdev_ioctl_client_get_request(client) != HIDIOCGRDESCSIZE)
      return umockdev_ioctl_client_complete(client, -1, ENOTTY);
    const int size = static_cast<int>(options.report_descriptor.size());
    UMockdevIoctlData* data =
        umockdev_ioctl_data_resolve(umockdev_ioctl_client_get_arg(client), 0, sizeof(size), nullptr);
    std::memcpy(data->data, &size, sizeof(size));
    umockdev_ioctl_data_unref(data);
    umockdev_ioctl_client_complete(client, 0, 0);
  }

  void answer_read(UMockdevIoctlClient* client) {
    const std::scoped_lock lock(mutex);
    if (unplugged) return umockdev_ioctl_client_complete(client, -1, EIO);
    Opener& its = opener(client);
    if (its.reports.empty()) {
      ++reads_without_report;
      return umockdev_ioctl_client_complete(client, -1, EAGAIN);
    }
    const Bytes report = std::move(its.reports.front());
    its.reports.pop_front();
    its.terminal.take_one();
    UMockdevIoctlData* buffer = umockdev_ioctl_client_get_arg(client);
    const std::size_t size = std::min(report.size(), static_cast<std::size_t>(buffer->data_len));
    std::copy_n(report.begin(), size, buffer->data);
    umockdev_ioctl_client_complete(client, static_cast<glong>(size), 0);
  }

  void answer_write(UMockdevIoctlClient* client) {
    const std::scoped_lock lock(mutex);
    if (unplugged) return umockdev_ioctl_client_complete(client, -1, ENODEV);
    if (options.refuses_output) return umockdev_ioctl_client_complete(client, -1, EPIPE);
    const UMockdevIoctlData* bytes = umockdev_ioctl_client_get_arg(client);
    outputs.emplace_back(bytes->data, bytes->data + bytes->data_len);
    umockdev_ioctl_client_complete(client, bytes->data_len, 0);
  }
};

struct MockHidrawBus::Testbed {
  std::unique_ptr<UMockdevTestbed, Unref> umockdev{umockdev_testbed_new()};

  std::filesystem::path root() const {
    const std::unique_ptr<char, Free> path(umockdev_testbed_get_root_dir(umockdev.get()));
    return path.get();
  }
};

bool runs_under_umockdev() {
  const char* preloaded = std::getenv("LD_PRELOAD");
  return preloaded != nullptr && std::strstr(preloaded, "libumockdev-preload") != nullptr;
}

const std::string& MockHidrawDevice::path() const { return state_->path; }

void MockHidrawDevice::send(const Bytes& report) {
  const std::scoped_lock lock(state_->mutex);
  for (auto& opener : state_->openers) {
    if (opener->reports.size() >= state_->options.queue) continue;
    opener->reports.push_back(report);
    opener->terminal.put_one_of(opener->reports.size());
  }
}

std::vector<MockHidrawDevice::Bytes> MockHidrawDevice::outputs() const {
  const std::scoped_lock lock(state_->mutex);
  return state_->outputs;
}

int MockHidrawDevice::openers() const {
  const std::scoped_lock lock(state_->mutex);
  return static_cast<int>(state_->openers.size());
}

int MockHidrawDevice::reads_without_report() const {
  const std::scoped_lock lock(state_->mutex);
  return state_->reads_without_report;
}

void MockHidrawDevice::unplug() {
  {
    const std::scoped_lock lock(state_->mutex);
    state_->unplugged = true;
    for (auto& opener : state_->openers) opener->terminal.hang_up();
  }
  umockdev_testbed_uevent(state_->testbed, state_->sys_path.c_str(), "remove");
  umockdev_testbed_remove_device(state_->testbed, state_->sys_path.c_str());
}

MockHidrawBus::MockHidrawBus() : testbed_(std::make_unique<Testbed>()) {
  // When this program leads its session, the first terminal that it opens becomes its own, and hangs it up.
  std::signal(SIGHUP, SIG_IGN);
}

MockHidrawBus::~MockHidrawBus() = default;

MockHidrawDevice& MockHidrawBus::plug(const MockHidrawOptions& options) {
  const std::string number = std::to_string(devices_.size());
  auto state = std::make_shared<MockHidrawDevice::State>();
  state->options = options;
  state->path = "/dev/hidraw" + number;
  state->testbed = testbed_->umockdev.get();
  state->node = testbed_->root() / "dev" / ("hidraw" + number);

  const std::unique_ptr<UMockdevIoctlBase, Unref> handler(umockdev_ioctl_base_new());
  using State = MockHidrawDevice::State;
  using Shared = std::shared_ptr<State>;
  const auto connect = [&](const char* signal, GCallback callback) {
    g_signal_connect_data(
        handler.get(), signal, callback, new Shared(state),
        [](gpointer shared, GClosure*) { delete static_cast<Shared*>(shared); }, GConnectFlags{});
  };
  using Callback = gboolean (*)(UMockdevIoctlBase*, UMockdevIoctlClient*, Shared*);
  const Callback on_ioctl = [](UMockdevIoctlBase*, UMockdevIoctlClient* client, Shared* its) -> gboolean {
    (*its)->answer_ioctl(client);
    return TRUE;
  };
  const Callback on_read = [](UMockdevIoctlBase*, UMockdevIoctlClient* client, Shared* its) -> gboolean {
    (*its)->answer_read(client);
    return TRUE;
  };
  const Callback on_write = [](UMockdevIoctlBase*, UMockdevIoctlClient* client, Shared* its) -> gboolean {
    (*its)->answer_write(client);
    return TRUE;
  };
  connect("handle-ioctl", G_CALLBACK(on_ioctl));
  connect("handle-read", G_CALLBACK(on_read));
  connect("handle-write", G_CALLBACK(on_write));
  GError* error = nullptr;
  check(umockdev_testbed_attach_ioctl(state->testbed, state->path.c_str(), handler.get(), &error) != 0, error,
        "mock the calls of " + state->path);

  std::string descriptor;
  for (const std::uint8_t byte : options.report_descriptor) descriptor += hex(byte, 2);
  const std::string usb = "/devices/pci0000:00/usb1/1-" + std::to_string(devices_.size() + 1);
  const std::string interface =
      usb + "/1-" + std::to_string(devices_.size() + 1) + ":1." + std::to_string(options.usb_interface);
  const std::string hid = "0003:" + hex(options.vendor, 4) + ":" + hex(options.product, 4) + "." +
                          hex(static_cast<unsigned>(devices_.size()) + 1, 4);
  const std::string hidraw = interface + "/" + hid + "/hidraw/hidraw" + number;
  state->sys_path = "/sys" + hidraw;
  // The kernel's device tree, from the USB device to the node.
  const std::string tree =
      "P: " + usb +
      "\nE: SUBSYSTEM=usb\nE: DEVTYPE=usb_device\nA: manufacturer=mock\\n\nA: product=" + options.name +
      "\\n\nA: bcdDevice=0100\\n\n\n" +                                                                 //
      "P: " + interface + "\nE: SUBSYSTEM=usb\nE: DEVTYPE=usb_interface\nA: bInterfaceNumber=" +        //
      hex(static_cast<unsigned>(options.usb_interface), 2) + "\\n\n\n" +                                //
      "P: " + interface + "/" + hid + "\nE: SUBSYSTEM=hid\nE: HID_ID=0003:" + hex(options.vendor, 8) +  //
      ":" + hex(options.product, 8) + "\nE: HID_NAME=" + options.name + "\nE: HID_UNIQ=" + options.serial +
      "\n" + (descriptor.empty() ? "" : "H: report_descriptor=" + descriptor + "\n") + "\n" +  //
      "P: " + hidraw + "\nN: hidraw" + number + "\nE: SUBSYSTEM=hidraw\nE: DEVNAME=/dev/hidraw" + number +
      "\nE: MAJOR=242\nE: MINOR=" + number + "\nA: dev=242:" + number + "\\n\nL: device=../../../" + hid +
      "\n\n";
  check(umockdev_testbed_add_from_string(state->testbed, tree.c_str(), &error) != 0, error,
        "mock " + state->path);
  state->prepare_next();
  devices_.push_back(std::unique_ptr<MockHidrawDevice>(new MockHidrawDevice(std::move(state))));
  return *devices_.back();
}

}  // namespace support
