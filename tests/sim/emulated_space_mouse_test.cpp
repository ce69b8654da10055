// Reports of the emulated device compared with recordings of real devices; and that the driver's parser
// returns the hand's input.
#include "sim/devices/emulated_space_mouse.h"

#include <gtest/gtest.h>

#include <cstddef>
#include <map>

#include "drivers/haptic/space_mouse_report.h"

namespace sim::devices {
namespace emulated_space_mouse_test {

using namespace std::chrono_literals;
using Bytes = std::vector<std::uint8_t>;
using std::chrono::nanoseconds;

SpaceMouseMotion at_rest() {
  return [](nanoseconds) { return SpaceMouseCap{}; };
}

/// Held from 0 on, let go at `release`.
SpaceMouseMotion held(SpaceMouseCap cap, nanoseconds release) {
  return [=](nanoseconds time) { return time < release ? cap : SpaceMouseCap{}; };
}

TEST(EmulatedSpaceMouse, TranslationAndRotationTakeTurnsThreePairsOfZerosFollowThenSilence) {
  // Up by the way to the stop, tilted about the axis to the left: z down and y towards the user, -350 and
  // 175.
  EmulatedSpaceMouse mouse({}, held({.translation = {0, 0, 1}, .rotation = {0, -0.5, 0}}, 10ms));
  const auto sent = mouse.advance(10s);
  ASSERT_EQ(sent.size(), 8U);
  EXPECT_EQ(sent[0].bytes, (Bytes{1, 0, 0, 0, 0, 0xa2, 0xfe}));
  EXPECT_EQ(sent[1].bytes, (Bytes{2, 0, 0, 0xaf, 0, 0, 0}));
  for (std::size_t i = 0; i < sent.size(); ++i) {
    EXPECT_EQ(sent[i].at, i * 8ms);
    if (i < 2) continue;
    Bytes zeros(7);
    zeros[0] = i % 2 == 0 ? 1 : 2;
    EXPECT_EQ(sent[i].bytes, zeros) << i;
  }
  EXPECT_TRUE(mouse.advance(20s).empty());
}

TEST(EmulatedSpaceMouse, NewerOnesSendAllAxesAtOnceEverySixteenMilliseconds) {
  EmulatedSpaceMouse mouse({.layout = SpaceMouseLayout::kOneReport},
                           held({.translation = {0.1, 0, 0}, .rotation = {0, 0, 2}}, 20ms));
  const auto sent = mouse.advance(10s);
  ASSERT_EQ(sent.size(), 5U);
  for (std::size_t i = 0; i < sent.size(); ++i) {
    EXPECT_EQ(sent[i].at, i * 16ms);
    EXPECT_EQ(sent[i].bytes, i < 2 ? (Bytes{1, 35, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0xa2, 0xfe})
                                   : (Bytes{1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0}));
  }
}

TEST(EmulatedSpaceMouse, TheParserFindsTheHandsDeflectionInBothLayouts) {
  const SpaceMouseCap cap{.translation = {0.2, -0.4, 0.6}, .rotation = {-0.8, 1.0, -0.2}};
  for (const auto layout : {SpaceMouseLayout::kTwoReports, SpaceMouseLayout::kOneReport}) {
    EmulatedSpaceMouse mouse({.layout = layout}, held(cap, 1s));
    drivers::haptic::SpaceMouseReports reports;
    for (const auto& report : mouse.advance(100ms)) EXPECT_TRUE(reports.take(report.bytes, report.at));
    EXPECT_EQ(reports.deflection(100ms),
              (drivers::haptic::SpaceMouseDeflection{cap.translation, cap.rotation}));
  }
}

TEST(EmulatedSpaceMouse, ALostReleaseDoesNotComeBackWithTheOtherHalf) {
  const SpaceMouseCap first{.translation = {1, 0, 0}};
  const SpaceMouseCap second{.rotation = {0, 0, 1}};
  EmulatedSpaceMouse mouse({}, [&](nanoseconds time) {
    if (time < 40ms) return first;
    return time < 1s ? SpaceMouseCap{} : second;
  });
  drivers::haptic::SpaceMouseReports reports;
  for (const auto& report : mouse.advance(39ms)) EXPECT_TRUE(reports.take(report.bytes, 0s));
  EXPECT_EQ(reports.deflection(0s).translation[0], 1.0);
  mouse.lose(8);  // the last rotation, the zeros, and the first report of the second motion
  const auto sent = mouse.advance(1010ms);
  ASSERT_EQ(sent.size(), 1U);
  ASSERT_EQ(sent[0].bytes[0], 2);
  EXPECT_TRUE(reports.take(sent[0].bytes, 1008ms));
  EXPECT_EQ(reports.deflection(1008ms).translation[0], 0.0);
  EXPECT_EQ(reports.deflection(1008ms).rotation[2], 1.0);
}

TEST(EmulatedSpaceMouse, ButtonsOfBothSizesAndTheBatteryAreReportedOnceEach) {
  EmulatedSpaceMouse small({}, at_rest());
  small.press(2);
  EXPECT_EQ(small.advance(0ms).at(0).bytes, (Bytes{3, 2, 0}));
  EXPECT_TRUE(small.advance(1s).empty());

  EmulatedSpaceMouse pro({.pro_buttons = true}, at_rest());
  pro.press(0x02401000);
  EXPECT_EQ(pro.advance(0ms).at(0).bytes, (Bytes{3, 0, 0x10, 0x40, 0x02}));
  pro.set_battery(100);
  EXPECT_EQ(pro.advance(8ms).at(0).bytes, (Bytes{0x17, 100, 1}));
}

TEST(EmulatedSpaceMouse, TakesWhatIsForTheLightAndNothingElse) {
  EmulatedSpaceMouse mouse({}, at_rest());
  EXPECT_TRUE(mouse.take_output(drivers::haptic::space_mouse_light(true)));
  EXPECT_TRUE(mouse.lit());
  for (const Bytes& other : {Bytes{}, Bytes{4}, Bytes{4, 2}, Bytes{5, 0}, Bytes{4, 0, 0}})
    EXPECT_FALSE(mouse.take_output(other));
  EXPECT_TRUE(mouse.lit());
  EXPECT_TRUE(mouse.take_output(Bytes{4, 0}));
  EXPECT_FALSE(mouse.lit());
}

/// Bytes of each report behind its number, and of outputs with 100 added; as a host adds them up.
std::map<int, unsigned> report_sizes(const Bytes& descriptor) {
  std::map<int, unsigned> bits;
  unsigned size = 0;
  unsigned count = 0;
  int number = 0;
  int depth = 0;
  for (std::size_t i = 0; i < descriptor.size();) {
    const unsigned item = descriptor[i];
    const unsigned length = (item & 3U) == 3 ? 4 : item & 3U;
    EXPECT_LE(i + 1 + length, descriptor.size());
    const unsigned value = length > 0 ? descriptor[i + 1] : 0;
    switch (item & ~3U) {
      case 0x74: size = value; break;
      case 0x94: count = value; break;
      case 0x84: number = static_cast<int>(value); break;
      case 0x80: bits[number] += size * count; break;
      case 0x90: bits[number + 100] += size * count; break;
      case 0xa0: ++depth; break;
      case 0xc0: --depth; break;
      default: break;
    }
    i += 1 + length;
  }
  EXPECT_EQ(depth, 0);
  for (auto& [report, sum] : bits) {
    EXPECT_EQ(sum % 8, 0U) << report;
    sum /= 8;
  }
  return bits;
}

TEST(EmulatedSpaceMouse, TheDescriptorPromisesTheReportsThatAreSent) {
  using Sizes = std::map<int, unsigned>;
  const auto sizes = [](const EmulatedSpaceMouseOptions& options) {
    return report_sizes(EmulatedSpaceMouse(options, at_rest()).report_descriptor());
  };
  EXPECT_EQ(sizes({}), (Sizes{{1, 6}, {2, 6}, {3, 2}, {104, 1}}));
  EXPECT_EQ(sizes({.pro_buttons = true}), (Sizes{{1, 6}, {2, 6}, {3, 4}, {104, 1}}));
  EXPECT_EQ(sizes({.layout = SpaceMouseLayout::kOneReport}), (Sizes{{1, 12}, {3, 2}, {23, 2}, {104, 1}}));
}

}  // namespace emulated_space_mouse_test
}  // namespace sim::devices
