/// @file
/// HID devices that only programs under umockdev's preload see: in sysfs, where drivers/haptic finds them,
/// and as /dev/hidraw0, /dev/hidraw1 and so on, which behave as the kernel's: each opener gets all reports
/// that come while it has the node open, poll() tells when there are some, and unplugging hangs up.
///
/// What behaves like a real node in poll() is a pseudo terminal: one byte waits in it for each report. The
/// reports themselves are handed over by umockdev's thread.
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
  /// Reports that wait for an opener; what comes when there are so many is dropped, as by the kernel.
  std::size_t queue = 63;
  bool refuses_output = false;     ///< writes fail: EPIPE
  bool refuses_questions = false;  ///< ioctls fail: ENOTTY, as with what is no HID node
};

class MockHidrawDevice {
 public:
  using Bytes = std::vector<std::uint8_t>;

  const std::string& path() const;
  /// For all who have it open now. When this returns, poll() tells.
  void send(const Bytes& report);
  /// What was written so far.
  std::vector<Bytes> outputs() const;
  int openers() const;  ///< ever
  /// Reads that a real node would have blocked.
  int reads_without_report() const;
  /// Gone: from sysfs as well, and for all who have it open.
  void unplug();

 private:
  friend class MockHidrawBus;
  struct State;
  explicit MockHidrawDevice(std::shared_ptr<State> state) : state_(std::move(state)) {}
  std::shared_ptr<State> state_;  // umockdev's thread may still be in it when we are gone
};

/// The machine that they are plugged into. One of them at a time in a process; goes with its devices.
class MockHidrawBus {
 public:
  MockHidrawBus();
  MockHidrawBus(const MockHidrawBus&) = delete;
  MockHidrawBus& operator=(const MockHidrawBus&) = delete;
  ~MockHidrawBus();

  /// Throws std::runtime_error when it cannot be mocked.
  MockHidrawDevice& plug(const MockHidrawOptions& options);

 private:
  struct Testbed;
  std::unique_ptr<Testbed> testbed_;
  std::vector<std::unique_ptr<MockHidrawDevice>> devices_;
};

}  // namespace support
