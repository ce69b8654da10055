#include "tests/faults/checker.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstring>

namespace faults {
namespace {

using namespace std::chrono_literals;

constexpr auto kWatchdog = support::RobotWatch::kWatchdog;
constexpr double kWheelTorque_Nm = 2.4;                                  // the world's configuration
constexpr std::array<double, 5> kArmTorque_Nm{9.5, 9.5, 6.0, 2.0, 1.0};  // robot description, likewise
/// The limits of the configurations, plus the speed that a wheel gains until the drives are off.
constexpr double kBaseWheelSpeed_rad_per_s = 12.0 * 1.15;
constexpr double kManipulatorWheelSpeed_rad_per_s = 16.0 * 1.15;
constexpr double kArmSpeed_rad_per_s = 3.0 * 1.3;
/// Three times the limit of the commander.
constexpr double kBaseSpeed_m_per_s = 0.9;
constexpr double kHandForce_N = 8.0;

std::vector<support::DriveLimits> configured_limits(Machine machine) {
  std::vector<support::DriveLimits> limits =
      support::robot_limits(true, machine == Machine::kManipulator ? 1 : 0);
  for (std::size_t i = 0; i < limits.size(); ++i)
    limits[i].torque_Nm = i < 4 ? kWheelTorque_Nm : kArmTorque_Nm[i - 4];
  return limits;
}

std::string milliseconds_of(nanoseconds time) { return std::to_string(time / 1ms) + " ms"; }

}  // namespace

Checker::Checker(World& world)
    : world_(world), watch_(configured_limits(world.machine())), drives_(world.joints()) {
  world.be_watched_by(this);
}

void Checker::mix(std::uint64_t value) noexcept {
  for (int byte = 0; byte < 8; ++byte) {
    digest_ = (digest_ ^ (value & 0xFFU)) * 1099511628211U;
    value >>= 8U;
  }
}

void Checker::enable_granted() {
  watch_.permit();
  motion_.run_granted();
}

void Checker::nothing_runs() {
  if (watch_.permitted()) permitted_until_ = world_.now() + kWatchdog;
  watch_.forbid();
}

void Checker::began(const Event& event) {
  if (!first_event_ && works_) {
    first_event_ = world_.now();
    first_pose_ = world_.emulation().pose();
  }
  const bool lasts = event.kind->longest.count() > 0;
  // Boards that hear nothing because of another event go on until their watchdog ends.
  const bool alone = active_events_ == 0 && world_.now() - last_change_ > kWatchdog;
  if (!alone)
    for (Deadline& deadline : deadlines_) deadline.at = std::max(deadline.at, deadline.began + kWatchdog);
  if (lasts) ++active_events_;
  last_change_ = world_.now();
  auto allowed = event.kind->last_torque_after;
  if (world_.machine() == Machine::kManipulator) allowed += event.kind->lowering;
  if (allowed.count() > 0 && !alone) allowed = std::max(allowed, kWatchdog);
  // A service with a delayed thread has not received the order yet.
  const bool heard = lasts || world_.now() >= world_.beats_paused_until;
  if (works_ && heard && allowed.count() > 0 && (!lasts || event.duration >= allowed))
    deadlines_.push_back({.began = world_.now(),
                          .at = world_.now() + allowed,
                          .event = &event,
                          .lasts = lasts,
                          .allowed = allowed});
}

void Checker::ended(const Event& event) {
  if (event.kind->longest.count() > 0) --active_events_;
  last_change_ = world_.now();
  std::erase_if(deadlines_,
                [&](const Deadline& deadline) { return deadline.lasts && deadline.event == &event; });
}

void Checker::period_passed() {
  motion_.add(world_);
  const bool worked = works_;
  look_at_boards();
  if (works_ && !met_run_is_over_) {
    last_torque_ = world_.now();
    const control::PlanarPose& pose = world_.emulation().pose();
    if (first_event_)
      travel_m_ = std::max(travel_m_, std::hypot(pose.x_m - first_pose_.x_m, pose.y_m - first_pose_.y_m));
  }
  if (first_event_ && worked && !works_) met_run_is_over_ = true;
  check_speeds();
  check_hand();
  check_deadlines();
}

void Checker::look_at_boards() {
  sim::bus::YoubotBus& robot = world_.emulation();
  for (std::size_t joint = 0; joint < drives_.size(); ++joint) {
    const sim::bus::TmcmBoard& board = robot.board(joint);
    const auto& followed = board.followed();
    mix(static_cast<std::uint64_t>(board.input().position_ticks));
    mix(followed
            ? static_cast<std::uint64_t>(followed->mode) << 32U ^ static_cast<std::uint32_t>(followed->value)
            : 0);
  }
  support::look_at(robot, drives_);
  watch_.look(world_.now(), drives_);
  works_ = std::ranges::any_of(drives_, &support::FollowedDrive::acts);
}

void Checker::check_speeds() {
  if (!works_) return;
  sim::bus::YoubotBus& robot = world_.emulation();
  sim::MobileManipulator* const arm = robot.manipulator();
  const control::PlanarVector twist = arm != nullptr ? arm->twist() : robot.base().twist();
  if (std::hypot(twist[0], twist[1]) > kBaseSpeed_m_per_s)
    violate("the base drives at " + std::to_string(std::hypot(twist[0], twist[1])) + " m/s");
  for (int wheel = 0; wheel < 4; ++wheel) {
    const double speed =
        std::abs((arm != nullptr ? arm->wheel(wheel) : robot.base().wheel(wheel)).velocity_rad_per_s());
    if (speed > (arm != nullptr ? kManipulatorWheelSpeed_rad_per_s : kBaseWheelSpeed_rad_per_s))
      violate("wheel " + std::to_string(wheel + 1) + " turns at " + std::to_string(speed) + " rad/s");
  }
  if (arm == nullptr) return;
  for (int joint = 0; joint < control::kArmJoints; ++joint)
    if (const double speed = std::abs(arm->velocity()[3 + joint]); speed > kArmSpeed_rad_per_s)
      violate("arm joint " + std::to_string(joint + 1) + " turns at " + std::to_string(speed) + " rad/s");
}

void Checker::check_hand() {
  if (world_.hand() == nullptr) return;
  const double force_N = world_.hand()->device_force_N().norm();
  std::uint64_t bits = 0;
  std::memcpy(&bits, &force_N, sizeof bits);
  mix(bits);
  // Negated so that NaN fails the check.
  if (!(force_N <= kHandForce_N + 1e-6)) violate("the hand feels " + std::to_string(force_N) + " N");
  if (force_N > 0 && !watch_.permitted() && world_.now() > permitted_until_)
    violate("the hand feels a force without an enable");
}

void Checker::check_recordings(const std::vector<Event>& events) {
  const auto any = [&events](bool Kind::*property) {
    return std::ranges::any_of(events, [property](const Event& event) { return event.kind->*property; });
  };
  if (any(&Kind::spoils_recordings)) return;
  for (const std::string& problem : motion_.compare(world_.recordings(), !any(&Kind::spoils_samples)))
    violate(problem);
}

void Checker::check_deadlines() {
  for (Deadline& deadline : deadlines_) {
    deadline.met = deadline.met || !works_;
    // A loop that is held up sees nothing, and the boards' watchdog ends the torque.
    const nanoseconds blind_until = std::min(world_.loop_paused_until + 5ms, deadline.began + kWatchdog);
    if (world_.now() < std::max(deadline.at, blind_until) || (deadline.met && !deadline.lasts)) continue;
    for (std::size_t joint = 0; joint < drives_.size(); ++joint)
      if (drives_[joint].acts())
        violate("joint " + std::to_string(joint + 1) + " is commanded " + milliseconds_of(deadline.allowed) +
                " after " + std::string(deadline.event->kind->name));
  }
}

std::optional<std::chrono::milliseconds> Checker::last_torque_after() const {
  if (!first_event_ || !met_run_is_over_) return std::nullopt;
  return std::chrono::duration_cast<std::chrono::milliseconds>(last_torque_ - *first_event_);
}

}  // namespace faults
