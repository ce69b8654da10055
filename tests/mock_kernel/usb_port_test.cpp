// The port on real libusb with a mocked kernel.
#include <gtest/gtest.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "drivers/usb/libusb_port.h"
#include "drivers/usb/usb_devices.h"
#include "tests/support/mock_usb_device.h"
#include "tests/support/skip.h"

namespace drivers::usb {
namespace usb_port_test {

using namespace std::chrono_literals;
using Bytes = std::vector<std::uint8_t>;

// Generous: missing data must fail, late data must not.
constexpr auto kLong = 60s;
constexpr int kIn = 0x81;

Bytes numbered(std::size_t size, int first) {
  Bytes bytes(size);
  for (std::size_t i = 0; i < size; ++i) bytes[i] = static_cast<std::uint8_t>(first + static_cast<int>(i));
  return bytes;
}

/// Waits, but only to fail.
bool comes_true(const std::function<bool()>& condition) {
  const auto deadline = std::chrono::steady_clock::now() + kLong;
  while (!condition()) {
    if (std::chrono::steady_clock::now() > deadline) return false;
  }
  return true;
}

class LibusbPortTest : public testing::Test {
 protected:
  void SetUp() override {
    SKIP_UNLESS(support::in_mock_kernel(), "needs umockdev's library loaded first");
    bus_ = std::make_unique<support::MockUsbBus>();
    device_ = std::make_unique<support::MockUsbDevice>(*bus_, support::MockUsbOptions{});
    context_ = std::make_unique<UsbContext>();
  }

  LibusbPort::Opened open_device(UsbContext& context) {
    const auto found = context.devices({.vendor = 0x0403});
    if (found.size() != 1) throw std::runtime_error(std::to_string(found.size()) + " devices");
    return LibusbPort::open(context, found[0], {.interface = 0, .out = 0x02, .in = kIn},
                            "60-novint-falcon.rules");
  }
  void open() {
    auto opened = open_device(*context_);
    if (!opened.port) throw std::runtime_error(opened.refusal.found);
    port_ = std::move(opened.port);
  }

  /// One packet, in a buffer for one.
  std::pair<TransferResult, Bytes> read(std::chrono::nanoseconds timeout = kLong, std::size_t room = 64) {
    Bytes buffer(room);
    const TransferResult result = port_->read(buffer, timeout);
    buffer.resize(std::min(result.size, room));
    return {result, buffer};
  }

  std::unique_ptr<support::MockUsbBus> bus_;
  std::unique_ptr<support::MockUsbDevice> device_;
  std::unique_ptr<UsbContext> context_;
  std::unique_ptr<LibusbPort> port_;
};

TEST_F(LibusbPortTest, RequestsAndPacketsGoOverByteForByte) {
  std::vector<support::ControlRequest> requests;
  std::vector<std::pair<int, Bytes>> written;
  device_->on_control([&](const support::ControlRequest& request) {
    requests.push_back(request);
    return 0;
  });
  device_->on_out([&](int endpoint, const Bytes& bytes) {
    written.emplace_back(endpoint, bytes);
    device_->send(kIn, numbered(bytes.size(), 100));
    return 0;
  });
  open();
  EXPECT_TRUE(port_->control_out(3, 0x4138, 2).ok());
  const TransferResult sent = port_->write(numbered(16, 1), kLong);
  EXPECT_EQ(sent.status, TransferStatus::kDone);
  EXPECT_EQ(sent.size, 16U);
  const auto [result, bytes] = read();
  EXPECT_EQ(result.status, TransferStatus::kDone);
  EXPECT_EQ(bytes, numbered(16, 100));
  device_->on_control({});
  device_->on_out({});
  EXPECT_EQ(requests, (std::vector<support::ControlRequest>{{0x40, 3, 0x4138, 2}}));
  ASSERT_EQ(written.size(), 1U);
  EXPECT_EQ(written[0], std::pair(2, numbered(16, 1)));
}

TEST_F(LibusbPortTest, PacketsThatCameBetweenReadsAreAllThereInOrder) {
  open();
  constexpr int kPackets = 50;
  for (int i = 0; i < kPackets; ++i) device_->send(kIn, numbered(5, i));
  for (int i = 0; i < kPackets; ++i) {
    const auto [result, bytes] = read();
    ASSERT_TRUE(result.ok()) << i;
    ASSERT_EQ(bytes, numbered(5, i));
  }
  EXPECT_EQ(read(0ns).first.status, TransferStatus::kTimeout);
}

TEST_F(LibusbPortTest, SomeTransfersAlwaysWaitForTheDevice) {
  open();
  EXPECT_EQ(device_->listening(), static_cast<int>(LibusbPort::kListening));
  for (int i = 0; i < 10; ++i) {
    device_->send(kIn, {1});
    ASSERT_TRUE(read().first.ok());
    EXPECT_EQ(device_->listening(), static_cast<int>(LibusbPort::kListening));
  }
}

TEST_F(LibusbPortTest, ReadOfNothingEndsWithItsTimeAndAtOnceWithZero) {
  open();
  const auto before = port_->now();
  EXPECT_EQ(read(30ms).first.status, TransferStatus::kTimeout);
  EXPECT_GE(port_->now() - before, 30ms);
  EXPECT_EQ(read(0ns).first.status, TransferStatus::kTimeout);
  EXPECT_EQ(read(0ns).first.size, 0U);
  EXPECT_EQ(device_->counts().discarded, 0) << "what is under way stays there";
}

TEST_F(LibusbPortTest, FullPacketsAreJoinedUpToTheFirstThatIsNot) {
  open();
  device_->send(kIn, numbered(64, 0));
  device_->send(kIn, numbered(64, 64));
  device_->send(kIn, numbered(10, 128));
  device_->send(kIn, {7});
  // All have to be there before the first read.
  ASSERT_TRUE(comes_true([&] { return device_->waiting() == 0; }));
  const auto [joined, bytes] = read(kLong, 256);
  EXPECT_TRUE(joined.ok());
  EXPECT_EQ(bytes, numbered(138, 0));
  EXPECT_EQ(read(kLong, 256).second, Bytes{7});
}

TEST_F(LibusbPortTest, PacketThatDoesNotFitAnyMoreComesWithTheNextRead) {
  open();
  device_->send(kIn, numbered(64, 0));
  device_->send(kIn, numbered(64, 64));
  EXPECT_EQ(read(kLong, 100).second, numbered(64, 0));
  EXPECT_EQ(read(kLong, 63).first.status, TransferStatus::kOther) << "too small for any packet";
  EXPECT_EQ(read(kLong, 64).second, numbered(64, 64));
}

TEST_F(LibusbPortTest, EmptyPacketIsAPacket) {
  open();
  device_->send(kIn, {});
  device_->send(kIn, {1});
  const auto [result, bytes] = read();
  EXPECT_EQ(result.status, TransferStatus::kDone);
  EXPECT_EQ(result.size, 0U);
  EXPECT_EQ(read().second, Bytes{1});
}

TEST_F(LibusbPortTest, EmptyWriteIsAPacketToo) {
  std::vector<std::size_t> sizes;
  device_->on_out([&](int, const Bytes& bytes) {
    sizes.push_back(bytes.size());
    return 0;
  });
  open();
  EXPECT_TRUE(port_->write({}, kLong).ok());
  device_->on_out({});
  EXPECT_EQ(sizes, std::vector<std::size_t>{0});
}

TEST_F(LibusbPortTest, LongWriteArrivesWhole) {
  Bytes arrived;
  device_->on_out([&](int, const Bytes& bytes) {
    arrived.insert(arrived.end(), bytes.begin(), bytes.end());
    return 0;
  });
  open();
  const Bytes sent = numbered(10'000, 0);
  const TransferResult result = port_->write(sent, kLong);
  EXPECT_TRUE(result.ok());
  EXPECT_EQ(result.size, sent.size());
  device_->on_out({});
  EXPECT_EQ(arrived, sent);
}

TEST_F(LibusbPortTest, PacketLongerThanItsTransferIsReportedInItsPlace) {
  open();
  device_->send(kIn, {1});
  device_->send(kIn, numbered(65, 0));
  device_->send(kIn, {2});
  EXPECT_EQ(read().second, Bytes{1});
  const auto [result, bytes] = read();
  EXPECT_EQ(result.status, TransferStatus::kOther);
  EXPECT_EQ(result.code, -8) << "LIBUSB_ERROR_OVERFLOW";
  EXPECT_EQ(read().second, Bytes{2});
}

TEST_F(LibusbPortTest, WhoDoesNotReadMakesTheDeviceWaitAndLosesNothing) {
  open();
  constexpr int kPackets = 200;
  for (int i = 0; i < kPackets; ++i) device_->send(kIn, {static_cast<std::uint8_t>(i)});
  // Writes handle events, so the queue fills.
  ASSERT_TRUE(comes_true([&] {
    return port_->write(Bytes{0}, kLong).ok() && device_->listening() == 0 &&
           device_->counts().in_submitted == static_cast<int>(LibusbPort::kQueued);
  }));
  for (int i = 0; i < 20; ++i) ASSERT_TRUE(port_->write(Bytes{0}, kLong).ok());
  EXPECT_EQ(device_->counts().in_submitted, static_cast<int>(LibusbPort::kQueued)) << "no room, no question";
  EXPECT_EQ(device_->waiting(), kPackets - static_cast<int>(LibusbPort::kQueued));
  for (int i = 0; i < kPackets; ++i) {
    ASSERT_EQ(read().second, Bytes{static_cast<std::uint8_t>(i)}) << i;
    ASSERT_GT(device_->counts().in_submitted, static_cast<int>(LibusbPort::kQueued) + std::min(i, 100))
        << "where there is room, one more is asked for at once";
  }
}

TEST_F(LibusbPortTest, HaltedInEndpointIsClearedAndReportedOnceInItsPlace) {
  open();
  device_->send(kIn, {1});
  device_->fail_in(kIn, -EPIPE);
  device_->send(kIn, {2});
  EXPECT_EQ(read().second, Bytes{1});
  EXPECT_EQ(read().first.status, TransferStatus::kStalled);
  EXPECT_EQ(device_->counts().clear_halts, 1);
  EXPECT_GT(device_->counts().discarded, 0);
  EXPECT_EQ(device_->counts().under_way_at_clear_halt, 0);
  EXPECT_EQ(read().second, Bytes{2});
  EXPECT_EQ(read(0ns).first.status, TransferStatus::kTimeout);
}

TEST_F(LibusbPortTest, HaltedOutEndpointIsClearedAndReported) {
  int writes = 0;
  device_->on_out([&](int, const Bytes&) { return writes++ == 0 ? -EPIPE : 0; });
  open();
  const TransferResult result = port_->write(Bytes{1, 2}, kLong);
  EXPECT_EQ(result.status, TransferStatus::kStalled);
  EXPECT_EQ(result.size, 0U);
  EXPECT_EQ(device_->counts().clear_halts, 1);
  EXPECT_TRUE(port_->write(Bytes{1, 2}, kLong).ok()) << "without the clearing this one would fail, too";
}

TEST_F(LibusbPortTest, RefusedRequestIsAStall) {
  device_->on_control(
      [](const support::ControlRequest& request) { return request.request == 7 ? -EPIPE : 0; });
  open();
  EXPECT_EQ(port_->control_out(7, 0, 0).status, TransferStatus::kStalled);
  EXPECT_TRUE(port_->control_out(6, 0, 0).ok());
  EXPECT_EQ(device_->counts().clear_halts, 0);
}

TEST_F(LibusbPortTest, OtherFailureIsReportedOnceAndReadingGoesOn) {
  open();
  device_->fail_in(kIn, -EPROTO);
  device_->send(kIn, {5});
  const auto [result, bytes] = read();
  EXPECT_EQ(result.status, TransferStatus::kOther);
  EXPECT_EQ(result.code, -1) << "LIBUSB_ERROR_IO";
  EXPECT_EQ(read().second, Bytes{5});
}

TEST_F(LibusbPortTest, WriteThatIsNotTakenIsTakenBack) {
  open();
  device_->hold_out(3);
  const TransferResult result = port_->write(numbered(16, 0), 20ms);
  EXPECT_EQ(result.status, TransferStatus::kTimeout);
  EXPECT_EQ(result.size, 3U) << "what went over before";
  EXPECT_EQ(device_->counts().discarded, 1);
  device_->release_out();
  Bytes written;
  device_->on_out([&](int, const Bytes& bytes) {
    written = bytes;
    return 0;
  });
  EXPECT_TRUE(port_->write(Bytes{9}, kLong).ok());
  device_->on_out({});
  EXPECT_EQ(written, Bytes{9});
}

TEST_F(LibusbPortTest, WriteIsHeldUpByNothingThatComesIn) {
  open();
  device_->on_out([&](int, const Bytes&) {
    for (int i = 0; i < 10; ++i) device_->send(kIn, {static_cast<std::uint8_t>(i)});
    return 0;
  });
  EXPECT_TRUE(port_->write(Bytes{1}, kLong).ok());
  for (int i = 0; i < 10; ++i) EXPECT_EQ(read().second, Bytes{static_cast<std::uint8_t>(i)});
}

TEST_F(LibusbPortTest, UnpluggedWhileIdleIsSaidForEver) {
  open();
  device_->unplug();
  ASSERT_TRUE(comes_true([&] { return read(1ms).first.status == TransferStatus::kUnplugged; }));
  for (int i = 0; i < 3; ++i) {
    EXPECT_EQ(read(0ns).first.status, TransferStatus::kUnplugged);
    EXPECT_EQ(port_->write(Bytes{1}, kLong).status, TransferStatus::kUnplugged);
    EXPECT_EQ(port_->control_out(0, 0, 0).status, TransferStatus::kUnplugged);
  }
}

TEST_F(LibusbPortTest, UnpluggedDuringAWrite) {
  open();
  device_->hold_out();
  std::thread hand([&] {
    (void)comes_true([&] { return device_->counts().out_submitted == 1; });
    device_->unplug();
  });
  EXPECT_EQ(port_->write(Bytes{1}, kLong).status, TransferStatus::kUnplugged);
  hand.join();
}

TEST_F(LibusbPortTest, UnpluggedDuringARead) {
  open();
  std::thread hand([&] { device_->unplug(); });
  EXPECT_EQ(read(kLong).first.status, TransferStatus::kUnplugged);
  hand.join();
}

TEST_F(LibusbPortTest, WhatCameBeforeTheUnpluggingIsStillRead) {
  open();
  device_->send(kIn, {1});
  device_->send(kIn, {2});
  device_->unplug();
  EXPECT_EQ(read().second, Bytes{1});
  EXPECT_EQ(read().second, Bytes{2});
  EXPECT_EQ(read().first.status, TransferStatus::kUnplugged);
}

TEST_F(LibusbPortTest, UnpluggedBetweenAStallAndItsClearing) {
  open();
  device_->fail_in(kIn, -EPIPE);
  ASSERT_TRUE(port_->write(Bytes{1}, kLong).ok());  // handles events: the stall is in the queue
  device_->unplug();
  EXPECT_EQ(read().first.status, TransferStatus::kUnplugged);
}

TEST_F(LibusbPortTest, ClosingTakesEverythingBackAndReleasesTheInterface) {
  open();
  port_.reset();
  const support::MockUsbCounts counts = device_->counts();
  EXPECT_EQ(device_->listening(), 0);
  EXPECT_EQ(counts.discarded, static_cast<int>(LibusbPort::kListening));
  EXPECT_EQ(counts.releases, 1);
  open();
  device_->send(kIn, {1});
  EXPECT_EQ(read().second, Bytes{1});
}

TEST_F(LibusbPortTest, SecondOpenerGetsTheNameOfTheHolder) {
  open();
  UsbContext other;
  const auto second = open_device(other);
  EXPECT_FALSE(second.port);
  EXPECT_EQ(second.refusal.device, "FALCON HAPTIC (0403:cb48) at 1-1");
  EXPECT_EQ(second.refusal.step, "claim interface 0");
  EXPECT_NE(second.refusal.found.find("in use by"), std::string::npos) << second.refusal.found;
  EXPECT_NE(second.refusal.found.find("LIBUSB_ERROR_BUSY"), std::string::npos) << second.refusal.found;
  device_->send(kIn, {1});
  EXPECT_EQ(read().second, Bytes{1}) << "the first one is not disturbed";
}

TEST_F(LibusbPortTest, KernelsDriverGivesWayAndGetsTheInterfaceBack) {
  device_ = nullptr;
  device_ = std::make_unique<support::MockUsbDevice>(
      *bus_, support::MockUsbOptions{.address = 3, .driver = "ftdi_sio"});
  context_ = std::make_unique<UsbContext>();
  open();
  EXPECT_EQ(device_->counts().detached, 1);
  EXPECT_EQ(device_->counts().attached, 0);
  port_.reset();
  EXPECT_EQ(device_->counts().attached, 1);
}

TEST_F(LibusbPortTest, NoDriverIsForcedOnADeviceThatHadNone) {
  open();
  port_.reset();
  EXPECT_EQ(device_->counts().detached, 0);
  EXPECT_EQ(device_->counts().attached, 0);
}

TEST_F(LibusbPortTest, DriverThatDoesNotGiveWayIsNamed) {
  device_ = nullptr;
  device_ = std::make_unique<support::MockUsbDevice>(
      *bus_, support::MockUsbOptions{.address = 3, .driver = "ftdi_sio"});
  device_->refuse_claims(true);
  context_ = std::make_unique<UsbContext>();
  const auto opened = open_device(*context_);
  EXPECT_FALSE(opened.port);
  EXPECT_NE(opened.refusal.found.find("driver ftdi_sio bound to interface 0"), std::string::npos)
      << opened.refusal.found;
}

TEST_F(LibusbPortTest, DeviceThatWentIsNotFound) {
  const auto found = context_->devices({.vendor = 0x0403});
  ASSERT_EQ(found.size(), 1U);
  device_->unplug();
  ASSERT_TRUE(comes_true([&] { return context_->devices({.vendor = 0x0403}).empty(); }));
  const auto opened = LibusbPort::open(*context_, found[0], {.interface = 0, .out = 0x02, .in = kIn}, "");
  EXPECT_FALSE(opened.port);
  EXPECT_EQ(opened.refusal.step, "open");
  EXPECT_NE(opened.refusal.found.find("no 0403:cb48 on the bus"), std::string::npos) << opened.refusal.found;
  EXPECT_NE(opened.refusal.hint.find("cable"), std::string::npos);
}

TEST_F(LibusbPortTest, NodeThatIsMissingPointsAtTheContainer) {
  const auto found = context_->devices({.vendor = 0x0403});
  std::filesystem::remove(bus_->root() / device_->node().substr(1));
  const auto opened = open_device(*context_);
  EXPECT_FALSE(opened.port);
  EXPECT_NE(opened.refusal.found.find("no node /dev/bus/usb/001/002"), std::string::npos)
      << opened.refusal.found;
  EXPECT_NE(opened.refusal.hint.find("container"), std::string::npos);
}

TEST_F(LibusbPortTest, EndpointThatTheDeviceLacksIsAskedForInVain) {
  const auto found = context_->devices({.vendor = 0x0403});
  ASSERT_EQ(found.size(), 1U);
  const auto opened = LibusbPort::open(*context_, found[0], {.interface = 0, .out = 0x02, .in = 0x83}, "");
  EXPECT_FALSE(opened.port);
  EXPECT_EQ(opened.refusal.step, "look for its endpoints");
  EXPECT_EQ(device_->counts().claims, 0);
}

}  // namespace usb_port_test
}  // namespace drivers::usb
