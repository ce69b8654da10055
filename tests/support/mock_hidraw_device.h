/// @file
/// HID devices that are only visible under umockdev's preload: in sysfs, where drivers/haptic finds them, and
/// as /dev/hidraw0, /dev/hidraw1 and so on, which behave like the kernel's: each opener gets all reports that
/// arrive while it has the node open, poll() reports them, and unplugging hangs up.
///
/// A pseudo terminal behaves like a real node in poll(): one byte waits in it for each report. umockdev's
/// thread passes the reports themselves.
#pragma once
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

namespace support {

/// False: this program was started without the preload.
bool runs_under_umockdev();

struct MockHidrawOptions {
  std::uint16_t vendor = 0;
  std::uint16_t product = 0;
  std::vector<std::uint8_t> report_descriptor{};
  std::string name = "mocked device";
  std::string serial{};
  int usb_interface = 0;
  /// Reports that wait for an opener; further ones are dropped, as by the kernel.
  std::size_t queue = 63;
  bool refuses_output = false;     ///< writes fail: EPIPE
  bool refuses_questions = false;  ///< ioctls fail: ENOTTY, as for a node that is not HID
};

class MockHidrawDevice {
 public:
  using Bytes = std::vector<std::uint8_t>;

  const std::string& path() const;
  /// For all current openers. After it returns, poll() reports it.
  void send(const Bytes& report);
  /// What was written so far.
  std::vector<Bytes> outputs() const;
  int openers() const;  ///< total
  /// Reads that a real node would have blocked.
  int reads_without_report() const;
  /// Removed: from sysfs as well, and for all openers.
  void unplug();

 private:
  friend class MockHidrawBus;
  struct State;
  explicit MockHidrawDevice(std::shared_ptr<State> state) : state_(std::move(state)) {}
  std::shared_ptr<State> state_;  // umockdev's thread may still use it after our destruction
};

/// The machine that they are plugged into. One at a time per process; must be destroyed with its devices.
class MockHidrawBus {
 public:
  MockHidrawBus();
  MockHidrawBus(const MockHidrawBus&) = delete;
  MockHidrawBus& operator=(const MockHidrawBus&) = delete;
  ~MockHidrawBus();

  /// Throws std::runtime_error if it cannot be mocked.
  MockHidrawDevice& plug(const MockHidrawOptions& options);

 private:
  struct Testbed;
  std::unique_ptr<Testbed> testbed_;
  std::vector<std::unique_ptr<MockHidrawDevice>> devices_;
};

}  // namespace support
