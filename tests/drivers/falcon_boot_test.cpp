#include "drivers/haptic/falcon_boot.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "drivers/usb/usb_port.h"
#include "sim/devices/emulated_falcon.h"
#include "tests/drivers/falcon_fakes.h"

namespace drivers::haptic::falcon {
namespace falcon_boot_test {

using sim::devices::EmulatedFalcon;
using std::chrono::microseconds;
using std::chrono::milliseconds;
using tests::Control;
using tests::WatchedPort;
using usb::TransferResult;
using usb::TransferStatus;
using Bytes = std::vector<std::uint8_t>;

/// Three full chunks and a rest.
Bytes image() {
  Bytes bytes(3 * 62 + 14);
  std::uint8_t value = 0x3C;
  for (std::uint8_t& byte : bytes) byte = value = static_cast<std::uint8_t>(value * 5 + 17);
  return bytes;
}

/// The message, or "" when nothing was thrown.
std::string message_of(const std::function<void()>& action) {
  try {
    action();
  } catch (const SetupError& error) {
    return error.what();
  }
  return "";
}

#define EXPECT_SAYS(message, part) \
  EXPECT_NE((message).find(part), std::string::npos) << (message) << "\nlacks: " << (part)

TEST(FalconBoot, ColdDeviceGetsTheImageByteForByteAndRuns) {
  EmulatedFalcon device({.image = image()});
  EXPECT_EQ(start_firmware(device, image(), {}), Firmware::kLoaded);
  EXPECT_EQ(device.state(), EmulatedFalcon::State::kRun);
  EXPECT_EQ(device.loaded(), image());
  EXPECT_EQ(device.boots(), 1);
  EXPECT_EQ(device.queries(), 1);
  EXPECT_GT(device.commands(), 0);
}

TEST(FalconBoot, RunningFirmwareIsLeftAlone) {
  EmulatedFalcon device({.firmware_running = true});
  EXPECT_EQ(start_firmware(device, {}, {}), Firmware::kWasRunning);
  EXPECT_EQ(device.boots(), 0);
  EXPECT_EQ(device.commands(), 1);
}

// A person may hold the handle of a device that is homed and running.
TEST(FalconBoot, QuestionKeepsTheDeviceHomedAndItsMotorsAtZero) {
  EmulatedFalcon device({.firmware_running = true});
  EXPECT_TRUE(firmware_answers(device, {}));
  device.pull_and_push();
  EXPECT_TRUE(device.homed());
  EXPECT_TRUE(firmware_answers(device, {}));
  EXPECT_TRUE(device.homed());
  EXPECT_EQ(device.commands_without_homing(), 0);
  EXPECT_EQ(device.motors(), (std::array<std::int16_t, 3>{}));
}

TEST(FalconBoot, LateFirmwareIsWaitedFor) {
  EmulatedFalcon device({.firmware_running = true});
  device.drop_replies(150);
  EXPECT_TRUE(firmware_answers(device, {}));
  EXPECT_EQ(device.commands(), 151);
}

TEST(FalconBoot, RequestsAndBytesAreTheProtocols) {
  EmulatedFalcon device({.image = image()});
  WatchedPort port(device);
  BootConfig config;
  config.alive_packets = 1;
  EXPECT_EQ(start_firmware(port, image(), config), Firmware::kLoaded);
  const std::vector<Control> run_mode{{9, 1}, {3, 2}, {0, 1}, {0, 2}};
  const std::vector<Control> boot_mode{{0, 1}, {0, 2},      {9, 16},     {3, 0x4138}, {4, 8},
                                       {2, 0}, {1, 0x0200}, {1, 0x0100}, {1, 0x0101}};
  const std::vector<Control> load_mode{{1, 0x0100}, {3, 0x15}};
  std::vector<Control> expected = run_mode;
  for (const auto& part : {boot_mode, load_mode, run_mode}) {
    expected.insert(expected.end(), part.begin(), part.end());
  }
  EXPECT_EQ(port.controls, expected);
  EXPECT_TRUE(std::ranges::all_of(port.indices, [](int index) { return index == 0; }));
  EXPECT_EQ(port.order,
            "ccccw"
            "cccccccccw"
            "ccw"
            "wwww"
            "ccccw");

  ASSERT_EQ(port.writes.size(), 8U);
  const Bytes question{'<', 'A', 'A', 'A', 'A', 'A', 'A', 'A', 'A', 'A', 'A', 'A', 'A', 'B', 'A', '>'};
  EXPECT_EQ(port.writes[0], question);
  EXPECT_EQ(port.writes[1], (Bytes{0x0A, 0x43, 0x0D}));
  EXPECT_EQ(port.writes[2], Bytes{0x41});
  Bytes loaded;
  for (std::size_t i = 3; i < 7; ++i) {
    EXPECT_LE(port.writes[i].size(), 62U);
    loaded.insert(loaded.end(), port.writes[i].begin(), port.writes[i].end());
  }
  EXPECT_EQ(loaded, image());
  EXPECT_EQ(port.writes[7], question);
}

TEST(FalconBoot, AnswerBehindAZeroIsUnderstood) {
  EmulatedFalcon device({.zero_before_query_answer = true});
  EXPECT_EQ(start_firmware(device, image(), {}), Firmware::kLoaded);
  EXPECT_EQ(device.queries(), 1);
}

TEST(FalconBoot, WrongEchoStartsTheLoadAgain) {
  EmulatedFalcon device({.image = image()});
  device.spoil_echo(2, 1);
  EXPECT_EQ(start_firmware(device, image(), {}), Firmware::kLoaded);
  EXPECT_EQ(device.boots(), 3);
  EXPECT_EQ(device.loaded(), image());
}

TEST(FalconBoot, EchoThatStaysWrongIsNamedByByteAfterTheLastAttempt) {
  EmulatedFalcon device({.image = image()});
  device.spoil_echo(100, 2);
  const std::string message = message_of([&] { (void)start_firmware(device, image(), {}); });
  EXPECT_SAYS(message, "Falcon: load the firmware: expected");
  EXPECT_SAYS(message, "echo mismatch");
  EXPECT_SAYS(message, "byte " + std::to_string(2 * 62 + 31));
  EXPECT_SAYS(message, "10 attempts");
  EXPECT_SAYS(message, "USB port");
  EXPECT_EQ(device.boots(), 10);
}

TEST(FalconBoot, LoadBeginsOnceItsRequestWasEchoed) {
  EmulatedFalcon device({.image = image()});
  device.spoil_echo(100, -1);
  const std::string message = message_of([&] { (void)start_firmware(device, image(), {}); });
  EXPECT_SAYS(message, "enter load mode: expected 41, found 51");
  EXPECT_EQ(device.boots(), 10);
  EXPECT_EQ(device.loaded(), Bytes{});
}

TEST(FalconBoot, MissingEchoIsAMismatchToo) {
  EmulatedFalcon device({.image = image()});
  device.spoil_echo(100, 3, EmulatedFalcon::Echo::kByteMissing);
  const std::string message = message_of([&] { (void)start_firmware(device, image(), {}); });
  EXPECT_SAYS(message, "byte " + std::to_string(image().size() - 1));
  EXPECT_SAYS(message, "no more bytes");
}

TEST(FalconBoot, EchoThatIsTooLongIsAMismatchToo) {
  EmulatedFalcon device({.image = image()});
  device.spoil_echo(100, 3, EmulatedFalcon::Echo::kByteTooMany);
  const std::string message = message_of([&] { (void)start_firmware(device, image(), {}); });
  EXPECT_SAYS(message, "expected no more bytes echoed at byte " + std::to_string(image().size()));
  EXPECT_SAYS(message, "echo mismatch: 00");
}

TEST(FalconBoot, ImageThatDoesNotRunIsToldApartFromATransferThatFailed) {
  EmulatedFalcon device({.image = Bytes(500, 7)});
  const std::string message = message_of([&] { (void)start_firmware(device, image(), {}); });
  EXPECT_SAYS(message, "run the firmware");
  EXPECT_SAYS(message, "200 bytes were loaded");
  EXPECT_SAYS(message, "check that the file is");
}

TEST(FalconBoot, ColdDeviceWithoutAnImageAsksForOne) {
  EmulatedFalcon device;
  const std::string message = message_of([&] { (void)start_firmware(device, {}, {}); });
  EXPECT_SAYS(message, "a firmware image");
  EXPECT_SAYS(message, "name the image file");
  EXPECT_EQ(device.boots(), 0);
}

TEST(FalconBoot, DeviceWithoutPowerPointsAtPowerAndPort) {
  EmulatedFalcon device({.powered = false});
  BootConfig config;
  config.device = "Falcon at 1-2.3";
  const std::string message = message_of([&] { (void)start_firmware(device, image(), config); });
  EXPECT_SAYS(message, "Falcon at 1-2.3: ask the boot loader: expected 0A 44 2C 0D, found nothing");
  EXPECT_SAYS(message, "power supply");
  EXPECT_SAYS(message, "USB port");
  // 200 times 5 ms, then 100 times 50 ms: no attempt ends early because the chip sends empty packets.
  EXPECT_NEAR(static_cast<double>(device.now().count()) * 1e-9, 6.0, 0.6);
}

TEST(FalconBoot, WrongAnswersAreShownAndPurgedBeforeTheNextQuery) {
  tests::AnsweringPort device({0x0A, 0x44, 0x2C, 0x0E});
  WatchedPort port(device);
  BootConfig config;
  config.alive_packets = 1;
  config.query_attempts = 2;
  const std::string message = message_of([&] { (void)start_firmware(port, image(), config); });
  EXPECT_SAYS(message, "ask the boot loader: expected 0A 44 2C 0D, found 0A 44 2C 0E");
  EXPECT_EQ(port.order,
            "ccccw"
            "cccccccccw"
            "ccw"
            "cc");
  EXPECT_EQ(std::vector(port.controls.end() - 2, port.controls.end()),
            (std::vector<Control>{{0, 1}, {0, 2}}));
}

/// Fails each transfer of a whole load in turn.
std::vector<std::string> messages_of_failures(const TransferResult& failure) {
  BootConfig config;
  config.alive_packets = 1;
  EmulatedFalcon good({.image = image()});
  WatchedPort count(good);
  (void)start_firmware(count, image(), config);
  std::vector<std::string> messages;
  for (int i = 0; i < count.transfers; ++i) {
    EmulatedFalcon device({.image = image()});
    WatchedPort port(device);
    port.fail_at = i;
    port.failure = failure;
    messages.push_back(message_of([&] { (void)start_firmware(port, image(), config); }));
  }
  return messages;
}

TEST(FalconBoot, UnpluggedAtAnyStepSaysSo) {
  const auto messages = messages_of_failures({TransferStatus::kUnplugged, 0, -4});
  EXPECT_GT(messages.size(), 30U);
  for (const std::string& message : messages) EXPECT_SAYS(message, "unplugged; plug it in");
}

TEST(FalconBoot, StallAtAnyStepSaysSo) {
  for (const std::string& message : messages_of_failures({TransferStatus::kStalled, 0, -9})) {
    EXPECT_SAYS(message, "a stall; unplug the device");
  }
}

TEST(FalconBoot, OtherErrorsComeWithTheirCode) {
  for (const std::string& message : messages_of_failures({TransferStatus::kOther, 0, -99})) {
    EXPECT_SAYS(message, "code -99");
  }
}

TEST(FalconBoot, TimeOutOfAReadIsAnAttemptAndOfAWriteAnError) {
  for (const std::string& message : messages_of_failures({TransferStatus::kTimeout, 0, -7})) {
    if (message.empty()) continue;
    EXPECT_SAYS(message, "found time-out; unplug the device");
  }
}

TEST(FalconBoot, DeviceThatGoesWhileItLoadsIsNotAskedAgain) {
  BootConfig config;
  config.alive_packets = 1;
  EmulatedFalcon good;
  WatchedPort count(good);
  (void)start_firmware(count, image(), config);

  EmulatedFalcon device;
  WatchedPort port(device);
  port.fail_at = count.transfers - 10;
  port.failure = {TransferStatus::kUnplugged, 0, -4};
  const std::string message = message_of([&] { (void)start_firmware(port, image(), config); });
  EXPECT_SAYS(message, "load the firmware");
  EXPECT_SAYS(message, "unplugged");
  EXPECT_EQ(device.boots(), 1);
  EXPECT_EQ(port.transfers, port.fail_at + 1);
}

// The emulated device keeps the boot loader's conditions, or these tests would prove little.
class EmulatedBootLoader : public testing::Test {
 protected:
  Bytes ask(const Bytes& question) {
    EXPECT_TRUE(device_.write(question, milliseconds(10)).ok());
    Bytes answer;
    for (const auto end = device_.now() + milliseconds(50); device_.now() < end;) {
      const Bytes part = read();
      answer.insert(answer.end(), part.begin(), part.end());
    }
    return answer;
  }
  /// The data of the next packet.
  Bytes read() {
    Bytes buffer(64);
    const auto result = device_.read(buffer, milliseconds(255));
    EXPECT_TRUE(result.ok());
    EXPECT_GE(result.size, 2U) << "modem status";
    return {buffer.begin() + 2, buffer.begin() + static_cast<std::ptrdiff_t>(result.size)};
  }
  void enter_load_mode() {
    set(3, 0x4138);
    set(1, 0x0101);
    EXPECT_EQ(ask(query_), answer_);
    set(1, 0x0100);
    set(3, 0x15);
    EXPECT_EQ(ask({0x41}), Bytes{0x41});
  }
  void set(std::uint8_t request, std::uint16_t value) {
    EXPECT_TRUE(device_.control_out(request, value, 0).ok());
  }

  const Bytes query_{0x0A, 0x43, 0x0D};
  const Bytes answer_{0x0A, 0x44, 0x2C, 0x0D};
  EmulatedFalcon device_;
};

TEST_F(EmulatedBootLoader, AnswersAt9600WithDtrHighOnly) {
  set(3, 0x4138);
  EXPECT_EQ(ask(query_), Bytes{}) << "cold";
  set(1, 0x0100);
  set(1, 0x0101);
  EXPECT_EQ(ask(query_), answer_);
  set(3, 0x15);
  EXPECT_EQ(ask(query_), Bytes{}) << "baud rate";
  set(3, 0x0138);
  EXPECT_EQ(ask(query_), answer_) << "312 is near enough to 312.5";
  set(1, 0x0100);
  EXPECT_EQ(ask(query_), Bytes{}) << "DTR";
}

TEST_F(EmulatedBootLoader, LoadsAfterAQueryOnly) {
  set(3, 0x4138);
  set(1, 0x0101);
  set(1, 0x0100);
  set(3, 0x15);
  EXPECT_EQ(ask({0x41}), Bytes{});
  enter_load_mode();
  EXPECT_EQ(ask({1, 2, 3}), (Bytes{1, 2, 3}));
}

TEST_F(EmulatedBootLoader, FullPacketLeavesAtOnceAndFewerBytesWithTheTimer) {
  enter_load_mode();
  set(9, 100);
  const auto start = device_.now();
  const auto passed = [&] { return device_.now() - start; };
  EXPECT_TRUE(device_.write(Bytes(62, 7), milliseconds(10)).ok());
  EXPECT_EQ(read(), Bytes(62, 7));
  EXPECT_EQ(passed(), 2 * 62 * microseconds(70)) << "there and back";
  EXPECT_TRUE(device_.write({{1, 2, 3}}, milliseconds(10)).ok());
  EXPECT_EQ(read(), (Bytes{1, 2, 3}));
  EXPECT_EQ(passed(), milliseconds(100));
  EXPECT_EQ(read(), Bytes{});
  EXPECT_EQ(passed(), milliseconds(200));
  device_.pass(milliseconds(95));
  EXPECT_TRUE(device_.write(Bytes(62, 9), milliseconds(10)).ok());  // 4.34 ms each way
  EXPECT_EQ(read(), Bytes(9, 9)) << "0.66 ms of its echo";
  EXPECT_EQ(read(), Bytes(53, 9));
  EXPECT_EQ(passed(), milliseconds(400));
}

TEST_F(EmulatedBootLoader, PurgeLeavesWhatIsStillToCome) {
  enter_load_mode();
  EXPECT_TRUE(device_.write({{1, 2, 3}}, milliseconds(10)).ok());
  device_.pass(microseconds(140));
  set(0, 1);
  EXPECT_EQ(read(), Bytes{3});
}

}  // namespace falcon_boot_test
}  // namespace drivers::haptic::falcon
