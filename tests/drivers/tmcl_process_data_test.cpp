#include "drivers/tmcl/process_data.h"

#include <gtest/gtest.h>

#include <limits>
#include <vector>

#include "tests/support/no_alloc_guard.h"

namespace drivers::tmcl {
namespace tmcl_process_data_test {

using Bytes = std::vector<std::uint8_t>;
constexpr std::int32_t kMax = std::numeric_limits<std::int32_t>::max();
constexpr std::int32_t kMin = std::numeric_limits<std::int32_t>::min();

// By hand: -1000 ticks, 700 mA, -156 rpm, velocity mode and initialised, then the part that differs.
const Bytes kCommon{0x18, 0xFC, 0xFF, 0xFF, 0xBC, 0x02, 0x00, 0x00,
                    0x64, 0xFF, 0xFF, 0xFF, 0x00, 0x82, 0x00, 0x00};
Bytes with(const Bytes& head, const Bytes& tail) {
  Bytes all = head;
  all.insert(all.end(), tail.begin(), tail.end());
  return all;
}
const Bytes k148Bytes = with(kCommon, {0x07, 0x07, 0x00, 0x00});
const Bytes k200Bytes = with(kCommon, {0xE8, 0x03, 0x00, 0x00, 0x0C, 0xFE, 0xFF, 0xFF,  //
                                       0x9C, 0x00, 0x00, 0x00, 0x9B, 0x00, 0x00, 0x00});

void expect_common(const DriveInput& input) {
  EXPECT_EQ(input.position_ticks, -1000);
  EXPECT_EQ(input.current_mA, 700);
  EXPECT_EQ(input.velocity_rpm, -156);
  EXPECT_TRUE(input.flags.has(StatusFlag::kInitialized));
  EXPECT_TRUE(input.flags.has(StatusFlag::kVelocityMode));
  EXPECT_FALSE(input.flags.errors().any());
}

TEST(TmclProcessData, OutputIsLittleEndianAndTheRestZero) {
  Bytes pdo(40, 0xEE);
  ASSERT_TRUE(pack(DriveOutput{ControllerMode::kCurrent, -700}, pdo));
  Bytes expected(40, 0x00);
  std::copy_n(Bytes{0x44, 0xFD, 0xFF, 0xFF, 0x06}.begin(), 5, expected.begin());
  EXPECT_EQ(pdo, expected);
  DriveOutput output;
  ASSERT_TRUE(unpack(pdo, output));
  EXPECT_EQ(output, (DriveOutput{ControllerMode::kCurrent, -700}));
}

TEST(TmclProcessData, Firmware148HasThePwm) {
  DriveInput input;
  ASSERT_TRUE(unpack(Firmware::k148, k148Bytes, input));
  expect_common(input);
  EXPECT_EQ(input.pwm, 1799);
  EXPECT_FALSE(input.targets);
}

TEST(TmclProcessData, Firmware200HasTheTargets) {
  DriveInput input;
  ASSERT_TRUE(unpack(Firmware::k200, k200Bytes, input));
  expect_common(input);
  EXPECT_FALSE(input.pwm);
  EXPECT_EQ(input.targets, (DriveTargets{1000, -500, 156, 155}));
}

TEST(TmclProcessData, FortyByteSlavesOfEitherFirmwareAreRead) {
  Bytes pdo = k148Bytes;
  pdo.resize(40, 0xEE);
  DriveInput input;
  ASSERT_TRUE(unpack(Firmware::k148, pdo, input));
  EXPECT_EQ(input.pwm, 1799);
  pdo = k200Bytes;
  pdo.resize(40, 0xEE);
  ASSERT_TRUE(unpack(Firmware::k200, pdo, input));
  EXPECT_EQ(input.targets->ramp_velocity_rpm, 155);
}

TEST(TmclProcessData, EveryPrefixIsRefusedAndChangesNothing) {
  for (const Firmware firmware : {Firmware::k148, Firmware::k200}) {
    for (std::size_t n = 0; n < input_bytes(firmware); ++n) {
      DriveInput input;
      input.position_ticks = 42;
      EXPECT_FALSE(unpack(firmware, std::span(k200Bytes).first(n), input)) << n;
      EXPECT_EQ(input.position_ticks, 42);
    }
  }
  for (std::size_t n = 0; n < kOutputBytes; ++n) {
    Bytes pdo(n, 0xEE);
    EXPECT_FALSE(pack(DriveOutput{}, pdo));
    EXPECT_EQ(pdo, Bytes(n, 0xEE));
    DriveOutput output;
    EXPECT_FALSE(unpack(pdo, output));
  }
}

TEST(TmclProcessData, SlaveSideWritesWhatTheMasterReads) {
  for (const auto& [firmware, bytes] :
       {std::pair(Firmware::k148, k148Bytes), std::pair(Firmware::k200, k200Bytes)}) {
    DriveInput input;
    ASSERT_TRUE(unpack(firmware, bytes, input));
    Bytes written(bytes.size(), 0xEE);
    ASSERT_TRUE(pack(firmware, input, written));
    EXPECT_EQ(written, bytes);
    Bytes short_one(bytes.size() - 1);
    EXPECT_FALSE(pack(firmware, input, short_one));
  }
}

TEST(TmclProcessData, ExtremeValuesSurvive) {
  for (const std::int32_t value : {kMin, -1, 0, 1, kMax}) {
    Bytes pdo(kOutputBytes);
    pack(DriveOutput{ControllerMode::kPosition, value}, pdo);
    DriveOutput output;
    unpack(pdo, output);
    EXPECT_EQ(output.value, value);
  }
}

TEST(TmclFlags, OnlyTwoNeedToBeCleared) {
  for (const FlagInfo& flag : kStatusFlags) {
    const FlagReset expected = flag.flag == StatusFlag::kTimeout       ? FlagReset::kClearTimeout
                               : flag.flag == StatusFlag::kI2tExceeded ? FlagReset::kClearI2t
                                                                       : FlagReset::kAutomatic;
    EXPECT_EQ(flag.reset, expected) << flag.name;
    EXPECT_NE(describe(flag.reset), nullptr);
  }
}

TEST(TmclFlags, ErrorsWarningsAndStatesAreDistinguished) {
  const StatusFlags flags(1U << 0 | 1U << 9 | 1U << 15 | 1U << 16);
  EXPECT_EQ(flags.of(FlagKind::kWarning).raw(), 1U << 0);
  EXPECT_EQ(flags.of(FlagKind::kState).raw(), 1U << 9 | 1U << 15);
  EXPECT_EQ(flags.errors().raw(), 1U << 16);
  EXPECT_STREQ(info(StatusFlag::kTimeout).name, "process data timeout");
}

TEST(TmclFlags, UnknownBitsAreNoErrors) { EXPECT_FALSE(StatusFlags(0xFFFC0000U).errors().any()); }

TEST(TmclCurrentSign, SignedCurrentPassesUntouched) {
  DriveInput input;
  input.current_mA = -700;
  EXPECT_EQ(signed_current_mA(CurrentSign::kSigned, input, {ControllerMode::kCurrent, 500}), -700);
}

TEST(TmclCurrentSign, AbsoluteCurrentTakesTheSignOfTargetThenCommandThenVelocity) {
  DriveInput input;
  input.current_mA = 700;
  input.velocity_rpm = -10;
  EXPECT_EQ(signed_current_mA(CurrentSign::kAbsolute, input, {ControllerMode::kVelocity, 5}), -700);
  EXPECT_EQ(signed_current_mA(CurrentSign::kAbsolute, input, {ControllerMode::kCurrent, 500}), 700);
  input.targets = DriveTargets{0, -600, 0, 0};
  EXPECT_EQ(signed_current_mA(CurrentSign::kAbsolute, input, {ControllerMode::kCurrent, 500}), -700);
  input.current_mA = kMin;
  EXPECT_EQ(signed_current_mA(CurrentSign::kAbsolute, input, {}), -kMax) << "saturates";
}

TEST(PositionUnwrapper, ContinuesAcrossTheWrapBothWays) {
  PositionUnwrapper unwrapper;
  EXPECT_EQ(unwrapper.update(kMax - 5), std::int64_t{kMax} - 5);
  EXPECT_EQ(unwrapper.update(kMin + 4), std::int64_t{kMax} + 5) << "ten forward";
  EXPECT_EQ(unwrapper.update(kMax), std::int64_t{kMax}) << "five back";
}

TEST(PositionUnwrapper, CountsManyTurnsOfTheCounterBackwards) {
  PositionUnwrapper unwrapper;
  std::uint32_t counter = 0;
  std::int64_t position = unwrapper.update(0);
  for (int i = 0; i < 100; ++i) {
    counter -= 1U << 30;
    position = unwrapper.update(static_cast<std::int32_t>(counter));
  }
  EXPECT_EQ(position, -100 * (std::int64_t{1} << 30));
}

TEST(PositionUnwrapper, ResetTakesTheNextValueAsItIs) {
  PositionUnwrapper unwrapper;
  unwrapper.update(kMax);
  unwrapper.update(kMin);
  unwrapper.reset();
  EXPECT_EQ(unwrapper.update(-3), -3);
  EXPECT_EQ(unwrapper.position_ticks(), -3);
}

TEST(TmclProcessData, CycleDoesNotAllocate) {
  std::array<std::uint8_t, 40> pdo{};
  PositionUnwrapper unwrapper;
  DriveInput input;
  const support::NoAllocGuard guard;
  pack(DriveOutput{ControllerMode::kCurrent, 100}, pdo);
  unpack(Firmware::k200, pdo, input);
  unwrapper.update(input.position_ticks);
  const std::uint32_t errors = input.flags.errors().raw();
  const long violations = guard.violations();
  EXPECT_EQ(errors, 0U);
  EXPECT_EQ(violations, 0);
}

}  // namespace tmcl_process_data_test
}  // namespace drivers::tmcl
