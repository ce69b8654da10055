// Reports in the devices' format, byte by byte.
#include "drivers/haptic/space_mouse_report.h"

#include <gtest/gtest.h>

#include <chrono>
#include <vector>

namespace drivers::haptic {
namespace space_mouse_report_test {

using namespace std::chrono_literals;
using Bytes = std::vector<std::uint8_t>;

// 175 = 0x00af, −350 = 0xfea2, 35 = 0x0023.
TEST(SpaceMouseReport, OlderDevicesReportTranslationAndRotationApart) {
  SpaceMouseReports reports;
  EXPECT_TRUE(reports.take(Bytes{1, 0xaf, 0, 0xa2, 0xfe, 0x23, 0}, 1s));
  EXPECT_EQ(reports.deflection(1s).translation, (std::array{0.5, 1.0, -0.1}));
  EXPECT_EQ(reports.deflection(1s).rotation, (std::array{0.0, 0.0, 0.0}));
  EXPECT_TRUE(reports.take(Bytes{2, 0, 0, 0xaf, 0, 0, 0}, 1008ms));
  EXPECT_EQ(reports.deflection(1008ms).translation, (std::array{0.5, 1.0, -0.1}));
  EXPECT_EQ(reports.deflection(1008ms).rotation[1], -0.5);
}

TEST(SpaceMouseReport, NewerDevicesReportAllAxesAtOnce) {
  SpaceMouseReports reports;
  EXPECT_TRUE(reports.take(Bytes{1, 0xaf, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0xa2, 0xfe}, 1s));
  EXPECT_EQ(reports.deflection(1s).translation[0], 0.5);
  EXPECT_EQ(reports.deflection(1s).rotation[2], 1);
}

TEST(SpaceMouseReport, BeyondTheNominalStopIsTheStop) {
  SpaceMouseReports reports;
  EXPECT_TRUE(reports.take(Bytes{1, 0xff, 0x7f, 0x00, 0x80, 0, 0}, 1s));
  EXPECT_EQ(reports.deflection(1s).translation, (std::array{1.0, 1.0, 0.0}));
}

TEST(SpaceMouseReport, SilenceAfterZerosIsRestAndSilenceAfterADeflectionIsALostRelease) {
  SpaceMouseReports reports;
  EXPECT_EQ(reports.deflection(1000s), SpaceMouseDeflection{});
  EXPECT_TRUE(reports.take(Bytes{1, 0xaf, 0, 0, 0, 0, 0}, 1s));
  EXPECT_EQ(reports.deflection(1100ms).translation[0], 0.5);
  EXPECT_EQ(reports.deflection(1200ms), SpaceMouseDeflection{});
  // A button says nothing about the cap.
  EXPECT_TRUE(reports.take(Bytes{3, 1, 0}, 1200ms));
  EXPECT_EQ(reports.deflection(1200ms), SpaceMouseDeflection{});
}

TEST(SpaceMouseReport, TranslationAndRotationAreReleasedEachByItself) {
  SpaceMouseReports reports;
  EXPECT_TRUE(reports.take(Bytes{2, 0xaf, 0, 0, 0, 0, 0}, 1s));
  EXPECT_EQ(reports.deflection(1150ms).rotation[0], 0.5);
  EXPECT_TRUE(reports.take(Bytes{1, 0xaf, 0, 0, 0, 0, 0}, 1151ms));
  EXPECT_EQ(reports.deflection(1151ms).rotation[0], 0.0) << "a translation says nothing about it";
  EXPECT_EQ(reports.deflection(1151ms).translation[0], 0.5);
}

TEST(SpaceMouseReport, ADeflectionOfTheFutureIsNone) {
  SpaceMouseReports reports;
  EXPECT_TRUE(reports.take(Bytes{1, 0xaf, 0, 0, 0, 0, 0}, 10s));
  EXPECT_EQ(reports.deflection(9s), SpaceMouseDeflection{});
}

TEST(SpaceMouseReport, ButtonsOfBothFamiliesAndBattery) {
  SpaceMouseReports reports;
  EXPECT_TRUE(reports.take(Bytes{3, 2, 0}, 0s));
  EXPECT_EQ(reports.buttons(), 2U);
  EXPECT_TRUE(reports.take(Bytes{3, 0, 0x10, 0x40, 0x02}, 0s));  // 1, escape and control of a Pro
  EXPECT_EQ(reports.buttons(), 0x02401000U);
  EXPECT_FALSE(reports.battery_percent());
  EXPECT_TRUE(reports.take(Bytes{0x17, 87, 0}, 0s));
  EXPECT_EQ(reports.battery_percent(), 87);
}

TEST(SpaceMouseReport, WhatIsNoneOfThemChangesNothing) {
  SpaceMouseReports reports;
  EXPECT_TRUE(reports.take(Bytes{1, 0xaf, 0, 0, 0, 0, 0}, 1s));
  const SpaceMouseDeflection before = reports.deflection(1s);
  for (const Bytes& report : {Bytes{}, Bytes{1}, Bytes{1, 0xaf, 0, 0, 0, 0}, Bytes(14, 1), Bytes{2, 1, 2, 3},
                              Bytes{3}, Bytes{23}, Bytes{99, 1, 2, 3, 4, 5, 6}})
    EXPECT_FALSE(reports.take(report, 1s));
  EXPECT_EQ(reports.deflection(1s), before);
  EXPECT_EQ(reports.unknown_reports(), 8U);
}

TEST(SpaceMouseReport, TheLightIsReportFour) {
  EXPECT_EQ(space_mouse_light(true), (std::array<std::uint8_t, 2>{4, 1}));
  EXPECT_EQ(space_mouse_light(false), (std::array<std::uint8_t, 2>{4, 0}));
}

}  // namespace space_mouse_report_test
}  // namespace drivers::haptic
