#include "drivers/haptic/falcon_boot.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdio>
#include <optional>
#include <vector>

#include "drivers/haptic/falcon_packet.h"
#include "drivers/usb/ftdi_serial.h"

namespace drivers::haptic::falcon {
namespace {

namespace ftdi = usb::ftdi;
using ftdi::Request;
using std::chrono::nanoseconds;
using Bytes = std::vector<std::uint8_t>;

constexpr std::array<std::uint8_t, 3> kQuery{0x0A, 0x43, 0x0D};
constexpr std::array<std::uint8_t, 4> kQueryAnswer{0x0A, 0x44, 0x2C, 0x0D};
constexpr std::array<std::uint8_t, 1> kLoadRequest{0x41};
constexpr std::size_t kChunkBytes = ftdi::kPacketBytes - ftdi::kModemStatusBytes;  // its echo is one packet
constexpr std::uint16_t kRunLatency_ms = 1;
constexpr std::uint16_t kBootLatency_ms = 16;

std::string hex(std::span<const std::uint8_t> bytes) {
  if (bytes.empty()) return "nothing";
  constexpr std::size_t kShown = 16;
  std::string text;
  for (const std::uint8_t byte : bytes.first(std::min(bytes.size(), kShown))) {
    std::array<char, 4> digits{};
    (void)std::snprintf(digits.data(), digits.size(), "%02X ", static_cast<unsigned>(byte));
    text += digits.data();
  }
  text.pop_back();
  return bytes.size() > kShown ? text + " ..." : text;
}

/// One attempt after the other to get a device going; every step knows what to say when it fails.
class Boot {
 public:
  Boot(usb::UsbPort& port, const BootConfig& config) : port_(port), config_(config) {}

  bool firmware_answers() {
    run_mode();
    const std::string step = "ask the firmware";
    const Packet packet = encode(Command{});
    ReplyStream stream;
    for (int i = 0; i < config_.alive_packets; ++i) {
      write(packet, step);
      const nanoseconds deadline = port_.now() + config_.alive_timeout;
      Bytes bytes;
      while (receive(bytes, deadline, step)) {
        if (stream.feed(bytes)) return true;
        bytes.clear();
      }
    }
    return false;
  }

  /// What went wrong in this attempt, if it may go better in another one.
  std::optional<SetupError::Report> load(std::span<const std::uint8_t> image) {
    reset_into_boot_loader();
    query();
    if (auto failure = enter_load_mode()) return failure;
    if (auto failure = send(image)) return failure;
    if (firmware_answers()) return std::nullopt;
    return SetupError::Report{config_.device, "run the firmware",
                              "replies once " + std::to_string(image.size()) + " bytes were loaded",
                              "no reply",
                              "the image went over but does not run: check that the file is a "
                              "Falcon's firmware image, whole and unpacked"};
  }

  [[noreturn]] void fail_without_image() const {
    throw SetupError({config_.device, "load the firmware", "a firmware image",
                      "none, and no firmware running",
                      "name the image file that came with the device's driver; it is not part of this "
                      "software"});
  }

 private:
  void run_mode() {
    const std::string step = "set the serial line to run mode";
    control(Request::kLatencyTimer, kRunLatency_ms, step);
    control(Request::kBaudDivisor, ftdi::kDivisor1500000, step);
    purge(step);
  }

  /// A rising DTR wakes the boot loader.
  void reset_into_boot_loader() {
    const std::string step = "set the serial line to boot mode";
    purge(step);
    control(Request::kLatencyTimer, kBootLatency_ms, step);
    control(Request::kBaudDivisor, ftdi::kDivisor9600, step);
    control(Request::kLineFormat, ftdi::kEightBitsNoParityOneStop, step);
    control(Request::kFlowControl, 0, step);
    control(Request::kModemControl, ftdi::kRtsLow, step);
    control(Request::kModemControl, ftdi::kDtrLow, step);
    control(Request::kModemControl, ftdi::kDtrHigh, step);
  }

  void query() {
    const std::string step = "ask the boot loader";
    Bytes found;
    for (int i = 0; i < config_.query_attempts; ++i) {
      write(kQuery, step);
      const nanoseconds deadline = port_.now() + config_.query_timeout;
      Bytes bytes;
      do {
        // A zero or noise of the reset may stand in front.
        const auto answer = std::search(bytes.begin(), bytes.end(), kQueryAnswer.begin(), kQueryAnswer.end());
        if (answer != bytes.end()) return;
      } while (receive(bytes, deadline, step));
      if (!bytes.empty()) found = bytes;
      purge(step);
    }
    throw SetupError(
        {config_.device, step, hex(kQueryAnswer), hex(found),
         "no answer in " + std::to_string(config_.query_attempts) +
             " attempts: check that its power supply is connected; unplug power and USB, wait, plug "
             "in power first; try another USB port, without a hub"});
  }

  std::optional<SetupError::Report> enter_load_mode() {
    const std::string step = "enter load mode";
    control(Request::kModemControl, ftdi::kDtrLow, step);
    control(Request::kBaudDivisor, ftdi::kDivisor142857, step);
    const Bytes echo = exchange(kLoadRequest, step);
    if (std::ranges::equal(echo, kLoadRequest)) return std::nullopt;
    return SetupError::Report{config_.device, step, hex(kLoadRequest), hex(echo),
                              "switch the device's power off and on; try another USB port"};
  }

  std::optional<SetupError::Report> send(std::span<const std::uint8_t> image) {
    const std::string step = "load the firmware";
    const std::string hint =
        "switch the device's power off and on; try another cable or USB port, without a hub";
    for (std::size_t begin = 0; begin < image.size(); begin += kChunkBytes) {
      const auto chunk = image.subspan(begin, std::min(kChunkBytes, image.size() - begin));
      const Bytes echo = exchange(chunk, step);
      const auto [sent, received] = std::ranges::mismatch(chunk, echo);
      if (sent == chunk.end() && received == echo.end()) continue;
      const std::size_t same = static_cast<std::size_t>(sent - chunk.begin());
      const std::string where = "byte " + std::to_string(begin + same);
      const auto shown = [same](std::span<const std::uint8_t> bytes) {
        return bytes.size() > same ? hex(bytes.subspan(same, 1)) : std::string("no more bytes");
      };
      return SetupError::Report{config_.device, step, shown(chunk) + " echoed at " + where,
                                "echo mismatch: " + shown(echo), hint};
    }
    return std::nullopt;
  }

  /// What came back: as many bytes, fewer when the time was over, more when too many came.
  Bytes exchange(std::span<const std::uint8_t> bytes, const std::string& step) {
    write(bytes, step);
    const nanoseconds deadline = port_.now() + config_.echo_timeout;
    Bytes echo;
    while (echo.size() < bytes.size() && receive(echo, deadline, step)) {
    }
    return echo;
  }

  void control(Request request, std::uint16_t value, const std::string& step) {
    const auto result = port_.control_out(static_cast<std::uint8_t>(request), value, 0);
    if (!result.ok()) throw failure(result, step, "the request taken");
  }

  void purge(const std::string& step) {
    control(Request::kPurge, ftdi::kPurgeReceived, step);
    control(Request::kPurge, ftdi::kPurgeToSend, step);
  }

  void write(std::span<const std::uint8_t> bytes, const std::string& step) {
    const auto result = port_.write(bytes, config_.write_timeout);
    if (!result.ok()) throw failure(result, step, "the bytes taken");
  }

  /// Appends what comes, possibly no byte. False when the time is over.
  bool receive(Bytes& bytes, nanoseconds deadline, const std::string& step) {
    const nanoseconds left = deadline - port_.now();
    if (left <= nanoseconds(0)) return false;
    std::array<std::uint8_t, ftdi::kPacketBytes> packet{};
    const auto result = port_.read(packet, left);
    if (result.status == usb::TransferStatus::kTimeout) return false;
    if (!result.ok()) throw failure(result, step, "packets");
    const auto data = ftdi::strip_modem_status(std::span(packet).first(std::min(result.size, packet.size())));
    bytes.insert(bytes.end(), data.begin(), data.end());
    return true;
  }

  SetupError failure(const usb::TransferResult& result, const std::string& step,
                     const std::string& expected) const {
    const std::string code = " (code " + std::to_string(result.code) + ")";
    switch (result.status) {
      case usb::TransferStatus::kUnplugged:
        return SetupError({config_.device, step, expected, "the device unplugged",
                           "plug it in, check cable and hub, and start again"});
      case usb::TransferStatus::kTimeout:
        return SetupError({config_.device, step, expected, "time-out",
                           "unplug the device and plug it in again; try another USB port"});
      case usb::TransferStatus::kStalled:
        return SetupError({config_.device, step, expected, "a stall",
                           "unplug the device and plug it in again; check that it is a Falcon"});
      case usb::TransferStatus::kDone:
      case usb::TransferStatus::kOther: break;
    }
    return SetupError({config_.device, step, expected, "a USB error" + code,
                       "unplug the device and plug it in again; see the kernel's log (dmesg)"});
  }

  usb::UsbPort& port_;
  const BootConfig& config_;
};

}  // namespace

bool firmware_answers(usb::UsbPort& port, const BootConfig& config) {
  return Boot(port, config).firmware_answers();
}

Firmware start_firmware(usb::UsbPort& port, std::span<const std::uint8_t> image, const BootConfig& config) {
  Boot boot(port, config);
  if (boot.firmware_answers()) return Firmware::kWasRunning;
  if (image.empty()) boot.fail_without_image();
  std::optional<SetupError::Report> failure;
  for (int i = 0; i < std::max(config.load_attempts, 1); ++i) {
    failure = boot.load(image);
    if (!failure) return Firmware::kLoaded;
  }
  failure->found += " in the last of " + std::to_string(std::max(config.load_attempts, 1)) + " attempts";
  throw SetupError(*failure);
}

}  // namespace drivers::haptic::falcon
