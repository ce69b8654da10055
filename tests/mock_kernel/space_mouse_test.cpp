// A SpaceMouse through the real hidapi, on devices that umockdev mocks. Time is a parameter everywhere.
#include "drivers/haptic/space_mouse.h"

#include <dlfcn.h>
#include <gtest/gtest.h>
#include <poll.h>

#include <atomic>
#include <cerrno>
#include <chrono>
#include <functional>
#include <memory>
#include <ostream>
#include <string>
#include <thread>
#include <vector>

#include "drivers/haptic/space_mouse_models.h"
#include "sim/devices/emulated_space_mouse.h"
#include "tests/support/mock_hidraw_device.h"
#include "tests/support/skip.h"

namespace {

/// System calls of hidapi in this thread.
struct PollSpy {
  int calls = 0;
  int waits = 0;  ///< with a time-out other than zero
  int interruptions_to_come = 0;
};
thread_local PollSpy poll_spy;
std::atomic<int> hidapi_exits = 0;

}  // namespace

// A program's own functions come before those of its libraries, for the libraries, too.

extern "C" int poll(pollfd* descriptors, nfds_t count, int timeout_ms) {
  static const auto kReal = reinterpret_cast<decltype(&poll)>(dlsym(RTLD_NEXT, "poll"));
  ++poll_spy.calls;
  if (timeout_ms != 0) ++poll_spy.waits;
  if (poll_spy.interruptions_to_come > 0) {
    --poll_spy.interruptions_to_come;
    errno = EINTR;
    return -1;
  }
  return kReal(descriptors, count, timeout_ms);
}

extern "C" int hid_exit() {
  ++hidapi_exits;
  return 0;
}

namespace sim::devices {
/// In the names of tests.
static void PrintTo(SpaceMouseLayout layout, std::ostream* text) {
  *text << (layout == SpaceMouseLayout::kTwoReports ? "TwoReports" : "OneReport");
}
}  // namespace sim::devices

namespace drivers::haptic {
namespace {

using namespace std::chrono_literals;
using sim::devices::EmulatedSpaceMouse;
using sim::devices::EmulatedSpaceMouseOptions;
using sim::devices::SpaceMouseCap;
using sim::devices::SpaceMouseLayout;
using std::chrono::nanoseconds;
using support::MockHidrawBus;
using support::MockHidrawDevice;
using support::MockHidrawOptions;
using Bytes = std::vector<std::uint8_t>;

SpaceMouseCap at_rest(nanoseconds /*time*/) { return {}; }

MockHidrawOptions space_navigator() {
  return {.vendor = kVendorLogitech,
          .product = 0xc626,
          .report_descriptor = EmulatedSpaceMouse({}, at_rest).report_descriptor(),
          .name = "SpaceNavigator"};
}

MockHidrawOptions with(MockHidrawOptions options, const std::function<void(MockHidrawOptions&)>& change) {
  change(options);
  return options;
}

// Generic desktop: mouse (2) and keyboard (6), each with its collection ended at once.
const Bytes kMouseDescriptor{0x05, 0x01, 0x09, 0x02, 0xa1, 0x01, 0xc0};
const Bytes kKeyboardDescriptor{0x05, 0x01, 0x09, 0x06, 0xa1, 0x01, 0xc0};

/// What set-up says when it refuses; empty: it does not.
std::string refusal(const SpaceMouseChoice& choice = {}) {
  try {
    const SpaceMouse mouse(choice);
  } catch (const SetupError& error) {
    return error.what();
  }
  return {};
}

class SpaceMouseOnHidraw : public testing::Test {
 protected:
  void SetUp() override {
    SKIP_UNLESS(support::runs_under_umockdev(), "umockdev's library is not preloaded: run this by ctest");
    bus_ = std::make_unique<MockHidrawBus>();
  }
  MockHidrawDevice& plug(const MockHidrawOptions& options) { return bus_->plug(options); }

  static SpaceMouseSample sample_after(SpaceMouse& mouse, nanoseconds now) {
    SpaceMouseSample sample;
    EXPECT_TRUE(mouse.poll(now, sample).ok());
    return sample;
  }

  std::unique_ptr<MockHidrawBus> bus_;
};

/// The hand's way to the sample, in both layouts.
class SpaceMouseLayouts : public SpaceMouseOnHidraw, public testing::WithParamInterface<SpaceMouseLayout> {};

TEST_P(SpaceMouseLayouts, TheCapsDeflectionArrivesAndItsReleaseToo) {
  const SpaceMouseCap cap{.translation = {0.2, -0.4, 0.6}, .rotation = {-0.8, 1.0, -0.2}};
  EmulatedSpaceMouse device({.layout = GetParam()},
                            [&](nanoseconds time) { return time < 100ms ? cap : SpaceMouseCap{}; });
  MockHidrawDevice& node = plug(with(space_navigator(), [&](MockHidrawOptions& options) {
    options.report_descriptor = device.report_descriptor();
  }));
  SpaceMouse mouse;
  SpaceMouseSample sample;
  int reports = 0;
  for (nanoseconds now{}; now <= 300ms; now += 1ms) {
    for (const auto& report : device.advance(now)) node.send(report.bytes);
    const SpaceMouseStatus status = mouse.poll(now, sample);
    ASSERT_TRUE(status.ok());
    EXPECT_EQ(sample.stamp, now);
    reports += status.reports;
    if (now >= 16ms && now < 100ms) {
      EXPECT_EQ(sample.deflection, (SpaceMouseDeflection{cap.translation, cap.rotation}));
    }
    // The round after the release comes within 16 ms, its second half 8 ms later.
    if (now >= 125ms) {
      EXPECT_EQ(sample.deflection, SpaceMouseDeflection{});
    }
  }
  // Held for 100 ms, then three rounds of zeros.
  EXPECT_EQ(reports, GetParam() == SpaceMouseLayout::kTwoReports ? 14 + 6 : 7 + 3);
  EXPECT_EQ(mouse.unknown_reports(), 0U);
  EXPECT_EQ(node.reads_without_report(), 0);
}

INSTANTIATE_TEST_SUITE_P(Both, SpaceMouseLayouts,
                         testing::Values(SpaceMouseLayout::kTwoReports, SpaceMouseLayout::kOneReport),
                         testing::PrintToStringParamName());

TEST_F(SpaceMouseOnHidraw, IsFoundAmongOtherDevicesAndByTheNodeOfItsAxes) {
  plug({.vendor = 0x046d, .product = 0xc077, .report_descriptor = kMouseDescriptor});
  plug({.vendor = 0x256f, .product = 0xc650, .report_descriptor = kMouseDescriptor, .name = "CadMouse"});
  // A receiver: first the keyboard, then the device itself.
  const MockHidrawOptions receiver{.vendor = 0x256f, .product = 0xc652, .name = "Universal Receiver"};
  plug(with(receiver, [](MockHidrawOptions& options) { options.report_descriptor = kKeyboardDescriptor; }));
  const MockHidrawDevice& axes = plug(with(receiver, [](MockHidrawOptions& options) {
    options.report_descriptor =
        EmulatedSpaceMouse({.layout = SpaceMouseLayout::kOneReport}, at_rest).report_descriptor();
    options.usb_interface = 1;
  }));
  // Not listed as having six axes, though it says that it has them.
  plug(with(space_navigator(), [](MockHidrawOptions& options) {
    options.vendor = 0x256f;
    options.product = 0xc641;
  }));
  const auto found = find_space_mice();
  ASSERT_EQ(found.size(), 1U);
  EXPECT_EQ(found[0].path, axes.path());
  EXPECT_EQ(found[0].model, "SpaceMouse at a Universal Receiver");
  EXPECT_EQ(found[0].vendor, 0x256f);
  EXPECT_EQ(found[0].product, 0xc652);
  EXPECT_EQ(axes.openers(), 0);  // finding opens nothing
  const SpaceMouse mouse;
  EXPECT_EQ(mouse.info().path, axes.path());
}

TEST_F(SpaceMouseOnHidraw, ANodeWithoutDescriptorIsTakenByItsIds) {
  plug(with(space_navigator(), [](MockHidrawOptions& options) { options.report_descriptor = {}; }));
  EXPECT_EQ(find_space_mice().size(), 1U);
}

TEST_F(SpaceMouseOnHidraw, ANodeThatNamesItsAxesTwiceIsListedOnce) {
  plug(with(space_navigator(), [](MockHidrawOptions& options) {
    const Bytes once = options.report_descriptor;
    options.report_descriptor.insert(options.report_descriptor.end(), once.begin(), once.end());
  }));
  EXPECT_EQ(find_space_mice().size(), 1U);
}

TEST_F(SpaceMouseOnHidraw, TwoAreDistinguishedBySerialNumberOrNode) {
  const auto serial = [](const char* number) {
    return with(space_navigator(), [=](MockHidrawOptions& options) { options.serial = number; });
  };
  MockHidrawDevice& left = plug(serial("A1"));
  MockHidrawDevice& right = plug(serial("B2"));
  SpaceMouse by_serial({.serial = "B2"});
  EXPECT_EQ(by_serial.info().path, right.path());
  SpaceMouse by_path({.path = left.path()});
  EXPECT_EQ(by_path.info().serial, "A1");
  EXPECT_EQ(SpaceMouse().info().path, left.path());  // the first, when none is named

  left.send({3, 1, 0});
  right.send({3, 2, 0});
  EXPECT_EQ(sample_after(by_serial, 0ms).buttons, 2U);
  EXPECT_EQ(sample_after(by_path, 0ms).buttons, 1U);

  const std::string message = refusal({.serial = "B2", .path = left.path()});
  EXPECT_NE(message.find("expected one that is connected, with serial number B2, at /dev/hidraw0"),
            std::string::npos)
      << message;
  EXPECT_NE(message.find("found SpaceNavigator (/dev/hidraw0) with serial number A1, SpaceNavigator "
                         "(/dev/hidraw1) with serial number B2"),
            std::string::npos)
      << message;
}

TEST_F(SpaceMouseOnHidraw, TheFirstOfManyIsTheOneWithTheLowestNumber) {
  for (int i = 0; i < 2; ++i) plug({.vendor = 0x046d, .product = 0xc077});
  plug(space_navigator());  // hidraw2
  for (int i = 3; i < 10; ++i) plug({.vendor = 0x046d, .product = 0xc077});
  plug(space_navigator());  // hidraw10
  const auto found = find_space_mice();
  ASSERT_EQ(found.size(), 2U);
  EXPECT_EQ(found[0].path, "/dev/hidraw2");
  EXPECT_EQ(found[1].path, "/dev/hidraw10");
}

TEST_F(SpaceMouseOnHidraw, NoneIsAnAnswerWhenLookingAndAnErrorWhenOpening) {
  plug({.vendor = 0x046d, .product = 0xc077, .report_descriptor = kMouseDescriptor});
  EXPECT_TRUE(find_space_mice().empty());
  EXPECT_EQ(refusal(),
            "SpaceMouse: find: expected one that is connected, found none; plug it in (a wireless one: its "
            "receiver or cable); the kernel has it when there is a /dev/hidraw node more");
}

TEST_F(SpaceMouseOnHidraw, TheLightIsOnWhileItIsOpen) {
  const MockHidrawDevice& node = plug(space_navigator());
  {
    const SpaceMouse mouse;
    EXPECT_EQ(node.outputs(), (std::vector<Bytes>{{4, 1}}));
    EXPECT_TRUE(mouse.info().warnings.empty());
  }
  EXPECT_EQ(node.outputs(), (std::vector<Bytes>{{4, 1}, {4, 0}}));
}

TEST_F(SpaceMouseOnHidraw, ALightThatDoesNotWorkIsOnlyReported) {
  MockHidrawDevice& node =
      plug(with(space_navigator(), [](MockHidrawOptions& options) { options.refuses_output = true; }));
  SpaceMouse mouse;
  ASSERT_EQ(mouse.info().warnings.size(), 1U);
  EXPECT_NE(mouse.info().warnings[0].find("light"), std::string::npos);
  node.send({3, 1, 0});
  EXPECT_EQ(sample_after(mouse, 0ms).buttons, 1U);
}

TEST_F(SpaceMouseOnHidraw, SilenceIsRestAndNoFault) {
  plug(space_navigator());
  SpaceMouse mouse;
  for (const nanoseconds now : {nanoseconds(0), nanoseconds(1ms), nanoseconds(1h)}) {
    SpaceMouseSample sample;
    const SpaceMouseStatus status = mouse.poll(now, sample);
    EXPECT_TRUE(status.ok());
    EXPECT_EQ(status.reports, 0);
    EXPECT_EQ(sample.stamp, now);
    EXPECT_EQ(sample.deflection, SpaceMouseDeflection{});
  }
}

TEST_F(SpaceMouseOnHidraw, ADeflectionWhoseReleaseIsLostEndsAfter150Milliseconds) {
  MockHidrawDevice& node = plug(space_navigator());
  SpaceMouse mouse;
  node.send({1, 0xaf, 0, 0, 0, 0, 0});
  node.send({2, 0x5e, 1, 0, 0, 0, 0});
  for (const nanoseconds now : {nanoseconds(1s), nanoseconds(1s + 149ms)}) {
    const SpaceMouseDeflection held = sample_after(mouse, now).deflection;
    EXPECT_EQ(held.translation[0], 0.5);
    EXPECT_EQ(held.rotation[0], 1.0);
  }
  EXPECT_EQ(sample_after(mouse, 1s + 151ms).deflection, SpaceMouseDeflection{});
}

TEST_F(SpaceMouseOnHidraw, AllThatWaitsIsTakenInOnePollAndTheLatestCounts) {
  MockHidrawDevice& node = plug(space_navigator());
  SpaceMouse mouse;
  for (std::uint8_t i = 1; i <= 60; ++i) node.send({1, i, 0, 0, 0, 0, 0});
  SpaceMouseSample sample;
  const SpaceMouseStatus status = mouse.poll(1s, sample);
  EXPECT_EQ(status.reports, 60);
  EXPECT_FALSE(status.overrun);
  EXPECT_EQ(sample.deflection.translation[0], 60.0 / 350);
  EXPECT_EQ(mouse.poll(1s, sample).reports, 0);
  EXPECT_EQ(node.reads_without_report(), 0);
}

TEST_F(SpaceMouseOnHidraw, AfterAQueueOverflowTheCapCountsAsReleased) {
  MockHidrawDevice& node = plug(space_navigator());
  SpaceMouse mouse;
  // The kernel keeps the first 63 of them: what says that the cap was let go is not among them.
  for (int i = 0; i < 94; ++i) node.send({1, 0x5e, 1, 0, 0, 0, 0});
  for (int i = 0; i < 6; ++i) node.send({1, 0, 0, 0, 0, 0, 0});
  SpaceMouseSample sample;
  SpaceMouseStatus status = mouse.poll(1s, sample);
  EXPECT_TRUE(status.ok());
  EXPECT_TRUE(status.overrun);
  EXPECT_EQ(status.reports, 63);
  EXPECT_EQ(sample.deflection, SpaceMouseDeflection{});
  // Still held: the next report says so.
  node.send({1, 0x5e, 1, 0, 0, 0, 0});
  status = mouse.poll(1s + 8ms, sample);
  EXPECT_FALSE(status.overrun);
  EXPECT_EQ(sample.deflection.translation[0], 1.0);
}

TEST_F(SpaceMouseOnHidraw, APollTakesNoMoreThanItsBoundHoweverMuchThereIs) {
  MockHidrawDevice& node =
      plug(with(space_navigator(), [](MockHidrawOptions& options) { options.queue = 1000; }));
  SpaceMouse mouse;
  for (int i = 0; i < 300; ++i) node.send({3, 1, 0});
  SpaceMouseSample sample;
  EXPECT_EQ(mouse.poll(0ms, sample).reports, 128);
  EXPECT_EQ(mouse.poll(0ms, sample).reports, 128);
  EXPECT_EQ(mouse.poll(0ms, sample).reports, 44);
  EXPECT_EQ(sample.buttons, 1U);
}

TEST_F(SpaceMouseOnHidraw, ButtonsOfBothSizesAndTheBatteryArrive) {
  MockHidrawDevice& node = plug(space_navigator());
  SpaceMouse mouse;
  EXPECT_FALSE(sample_after(mouse, 0ms).battery_percent);
  node.send({3, 2, 0});
  EXPECT_EQ(sample_after(mouse, 1ms).buttons, 2U);
  node.send({3, 0, 0x10, 0x40, 0x02});
  node.send({0x17, 87, 1});
  const SpaceMouseSample sample = sample_after(mouse, 2ms);
  EXPECT_EQ(sample.buttons, 0x02401000U);
  EXPECT_EQ(sample.battery_percent, 87);
}

TEST_F(SpaceMouseOnHidraw, WhatIsNoneOfItsReportsIsCountedAndChangesNothing) {
  MockHidrawDevice& node = plug(space_navigator());
  SpaceMouse mouse;
  node.send({1, 0xaf, 0, 0, 0, 0, 0});
  const SpaceMouseDeflection before = sample_after(mouse, 0ms).deflection;
  for (const Bytes& report : {Bytes{1}, Bytes{1, 1, 1, 1}, Bytes{2, 1, 2, 3}, Bytes{99, 1, 2, 3, 4, 5, 6},
                              Bytes(64, 1), Bytes(200, 1)})
    node.send(report);
  const SpaceMouseSample sample = sample_after(mouse, 1ms);
  EXPECT_EQ(sample.deflection, before);
  EXPECT_EQ(sample.buttons, 0U);
  EXPECT_EQ(mouse.unknown_reports(), 6U);
}

TEST_F(SpaceMouseOnHidraw, UnpluggedInUseIsALastingFaultWithTheCapReleased) {
  MockHidrawDevice& node = plug(space_navigator());
  SpaceMouse mouse;
  node.send({1, 0xaf, 0, 0, 0, 0, 0});
  node.send({3, 1, 0});
  SpaceMouseSample sample = sample_after(mouse, 5ms);
  EXPECT_EQ(sample.deflection.translation[0], 0.5);
  node.send({1, 0x5e, 1, 0, 0, 0, 0});  // not read any more
  node.unplug();
  EXPECT_TRUE(find_space_mice().empty());
  for (const nanoseconds now : {nanoseconds(6ms), nanoseconds(7ms)}) {
    EXPECT_EQ(mouse.poll(now, sample).fault, HapticFault::kUnplugged);
    EXPECT_EQ(sample.deflection, SpaceMouseDeflection{});
    EXPECT_EQ(sample.buttons, 0U);
    EXPECT_EQ(sample.stamp, nanoseconds(5ms));
  }
  // Plugged in again it is another node, invisible to openers of the old one.
  plug(space_navigator()).send({3, 1, 0});
  EXPECT_EQ(mouse.poll(8ms, sample).fault, HapticFault::kUnplugged);
  SpaceMouse again;
  EXPECT_EQ(again.info().path, "/dev/hidraw1");
  EXPECT_EQ(node.outputs(), (std::vector<Bytes>{{4, 1}}));
}

TEST_F(SpaceMouseOnHidraw, TwoMayHaveItOpenAndBothGetAllReports) {
  MockHidrawDevice& node = plug(space_navigator());
  const int exits_before = hidapi_exits;
  auto first = std::make_unique<SpaceMouse>();
  {
    SpaceMouse second;
    node.send({1, 0xaf, 0, 0, 0, 0, 0});
    EXPECT_EQ(sample_after(*first, 0ms).deflection.translation[0], 0.5);
    EXPECT_EQ(sample_after(second, 0ms).deflection.translation[0], 0.5);
  }
  // That one of them closed it ends neither the other nor hidapi.
  node.send({1, 0x5e, 1, 0, 0, 0, 0});
  EXPECT_EQ(sample_after(*first, 1ms).deflection.translation[0], 1.0);
  EXPECT_EQ(find_space_mice().size(), 1U);
  EXPECT_EQ(hidapi_exits, exits_before);
  first.reset();
  EXPECT_EQ(hidapi_exits, exits_before + 1);
}

TEST_F(SpaceMouseOnHidraw, GoneBetweenFindingAndOpeningIsReportedInWords) {
  MockHidrawDevice& node = plug(space_navigator());
  const HidapiUse hidapi;
  const SpaceMouseInfo found = find_space_mice().at(0);
  node.unplug();
  try {
    (void)open_space_mouse(found);
    ADD_FAILURE() << "opened";
  } catch (const SetupError& error) {
    EXPECT_EQ(error.report().device, "SpaceNavigator (/dev/hidraw0)");
    EXPECT_EQ(error.report().found, "No such file or directory");
    EXPECT_NE(error.report().hint.find("plug the device in again"), std::string::npos) << error.what();
  }
}

TEST_F(SpaceMouseOnHidraw, ANodeThatOpensButDoesNotAnswerIsReportedInWords) {
  plug(with(space_navigator(), [](MockHidrawOptions& options) { options.refuses_questions = true; }));
  const std::string message = refusal();
  EXPECT_NE(message.find("found Inappropriate ioctl for device"), std::string::npos) << message;
}

/// Set-up in one thread while others look and poll: hidapi's own state is shared by all of them.
TEST_F(SpaceMouseOnHidraw, SeveralThreadsMayFindOpenAndCloseAtOnce) {
  for (int i = 0; i < 3; ++i) plug(space_navigator());
  std::vector<std::thread> threads;
  std::atomic<int> polls = 0;
  for (int i = 0; i < 3; ++i) {
    threads.emplace_back([i, &polls] {
      for (int round = 0; round < 10; ++round) {
        SpaceMouse mouse({.path = "/dev/hidraw" + std::to_string(i)});
        SpaceMouseSample sample;
        if (mouse.poll(0ms, sample).ok()) ++polls;
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(polls, 30);
}

TEST_F(SpaceMouseOnHidraw, APollNeverWaitsAndASignalInItIsNoFault) {
  MockHidrawDevice& node = plug(space_navigator());
  SpaceMouse mouse;
  node.send({3, 1, 0});
  SpaceMouseSample sample;
  poll_spy = {.interruptions_to_come = 1};
  SpaceMouseStatus status = mouse.poll(1ms, sample);
  EXPECT_TRUE(status.ok());
  EXPECT_EQ(status.reports, 0);
  EXPECT_EQ(sample.stamp, nanoseconds(1ms));
  status = mouse.poll(2ms, sample);
  EXPECT_EQ(status.reports, 1);
  EXPECT_EQ(sample.buttons, 1U);
  EXPECT_EQ(poll_spy.calls, 1 + 2);  // interrupted; a report, no more
  EXPECT_EQ(poll_spy.waits, 0);
}

// ---- words ----

const SpaceMouseInfo kSomeMouse{.model = "SpaceMouse Compact", .path = "/dev/hidraw3"};

TEST(SpaceMouseWords, ANodeOfRootsWantsTheRule) {
  EXPECT_STREQ(
      node_refused(kSomeMouse, {EACCES, 0600, "root", "root"}).what(),
      "SpaceMouse Compact (/dev/hidraw3): open: expected read and write access, found Permission denied "
      "(mode 0600, owner root, group root); copy udev/60-3dconnexion-spacemouse.rules to "
      "/etc/udev/rules.d, run \"udevadm control --reload\" and plug the device in again: its node will "
      "belong to the group plugdev");
}

TEST(SpaceMouseWords, ANodeOfTheGroupWantsTheUserInIt) {
  const SetupError error = node_refused(kSomeMouse, {EACCES, 0660, "root", "plugdev"});
  EXPECT_EQ(error.report().found, "Permission denied (mode 0660, owner root, group plugdev)");
  EXPECT_EQ(error.report().hint, "add the user to the group plugdev and log in again");
  // The group alone does not help, nor does another group.
  EXPECT_NE(node_refused(kSomeMouse, {EACCES, 0660, "root", "input"}).report().hint.find("copy udev/"),
            std::string::npos);
  EXPECT_NE(node_refused(kSomeMouse, {EACCES, 0600, "root", "plugdev"}).report().hint.find("copy udev/"),
            std::string::npos);
}

TEST(SpaceMouseWords, OtherReasonsAreTheSystemsWithWhatToDo) {
  const auto report = [](int error) { return node_refused(kSomeMouse, {.error = error}).report(); };
  EXPECT_EQ(report(ENOENT).found, "No such file or directory");
  EXPECT_EQ(report(ENOENT).hint,
            "plug the device in again; inside a container: start it with access to this device");
  EXPECT_EQ(report(EPERM).hint, "inside a container: start it with access to this device");
  EXPECT_EQ(report(ENOTTY).hint, "plug the device in again, and see what the kernel says (dmesg)");
}

TEST(SpaceMouseModels, NameSixAxisDevicesAndNoOthers) {
  for (const SpaceMouseModel& model : kSpaceMouseModels)
    EXPECT_EQ(space_mouse_model(model.vendor, model.product), &model) << model.name;  // each once
  for (const int other :
       {0xc62c, 0xc641, 0xc650, 0xc651, 0xc654, 0xc655, 0xc656, 0xc657, 0xc658, 0xc664, 0xc665, 0xc668})
    EXPECT_EQ(space_mouse_model(kVendor3Dconnexion, static_cast<std::uint16_t>(other)), nullptr) << other;
  EXPECT_EQ(space_mouse_model(kVendorLogitech, 0xc077), nullptr);
  EXPECT_EQ(space_mouse_model(kVendorLogitech, 0xc635), nullptr);  // ids belong to their vendor
}

}  // namespace
}  // namespace drivers::haptic
