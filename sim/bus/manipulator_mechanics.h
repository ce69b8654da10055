/// @file
/// The boards of base and arm on one coupled robot: gravity, contact and the interaction of arm and base.
///
/// Units: SI at the joint; angles are the official driver's. Errors: std::invalid_argument from the
/// constructor. One thread; the cycle neither allocates nor locks.
#pragma once
#include <array>
#include <chrono>
#include <cstddef>

#include "control/planar.h"
#include "sim/bus/board_drive.h"
#include "sim/mobile_manipulator.h"

namespace sim::bus {

/// Each board commands its own joint; advance() moves the robot under all nine together. A joint without
/// power gets zero current, because sim::MobileManipulator switches all its bridges together.
class ManipulatorMechanics {
 public:
  static constexpr std::size_t kJoints = 9;  ///< wheels 1 to 4, arm joints 1 to 5

  /// @throws std::invalid_argument see sim::MobileManipulator
  ManipulatorMechanics(const MobileManipulatorParameters& parameters,
                       const EnvironmentParameters& environment)
      : robot_(parameters, environment) {
    read_joints();
  }

  BoardDrive& drive(std::size_t joint) noexcept { return joints_[joint]; }
  /// Cycle.
  void advance(std::chrono::nanoseconds period) noexcept;

  MobileManipulator& robot() noexcept { return robot_; }
  /// Same as robot().pose(), with a stable address.
  const control::PlanarPose& pose() const noexcept { return pose_; }

 private:
  class Joint final : public BoardDrive {
   public:
    void command(const hal::JointCommand& command, bool powered) noexcept override {
      command_ = powered ? command : hal::JointCommand{};
    }
    hal::JointSample measured() const noexcept override { return sample_; }

    hal::JointCommand command_;
    hal::JointSample sample_;
  };
  void read_joints() noexcept;

  MobileManipulator robot_;
  std::array<Joint, kJoints> joints_;
  control::PlanarPose pose_;
};

}  // namespace sim::bus
