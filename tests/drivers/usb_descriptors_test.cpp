#include "drivers/usb/usb_descriptors.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace drivers::usb {
namespace usb_descriptors_test {

using Bytes = std::vector<std::uint8_t>;
using Lines = std::vector<std::string>;

const Bytes kDevice{18, 1, 0x00, 0x02, 0, 0, 0, 8, 0x03, 0x04, 0x48, 0xcb, 0x00, 0x06, 1, 2, 0, 1};
const Bytes kConfiguration{9, 2, 32, 0, 1, 1, 0, 0x80, 45};
const Bytes kInterface{9, 4, 0, 0, 2, 0xFF, 0xFF, 0xFF, 2};
const Bytes kBulkIn{7, 5, 0x81, 2, 64, 0, 0};
const Bytes kBulkOut{7, 5, 0x02, 2, 64, 0, 0};

Bytes joined(const std::vector<Bytes>& parts) {
  Bytes all;
  for (const Bytes& part : parts) all.insert(all.end(), part.begin(), part.end());
  return all;
}

const Bytes kFalcon = joined({kDevice, kConfiguration, kInterface, kBulkIn, kBulkOut});

// The fields as the USB 2.0 specification lays them out, tables 9-8, 9-10, 9-12 and 9-13.
TEST(UsbDescriptors, FtdiChipIsReportedInWords) {
  const DescriptorReport report = report_descriptors(kFalcon);
  EXPECT_EQ(report.malformed, std::nullopt);
  EXPECT_EQ(
      report.lines,
      (Lines{
          "device 0403:cb48, release 6.00, USB 2.00, class 0x00 (per interface), endpoint 0 of 8 bytes, 1 "
          "configuration",
          "  configuration 1: 1 interface, bus power, at most 90 mA, 32 bytes in all",
          "    interface 0, alternate setting 0: class 0xff (vendor's own), subclass 0xff, protocol 0xff, 2 "
          "endpoints",
          "      endpoint 0x81 IN: bulk, packets of 64 bytes, interval 0",
          "      endpoint 0x02 OUT: bulk, packets of 64 bytes, interval 0"}));
  EXPECT_EQ(report.interfaces, std::vector<int>{0});
}

TEST(UsbDescriptors, AlternateSettingsAssociationsHidAndUnknownOnesHaveTheirLines) {
  const Bytes configuration{9, 2, 66, 0, 2, 1, 0, 0xC0, 250};
  const DescriptorReport report = report_descriptors(joined({kDevice,
                                                             configuration,
                                                             {8, 11, 0, 2, 3, 0, 0, 0},
                                                             {9, 4, 0, 0, 0, 3, 0, 0, 0},
                                                             {9, 0x21, 0x11, 0x01, 0, 1, 0x22, 0x34, 0x12},
                                                             {9, 4, 0, 1, 1, 3, 0, 0, 0},
                                                             {7, 5, 0x83, 3, 0x00, 0x14, 1},
                                                             {9, 4, 1, 0, 0, 8, 0, 0, 0},
                                                             {6, 0x30, 1, 0xAB, 2, 3}}));
  EXPECT_EQ(report.malformed, std::nullopt);
  ASSERT_EQ(report.lines.size(), 9U);
  EXPECT_EQ(report.lines[1], "  configuration 1: 2 interfaces, own power, at most 500 mA, 66 bytes in all");
  EXPECT_EQ(report.lines[2], "    interfaces 0 to 1 belong together");
  EXPECT_EQ(report.lines[4], "      HID 1.11, report descriptor of 4660 bytes");
  EXPECT_NE(report.lines[5].find("interface 0, alternate setting 1: class 0x03 (HID)"), std::string::npos);
  EXPECT_EQ(report.lines[6],
            "      endpoint 0x83 IN: interrupt, packets of 1024 bytes, 3 a microframe, interval 1");
  EXPECT_EQ(report.lines[8], "      descriptor 0x30 of 6 bytes: 01 ab 02 03");
  EXPECT_EQ(report.interfaces, (std::vector<int>{0, 1}));
}

TEST(UsbDescriptors, NothingIsMalformed) {
  const DescriptorReport report = report_descriptors({});
  EXPECT_EQ(report.malformed, "byte 0: there are none");
  EXPECT_TRUE(report.lines.empty());
}

TEST(UsbDescriptors, LengthThatLeadsNowhereEndsTheReading) {
  for (const std::uint8_t length : Bytes{0, 1}) {
    const DescriptorReport report = report_descriptors(joined({kDevice, {length, 5, 1}}));
    EXPECT_EQ(report.malformed, "byte 18: a length of " + std::to_string(length));
    EXPECT_EQ(report.lines.size(), 1U);
  }
  EXPECT_EQ(report_descriptors(joined({kDevice, {255, 5, 1}})).malformed,
            "byte 18: a length of 255 where 3 bytes are left");
}

TEST(UsbDescriptors, DescriptorTooShortForItsKindIsShownRaw) {
  const DescriptorReport report = report_descriptors(joined({kDevice, {3, 5, 0x81}}));
  EXPECT_EQ(report.malformed, "byte 18: endpoint descriptor of 3 bytes, expected 7");
  ASSERT_EQ(report.lines.size(), 2U);
  EXPECT_EQ(report.lines[1], "    descriptor 0x05 of 3 bytes: 81");
}

TEST(UsbDescriptors, ConfigurationThatCountsWrongIsMalformedAndStillReported) {
  Bytes bytes = kFalcon;
  bytes[18 + 2] = 33;
  const DescriptorReport report = report_descriptors(bytes);
  EXPECT_EQ(report.malformed, "byte 50: the configuration ends here and says that it ends at byte 51");
  EXPECT_EQ(report.lines.size(), 5U);
}

TEST(UsbDescriptors, SecondConfigurationIsReported) {
  Bytes second = joined({kConfiguration, kInterface, kBulkIn, kBulkOut});
  second[5] = 2;
  const DescriptorReport report = report_descriptors(joined({kFalcon, second}));
  EXPECT_EQ(report.malformed, std::nullopt);
  ASSERT_EQ(report.lines.size(), 9U);
  EXPECT_EQ(report.lines[5], "  configuration 2: 1 interface, bus power, at most 90 mA, 32 bytes in all");
  EXPECT_EQ(report.interfaces, std::vector<int>{0});
}

TEST(UsbDescriptors, EveryTornReadIsNoticed) {
  for (std::size_t size = 0; size < kFalcon.size(); ++size) {
    // Without a configuration there is nothing torn to be seen.
    if (size == kDevice.size()) continue;
    EXPECT_TRUE(report_descriptors(std::span(kFalcon).first(size)).malformed) << size;
  }
}

}  // namespace usb_descriptors_test
}  // namespace drivers::usb
