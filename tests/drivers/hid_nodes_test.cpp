#include "drivers/haptic/hid_nodes.h"

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <unistd.h>

#include <cstddef>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "drivers/setup_error.h"
#include "tests/support/temporary_directory.h"

namespace drivers::haptic {
namespace {

namespace fs = std::filesystem;
using Bytes = std::vector<std::uint8_t>;

/// A folder in place of /sys.
class HidNodes : public testing::Test {
 protected:
  fs::path folder_of(const std::string& name) {
    const fs::path device = sys / "class/hidraw" / name / "device";
    fs::create_directories(device);
    return device;
  }
  void add(const std::string& name, const std::string& uevent) {
    folder_of(name);
    sys.write("class/hidraw/" + name + "/device/uevent", uevent);
  }
  std::vector<HidNode> found() const { return hid_nodes({.sys = sys / "."}); }
  std::string refusal() const {
    try {
      (void)found();
    } catch (const SetupError& error) {
      return error.what();
    }
    return {};
  }

  support::TemporaryDirectory sys;
};

// As Linux 6.1 shows a SpaceMouse Compact.
const std::string kCompact =
    "DRIVER=hid-generic\nHID_ID=0003:0000256F:0000C635\nHID_NAME=3Dconnexion SpaceMouse Compact\n"
    "HID_PHYS=usb-0000:00:14.0-2/input0\nHID_UNIQ=\nMODALIAS=hid:b0003g0001v0000256Fp0000C635\n";

TEST_F(HidNodes, AreWhatTheKernelShowsInTheOrderOfTheirNumbers) {
  add("hidraw10", kCompact);
  add("hidraw2", "HID_ID=0005:0000046D:0000C62B\nHID_UNIQ=A1\n");
  const std::vector<HidNode> nodes = found();
  ASSERT_EQ(nodes.size(), 2U);
  EXPECT_EQ(nodes[0].path, "/dev/hidraw2");
  EXPECT_EQ(nodes[0].vendor, 0x046d);
  EXPECT_EQ(nodes[0].product, 0xc62b);
  EXPECT_EQ(nodes[0].serial, "A1");
  EXPECT_EQ(nodes[1].path, "/dev/hidraw10");
  EXPECT_EQ(nodes[1].vendor, 0x256f);
  EXPECT_EQ(nodes[1].product, 0xc635);
  EXPECT_EQ(nodes[1].serial, "");
}

TEST_F(HidNodes, AreNoneOnAKernelWithoutHidDevices) { EXPECT_TRUE(found().empty()); }

TEST_F(HidNodes, WithoutIdsAreLeftOut) {
  int number = 0;
  for (const char* uevent : {"", "\n", "HID_ID", "HID_ID=", "HID_ID=0003", "HID_ID=0003:256F",
                             "HID_ID=0003:256F:", "HID_ID=::", "HID_ID=0003:1256F:C635",
                             "HID_ID=0003:256F:C635x", "HID_IDS=0003:256F:C635", "=\n=\n"})
    add("hidraw" + std::to_string(number++), uevent);
  EXPECT_TRUE(found().empty());
}

TEST_F(HidNodes, ThatGoMeanwhileAreLeftOut) {
  folder_of("hidraw0");  // its files are gone already
  fs::create_directory_symlink(sys / "gone", sys / "class/hidraw/hidraw1");
  add("hidraw2", kCompact);
  const std::vector<HidNode> nodes = found();
  ASSERT_EQ(nodes.size(), 1U);
  EXPECT_EQ(nodes[0].path, "/dev/hidraw2");
  EXPECT_TRUE(report_descriptor_of(nodes[0]).empty());
}

TEST_F(HidNodes, ThatCannotBeReadHideNoOther) {
  fs::create_directory(folder_of("hidraw0") / "uevent");          // opens, and reads as EISDIR
  fs::create_symlink("uevent", folder_of("hidraw1") / "uevent");  // opens as ELOOP
  add("hidraw2", kCompact);
  ASSERT_EQ(found().size(), 1U);
  EXPECT_EQ(found()[0].path, "/dev/hidraw2");
}

TEST_F(HidNodes, AProcessThatMayOpenNoMoreFilesIsAnErrorThatNamesTheFile) {
  add("hidraw0", kCompact);
  rlimit before{};
  ASSERT_EQ(getrlimit(RLIMIT_NOFILE, &before), 0);
  // The folder is opened first, with the lowest free number; its file would be the next.
  const int lowest_free = dup(0);
  ASSERT_GE(lowest_free, 0);
  close(lowest_free);
  const rlimit one_more{static_cast<rlim_t>(lowest_free) + 1, before.rlim_max};
  ASSERT_EQ(setrlimit(RLIMIT_NOFILE, &one_more), 0);
  const std::string said = refusal();
  setrlimit(RLIMIT_NOFILE, &before);
  EXPECT_NE(said.find("class/hidraw/hidraw0/device/uevent: read"), std::string::npos) << said;
  EXPECT_NE(said.find("Too many open files"), std::string::npos) << said;
}

TEST_F(HidNodes, AListThatCannotBeReadIsAnErrorThatNamesTheFolder) {
  fs::create_directory(sys / "class");
  sys.write("class/hidraw", "a file");
  EXPECT_NE(refusal().find("class/hidraw: read"), std::string::npos) << refusal();
}

TEST_F(HidNodes, PassOnlyPrintableTextOfADevice) {
  add("hidraw0", "HID_ID=0003:256F:C635\nHID_UNIQ=\x1b[2Jü\n");
  EXPECT_EQ(found().at(0).serial, "?[2J??");
}

TEST_F(HidNodes, ShowTheirReportDescriptor) {
  add("hidraw0", kCompact);
  sys.write("class/hidraw/hidraw0/device/report_descriptor",
            std::string("\x05\x01\x09\x08\xa1\x01\xc0\x00", 8));
  EXPECT_EQ(report_descriptor_of(found().at(0)), (Bytes{0x05, 0x01, 0x09, 0x08, 0xa1, 0x01, 0xc0, 0x00}));
}

constexpr HidUsage kMouse{.page = 1, .usage = 2};
constexpr HidUsage kPointer{.page = 1, .usage = 1};
constexpr HidUsage kButtonPage{.page = 9, .usage = 1};

// HID 1.11, appendix E.10: the report descriptor of a mouse.
const Bytes kMouseDescriptor{0x05, 0x01, 0x09, 0x02, 0xa1, 0x01, 0x09, 0x01, 0xa1, 0x00, 0x05, 0x09, 0x19,
                             0x01, 0x29, 0x03, 0x15, 0x00, 0x25, 0x01, 0x95, 0x03, 0x75, 0x01, 0x81, 0x02,
                             0x95, 0x01, 0x75, 0x05, 0x81, 0x01, 0x05, 0x01, 0x09, 0x30, 0x09, 0x31, 0x15,
                             0x81, 0x25, 0x7f, 0x75, 0x08, 0x95, 0x02, 0x81, 0x06, 0xc0, 0xc0};

TEST(HidReportDescriptor, TheMouseOfTheStandardHasItsTwoCollectionsAndNoOther) {
  for (unsigned page = 0; page < 16; ++page) {
    for (unsigned usage = 0; usage < 0x40; ++usage) {
      const HidUsage wanted{static_cast<std::uint16_t>(page), static_cast<std::uint16_t>(usage)};
      EXPECT_EQ(has_collection(kMouseDescriptor, wanted), wanted == kMouse || wanted == kPointer)
          << page << " " << usage;
    }
  }
}

TEST(HidReportDescriptor, CutOffHasTheCollectionsThatAreWhole) {
  for (std::size_t size = 0; size <= kMouseDescriptor.size(); ++size) {
    const auto part = std::span(kMouseDescriptor).first(size);
    EXPECT_EQ(has_collection(part, kMouse), size >= 6) << size;
    EXPECT_EQ(has_collection(part, kPointer), size >= 10) << size;
  }
}

TEST(HidReportDescriptor, AUsageHoldsForTheNextMainItemOnly) {
  // Usage (pointer), input, collection.
  EXPECT_FALSE(has_collection(Bytes{0x05, 0x01, 0x09, 0x01, 0x81, 0x02, 0xa1, 0x00}, kPointer));
  // The first of two usages is the collection's, as in Linux.
  EXPECT_TRUE(has_collection(Bytes{0x05, 0x01, 0x09, 0x01, 0x09, 0x02, 0xa1, 0x00}, kPointer));
  EXPECT_FALSE(has_collection(Bytes{0x05, 0x01, 0x09, 0x01, 0x09, 0x02, 0xa1, 0x00}, kMouse));
}

TEST(HidReportDescriptor, AUsageOfFourBytesNamesItsPage) {
  const Bytes descriptor{0x05, 0x01, 0x0b, 0x01, 0x00, 0x09, 0x00, 0xa1, 0x01};
  EXPECT_TRUE(has_collection(descriptor, kButtonPage));
  EXPECT_FALSE(has_collection(descriptor, kPointer));
}

TEST(HidReportDescriptor, LongItemsArePassedOver) {
  // HID 1.11, 6.2.2.3: 0xfe, size, tag, data; whose data look like a usage.
  EXPECT_TRUE(
      has_collection(Bytes{0x05, 0x01, 0xfe, 0x02, 0xf0, 0x09, 0x01, 0x09, 0x02, 0xa1, 0x01}, kMouse));
  EXPECT_FALSE(has_collection(Bytes{0x05, 0x01, 0x09, 0x02, 0xfe, 0xff, 0xf0, 0xa1, 0x01}, kMouse));
}

}  // namespace
}  // namespace drivers::haptic
