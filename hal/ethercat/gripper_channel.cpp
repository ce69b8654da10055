#include "hal/ethercat/gripper_channel.h"

#include <algorithm>
#include <cmath>

namespace hal {

namespace tmcl = drivers::tmcl;

namespace {

constexpr double kMetresPerMicrostep = kGripperTravel_m / tmcl::kGripperBars / tmcl::kGripperTravel;

std::int32_t microsteps_per_bar(double opening_m) noexcept {
  const double microsteps = opening_m / tmcl::kGripperBars / kMetresPerMicrostep;
  return static_cast<std::int32_t>(
      std::lround(std::clamp(microsteps, 0.0, static_cast<double>(tmcl::kGripperTravel))));
}

}  // namespace

GripperChannel::GripperChannel(DriveChannel& hand, bool present, std::chrono::nanoseconds period) noexcept
    : hand_(hand), period_(period) {
  sample_.state = present ? GripperState::kIdle : GripperState::kAbsent;
}

void GripperChannel::step(const GripperCommand& command, bool enabled) noexcept {
  if (sample_.state == GripperState::kAbsent) return;
  if (!enabled) {
    goal_.reset();
    if (running_ != nullptr && !stop_) stop(GripperState::kIdle);
  } else if (command.move && !stop_) {
    const std::int32_t goal = microsteps_per_bar(command.opening_m);
    if (goal_ != goal) {
      goal_ = goal;
      // A calibration that has begun is completed; the goal follows.
      if (!calibrated_ && !calibration_)
        begin(calibration_.emplace(tmcl::GripperCalibration::Repeat::kWhenNeeded, config_, period_));
      else if (calibrated_)
        begin(motion_.emplace(goal, config_, period_));
    }
  }
  run_sequence();
}

void GripperChannel::begin(tmcl::Sequence& sequence) noexcept {
  running_ = &sequence;
  tag_ = std::max(tag_ + 1, DriveChannel::kOwnTags);
  sample_.state = GripperState::kMoving;
}

void GripperChannel::run_sequence() noexcept {
  std::optional<tmcl::Completion> answer = hand_.answer_for_others();
  if (running_ == nullptr) return;
  if (answer && answer->tag != tag_) answer.reset();
  const tmcl::Action action = running_->step(hand_.input(), answer ? &*answer : nullptr);
  if (action.ask) hand_.ask(*action.ask, tag_);
  if (running_->progress() == tmcl::Progress::kRunning) return;
  const bool done = running_->progress() == tmcl::Progress::kDone;
  running_ = nullptr;
  if (stop_) {
    // Repeated until both bars have acknowledged.
    if (!done) return begin(stop_.emplace(period_));
    stop_.reset();
    sample_.state = after_stop_;
  } else if (!done) {
    stop(GripperState::kFailed);
  } else if (calibration_) {
    calibration_.reset();
    calibrated_ = true;
    begin(motion_.emplace(*goal_, config_, period_));
  } else {
    sample_.opening_m = kMetresPerMicrostep * (motion_->opening(0) + motion_->opening(1));
    sample_.state = GripperState::kIdle;
    motion_.reset();
  }
}

void GripperChannel::stop(GripperState afterwards) noexcept {
  calibration_.reset();
  motion_.reset();
  after_stop_ = afterwards;
  begin(stop_.emplace(period_));
}

void GripperChannel::forget() noexcept {
  goal_.reset();
  calibrated_ = false;
  // The board in between may have kept its power, so the bars may still be moving; pending requests are no
  // longer answered.
  if (running_ != nullptr) stop(stop_ ? after_stop_ : GripperState::kIdle);
}

}  // namespace hal
