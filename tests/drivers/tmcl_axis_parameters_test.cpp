#include "drivers/tmcl/axis_parameters.h"

#include <gtest/gtest.h>

#include <set>

namespace drivers::tmcl {
namespace tmcl_axis_parameters_test {

TEST(TmclAxisParameters, CompilerLooksUpByName) {
  static_assert(drive_parameter("maximum_motor_current").number == 6);
  static_assert(gripper_parameter("stall_guard_threshold").number == 174);
  static_assert(get(gripper_parameter("actual_position"), 1) ==
                Request{kGripperModule, Command::kGetAxisParameter, 1, 1, 0});
}

TEST(TmclAxisParameters, LookUpByNumberAndNameAgree) {
  for (const AxisParameter& row : kDriveParameters) {
    EXPECT_EQ(find_drive_parameter(row.number), &row);
    EXPECT_EQ(find_drive_parameter(row.name), &row);
    EXPECT_EQ(row.module, kDriveModule);
    EXPECT_STRNE(name(row.unit), "unknown unit");
  }
  for (const AxisParameter& row : kGripperParameters) {
    EXPECT_EQ(find_gripper_parameter(row.number), &row);
    EXPECT_EQ(find_gripper_parameter(row.name), &row);
    EXPECT_EQ(row.module, kGripperModule);
  }
}

TEST(TmclAxisParameters, UnknownOnesAreNotFound) {
  EXPECT_EQ(find_drive_parameter(255), nullptr);
  EXPECT_EQ(find_drive_parameter("nonsense"), nullptr);
  EXPECT_EQ(find_gripper_parameter(9), nullptr);
  EXPECT_EQ(find_gripper_parameter(""), nullptr);
}

// The password-protected classes of the official driver, and the old parameters beside them.
TEST(TmclAxisParameters, ProtectionIsTheOfficialDrivers) {
  const std::set<int> expected{6,   9,   25,  26,  28,  30,  90,  133, 134, 159, 161, 162, 163, 164, 165, 166,
                               177, 238, 239, 240, 241, 242, 243, 244, 245, 249, 250, 251, 252, 253, 254};
  std::set<int> found;
  for (const AxisParameter& row : kDriveParameters) {
    if (row.protection == Protection::kPassword) found.insert(row.number);
  }
  EXPECT_EQ(found, expected);
}

TEST(TmclAxisParameters, AccessAndRangeSpotChecks) {
  EXPECT_EQ(drive_parameter("error_and_status").access, Access::kRead);
  EXPECT_EQ(drive_parameter("clear_i2t_exceeded_flag").access, Access::kWrite);
  EXPECT_EQ(drive_parameter("actual_position").access, Access::kReadWrite);
  EXPECT_TRUE(drive_parameter("target_current").in_range(-20000));
  EXPECT_FALSE(drive_parameter("target_current").in_range(-20001));
  EXPECT_FALSE(gripper_parameter("smart_energy_current_up_step").in_range(0));
}

TEST(TmclAxisParameters, OldParametersEndWithFirmware2) {
  for (const std::uint8_t number :
       std::to_array<std::uint8_t>({5, 153, 154, 160, 167, 168, 169, 170, 171, 176, 242, 243, 252})) {
    EXPECT_FALSE(find_drive_parameter(number)->exists_in(Firmware::k200)) << int{number};
    EXPECT_TRUE(find_drive_parameter(number)->exists_in(Firmware::k148)) << int{number};
  }
  EXPECT_TRUE(drive_parameter("current_pid2_p").exists_in(Firmware::k200));
}

}  // namespace tmcl_axis_parameters_test
}  // namespace drivers::tmcl
