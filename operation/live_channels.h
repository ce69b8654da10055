/// @file
/// The channels of stream and topics: cycles as ROS 2 messages.
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "control/odometry_covariance.h"
#include "live/outlet.h"
#include "live/transforms.h"
#include "operation/live_feed.h"

namespace operation {

/// One thread, that of the outlet.
class LiveChannels {
 public:
  /// Set-up: adds the channels. The outlet must outlive them. `geometry`: of the base, for the covariance of
  /// its odometry. @throws std::invalid_argument if it is out of range.
  LiveChannels(live::Outlet& outlet, bool teleoperated, const control::BaseGeometry& geometry);

  void publish(const LiveSample& sample);
  /// A status in the form of `youbotctl status --json`, for the page, and as diagnostics.
  void publish_status(std::uint64_t time_ns, const nlohmann::json& status);

  /// Names of the columns of /youbot/record.
  const std::vector<std::string>& columns() const noexcept { return columns_; }

 private:
  struct Motion {
    std::uint64_t time_ns;
    std::array<double, 3> base_W;
  };
  void publish(std::uint64_t time_ns, const CycleRecord& record);
  void publish(std::uint64_t time_ns, const TeleopRecord& record);
  /// `wheel_rad`: of the four wheels.
  void publish_odometry(std::uint64_t time_ns, const std::array<double, 3>& base_W, const double* wheel_rad);
  void publish_transforms(std::uint64_t time_ns, const std::array<double, 3>& base_W, const double* arm_rad);
  template <typename Record>
  void publish_record(std::uint64_t time_ns, const Record& record);
  template <typename Write>
  void send(std::size_t channel, std::uint64_t time_ns, const Write& write);

  live::Outlet& outlet_;
  live::RobotTransforms transforms_;
  std::vector<std::string> columns_;
  std::size_t record_ = 0, status_ = 0, joint_states_ = 0, joint_commands_ = 0, odometry_ = 0, frames_ = 0,
              diagnostics_ = 0;
  // Of teleoperation.
  std::size_t end_effector_ = 0, setpoint_ = 0, wrench_ = 0, felt_force_ = 0;
  std::optional<Motion> before_;
  control::OdometryCovariance covariance_;  // since the run began
  bool running_ = false;                    // otherwise only what the joints measure is published
  runtime::mcap::CdrWriter cdr_;
  std::map<std::string, double> positions_;
};

}  // namespace operation
