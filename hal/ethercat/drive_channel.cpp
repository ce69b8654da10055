#include "hal/ethercat/drive_channel.h"

#include <utility>

namespace hal {

namespace tmcl = drivers::tmcl;

/// The queue hands a request over after the next frame, the second frame checks that the mailbox is empty,
/// and only the third carries the request.
constexpr int kCyclesToWrite = 3;

const AxisData& axis_of(const tmcl::YoubotBoard& board) noexcept {
  return board.kind == tmcl::BoardKind::kWheel ? kWheelAxis : kArmAxes[static_cast<std::size_t>(board.index)];
}

DriveChannel::DriveChannel(Setup setup)
    : setup_(std::move(setup)),
      units_(axis_of(setup_.board), setup_.unsigned_current),
      hall_(axis_of(setup_.board).constants, setup_.period, kCyclesToWrite) {}

void DriveChannel::attach(drivers::ethercat::OpBus& bus) {
  transport_.emplace(bus.mailbox(setup_.slave), bus.slave(setup_.slave).label());
}

// ---- preparation ----

void DriveChannel::stop() noexcept {
  output_ = tmcl::kStopMotor;
  failed_ = false;
  if (stage_ == Stage::kRestoring) return;  // moves nothing, and is needed in any case
  stage_ = Stage::kOff;
  end_sequence();
}

void DriveChannel::stand_by() noexcept {
  if (!timeout_reset_) stop();
  if (stage_ == Stage::kOff && sensed_ && input_.flags.has(tmcl::StatusFlag::kTimeout)) clear_timeout();
}

void DriveChannel::clear_timeout() noexcept {
  begin(Stage::kClearing, timeout_reset_.emplace(tmcl::ResetConfig{}, setup_.period));
}

void DriveChannel::prepare() noexcept {
  if (stage_ != Stage::kOff || failed() || !sensed_) return;
  if (input_.flags.has(tmcl::StatusFlag::kTimeout))
    clear_timeout();
  else if (input_.flags.has(tmcl::StatusFlag::kI2tExceeded))
    begin(Stage::kClearing, i2t_reset_.emplace(tmcl::ResetConfig{}, setup_.period));
  else
    commutate();
}

void DriveChannel::commutate() noexcept {
  tmcl::CommutationConfig config;
  config.firmware = setup_.firmware;
  config.rest = tmcl::kHoldStill;  // the official driver leaves arm joints without current here: they fall
  begin(Stage::kCommutating, commutation_.emplace(config, setup_.period));
}

void DriveChannel::home_or_finish() noexcept {
  if (setup_.home && setup_.board.kind == tmcl::BoardKind::kArmJoint) {
    const tmcl::HomingConfig& config = tmcl::kArmHoming[static_cast<std::size_t>(setup_.board.index)];
    begin(Stage::kHoming, homing_.emplace(config, setup_.period));
  } else {
    stage_ = Stage::kReady;
  }
}

void DriveChannel::begin(Stage stage, tmcl::Sequence& sequence) noexcept {
  stage_ = stage;
  running_ = &sequence;
  tag_ = (tag_ + 1) % kHallTag;
  answer_.reset();
}

void DriveChannel::end_sequence() noexcept {
  running_ = nullptr;
  restoring_.reset();
  timeout_reset_.reset();
  i2t_reset_.reset();
  commutation_.reset();
  homing_.reset();
}

void DriveChannel::run_sequence() noexcept {
  if (running_ == nullptr) return;
  const tmcl::Action action = running_->step(input_, answer_ ? &*answer_ : nullptr);
  answer_.reset();
  if (action.drive) output_ = *action.drive;
  if (action.ask && !queue_.push(*action.ask, tag_)) answer_ = tmcl::Completion{*action.ask, tag_};
  const Stage ended = stage_;
  switch (running_->progress()) {
    case tmcl::Progress::kRunning: return;
    case tmcl::Progress::kFailed:
      failure_.fault = running_->fault();
      failure_.stage = std::exchange(stage_, Stage::kOff);
      stop();
      failed_ = true;
      return;
    case tmcl::Progress::kDone: break;
  }
  if (ended == failure_.stage) failure_.fault = tmcl::SequenceFault::kNone;
  if (ended == Stage::kHoming) {
    homed_ = true;
    if (!homing_->was_homed()) {
      position_.reset();  // the counter has been set to zero
      position_ticks_ = position_.update(input_.position_ticks);
    }
  }
  end_sequence();
  if (ended == Stage::kCommutating)
    home_or_finish();
  else
    // After clearing, another flag may be set behind it: prepare() checks.
    stage_ = ended == Stage::kHoming ? Stage::kReady : Stage::kOff;
}

JointFault DriveChannel::joint_fault() const noexcept {
  // During preparation, the preparation clears the flags or fails on them.
  if (!ready() && !failed()) return JointFault::kNone;
  const JointFault fault = joint_fault_of(input_.flags);
  if (fault != JointFault::kNone) return fault;
  if (failed() && failure_.stage != Stage::kCommutating) return JointFault::kNotPrepared;
  return failed() || !input_.flags.has(tmcl::StatusFlag::kInitialized) ? JointFault::kNotInitialized
                                                                       : JointFault::kNone;
}

std::string describe(const DriveChannel::Failure& failure) {
  using Stage = DriveChannel::Stage;
  if (failure.fault == tmcl::SequenceFault::kNone) return {};
  const char* step = "start it up";
  if (failure.stage == Stage::kRestoring) step = "give it its parameters back";
  if (failure.stage == Stage::kClearing) step = "clear its fault";
  if (failure.stage == Stage::kCommutating) step = "find its commutation";
  if (failure.stage == Stage::kHoming) step = "find its end stop";
  return std::string("could not ") + step + ": " + tmcl::describe(failure.fault) + "; " +
         tmcl::advice(failure.fault);
}

void DriveChannel::forget() noexcept {
  position_.restart_counter();
  queue_.clear();
  hall_.forget();
  sensed_ = homed_ = failed_ = false;
  end_sequence();
  output_ = tmcl::kStopMotor;
}

bool DriveChannel::restore() noexcept {
  if (stage_ != Stage::kRestoring) {
    forget();
    begin(Stage::kRestoring, restoring_.emplace(setup_.parameters, setup_.period));
  }
  run_sequence();
  return stage_ == Stage::kOff && !failed_;
}

// ---- every cycle ----

void DriveChannel::serve_mailbox() noexcept {
  queue_.step(*transport_);
  while (const auto completion = queue_.pop()) {
    if (completion->tag >= kOwnTags)
      answer_for_others_ = completion;
    else if (completion->tag == kHallTag)
      hall_.answer(*completion);
    else if (completion->tag == tag_)
      answer_ = completion;
  }
  // After the others, so that none waits for it.
  if (hall_.due() && ready() && sensed_ && queue_.idle() && queue_.push(HallReader::request(), kHallTag))
    hall_.ask();
}

void DriveChannel::ask(const tmcl::Request& request, std::uint32_t tag) noexcept {
  if (!queue_.push(request, tag)) answer_for_others_ = tmcl::Completion{request, tag};
}

std::optional<tmcl::Completion> DriveChannel::answer_for_others() noexcept {
  return std::exchange(answer_for_others_, std::nullopt);
}

void DriveChannel::drive(const JointCommand& command, bool enabled, std::span<std::uint8_t> pdo) noexcept {
  // Without new inputs from the drive, a sequence would mistake old ones for standstill.
  if (std::exchange(fresh_, false) && stage_ != Stage::kRestoring) run_sequence();
  if (ready()) output_ = enabled ? units_.output(command, input_, position_ticks_) : tmcl::kHoldStill;
  (void)tmcl::pack(output_, pdo);
}

bool DriveChannel::sense(std::span<const std::uint8_t> pdo) noexcept {
  if (!tmcl::unpack(setup_.firmware, pdo, input_)) return false;
  position_ticks_ = position_.update(input_.position_ticks);
  // An arm joint never wraps the counter, so the position of a homed one equals the counter: a temporarily
  // wrong reading leaves no wraps in its position.
  if (homed_) position_ticks_ = input_.position_ticks;
  hall_.pass(position_ticks_);
  sensed_ = fresh_ = true;
  return true;
}

JointSample DriveChannel::sample() const noexcept {
  JointSample sample = units_.sample(input_, output_, position_ticks_);
  sample.homed = homed_;
  sample.rotor = hall_.reading();
  return sample;
}

}  // namespace hal
