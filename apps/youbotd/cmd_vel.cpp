#include "apps/youbotd/cmd_vel.h"

#include <utility>

#include "live/ros_messages.h"

namespace youbotd {
namespace {

/// Ahead, to the left, counter-clockwise: what a base on the floor can do of it. Nothing: no valid message.
std::optional<control::PlanarVector> planar(CmdVel::Form form, std::string_view payload) {
  live::ros::Twist twist;
  try {
    twist = form == CmdVel::Form::kTwist ? live::ros::read_twist(payload)
                                         : live::ros::read_twist_stamped(payload);
  } catch (const runtime::mcap::BadRecord&) {
    return std::nullopt;
  }
  const auto is_plausible = [](const Eigen::Vector3d& vector) {
    return vector.allFinite() && vector.lpNorm<Eigen::Infinity>() <= CmdVel::kLargest;
  };
  if (!is_plausible(twist.linear_m_per_s) || !is_plausible(twist.angular_rad_per_s)) return std::nullopt;
  return control::PlanarVector(twist.linear_m_per_s.x(), twist.linear_m_per_s.y(),
                               twist.angular_rad_per_s.z());
}

}  // namespace

void CmdVel::hear(std::uint64_t publisher, Form form, std::string_view payload, Time now) {
  const auto twist_B = planar(form, payload);
  const std::lock_guard lock(mutex_);
  if (steers_ && *steers_ != publisher && now - heard_ <= silence_) {
    ++refused_.others;
    return;
  }
  if (!twist_B) {
    ++refused_.invalid;
    return;
  }
  if (steers_ != publisher) {
    steers_ = publisher;
    freshness_ = Freshness::after_silence(now);
  }
  heard_ = now;
  if (freshness_.hear(now)) newest_ = Command{*twist_B, publisher, form};
}

std::optional<CmdVel::Command> CmdVel::take() {
  const std::lock_guard lock(mutex_);
  return std::exchange(newest_, std::nullopt);
}

CmdVel::Refused CmdVel::refused() const {
  const std::lock_guard lock(mutex_);
  return refused_;
}

}  // namespace youbotd
