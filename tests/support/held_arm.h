/// @file
/// A robot file of the youBot's arm with a payload, and the torques with which a robot holds its arm still.
#pragma once
#include <gtest/gtest.h>

#include <chrono>
#include <cstddef>
#include <filesystem>
#include <fstream>
#include <string>

#include "control/robot_model.h"
#include "hal/clock.h"
#include "hal/robot.h"
#include "tests/support/built_paths.h"
#include "tests/support/temporary_directory.h"

namespace support {

/// control/youbot_arm.toml with 1 kg in the hand, without friction, which would carry a part of the weight.
inline std::filesystem::path write_loaded_arm(const TemporaryDirectory& folder) {
  const std::filesystem::path control = std::filesystem::path(source_dir()) / "control";
  std::filesystem::copy_file(control / "youbot.urdf", folder / "youbot.urdf");
  std::ifstream shipped(control / "youbot_arm.toml");
  std::string text;
  for (std::string line; std::getline(shipped, line);)
    if (!line.starts_with("coulomb_Nm")) text += line + "\n";
  return folder.write("arm.toml", text + "[payload]\nmass_kg = 1\n");
}

/// What carries that arm in this posture.
inline control::ArmVector loaded_arm_weight_Nm(const control::ArmVector& arm_rad, double payload_kg = 1) {
  control::ModelChanges changes;
  changes.payload_kg = payload_kg;
  control::RobotModel model(changes);
  model.update((control::ChainVector() << 0, 0, 0, arm_rad).finished());
  return model.gravity_Nm().tail<control::kArmJoints>();
}

/// Activates the robot and moves its arm out of the folded posture. Returns the mean of the torques that hold
/// it there. The robot stays enabled.
inline control::ArmVector holding_torque_Nm(hal::Robot& robot, hal::VirtualClock& clock) {
  using namespace std::chrono_literals;
  constexpr std::size_t kFirst = 4;  // joint of the arm, in HAL order
  hal::RobotCommand command;
  hal::RobotSample sample;
  robot.activate();
  const auto step = [&](double velocity_rad_per_s) {
    clock.sleep_until(clock.now() + 1ms);
    command.joints.fill(hal::JointCommand::velocity_rad_per_s(0));
    for (std::size_t i = 0; i < control::kArmJoints; ++i)  // joint 3 is folded at the other end of its range
      command.joints[kFirst + i].target = i == 2 ? -velocity_rad_per_s : velocity_rad_per_s;
    EXPECT_TRUE(robot.exchange(command, sample).ok());
  };
  command.enable = true;
  for (int i = 0; i < 20'000 && !sample.enabled; ++i) step(0);
  EXPECT_TRUE(sample.enabled);
  for (int i = 0; i < 2000; ++i) step(0.4);
  for (int i = 0; i < 1000; ++i) step(0);
  constexpr int kMean = 200;
  control::ArmVector torque_Nm = control::ArmVector::Zero();
  for (int i = 0; i < kMean; ++i) {
    step(0);
    for (std::size_t joint = 0; joint < control::kArmJoints; ++joint)
      torque_Nm[static_cast<Eigen::Index>(joint)] += sample.joints[kFirst + joint].torque_Nm / kMean;
  }
  return torque_Nm;
}

inline void expect_loaded_arm_held(const control::ArmVector& torque_Nm, const control::ArmVector& arm_rad) {
  const control::ArmVector needed_Nm = loaded_arm_weight_Nm(arm_rad);
  EXPECT_GT((needed_Nm - loaded_arm_weight_Nm(arm_rad, 0)).cwiseAbs().maxCoeff(), 1.5) << "of the payload";
  EXPECT_LT((torque_Nm - needed_Nm).cwiseAbs().maxCoeff(), 0.2)
      << torque_Nm.transpose() << "\nnot " << needed_Nm.transpose();
}

}  // namespace support
