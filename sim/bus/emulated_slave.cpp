#include "sim/bus/emulated_slave.h"

#include <algorithm>
#include <utility>

namespace sim::bus {

using std::chrono::nanoseconds;

EmulatedSlave::EmulatedSlave(SlaveDescription description, SlaveOptions options)
    : description_(std::move(description)),
      options_(options),
      settings_(sync_managers_of(description_)),
      mailbox_out_(index_of(SyncManagerUse::kMailboxOut)),
      mailbox_in_(index_of(SyncManagerUse::kMailboxIn)),
      outputs_(index_of(SyncManagerUse::kOutputs)),
      inputs_(index_of(SyncManagerUse::kInputs)),
      controller_(description_, options_.sii, options_.crystal) {
  mailbox_.resize(description_.mailbox_in.length);
  shut_or_open_managers();
}

std::optional<std::size_t> EmulatedSlave::index_of(SyncManagerUse use) const noexcept {
  const auto found = std::ranges::find(settings_, use, &SyncManagerSetting::use);
  if (found == settings_.end() || found->length == 0) return std::nullopt;
  return static_cast<std::size_t>(found - settings_.begin());
}

bool EmulatedSlave::event_of(std::uint32_t events, const std::optional<std::size_t>& manager) const noexcept {
  return manager && (events >> *manager & 1U) != 0;
}

// ---- power and time ----

void EmulatedSlave::set_power(bool on) noexcept {
  if (powered_ == on) return;
  powered_ = on;
  machine_.reset();
  mailbox_.clear();
  al_control_waits_ = outputs_seen_ = false;
  if (on) {
    controller_.reset(now_);
    shut_or_open_managers();
  }
  application_->power_changed(on);
}

void EmulatedSlave::advance(nanoseconds step) noexcept {
  now_ += step;
  if (!powered_) return;
  const bool expired = controller_.advance(now_, step);
  const AlState before = machine_.state();
  if (expired) {
    outputs_seen_ = false;
    application_->watchdog_expired();
    if (before == AlState::kOp) machine_.fall_back(AlState::kSafeOp, al_code::kWatchdog);
  }
  machine_.advance(step);
  follow_state(before);
  if (al_control_waits_ && (al_control_due_ -= step).count() <= 0) look_at_al_control();
  application_->advance(step);
  serve_mailbox();
  refresh_inputs();
}

// ---- frames ----

void EmulatedSlave::end_frame(bool good) noexcept {
  const FrameEvents events = controller_.end_frame(good);
  if (event_of(events.read, mailbox_in_)) mailbox_.reply_read();
  if (event_of(events.written, outputs_) && machine_.state() >= AlState::kSafeOp) {
    outputs_seen_ = true;
    const AlState before = machine_.state();
    machine_.outputs_arrived();
    if (before == AlState::kOp) deliver_outputs();  // otherwise when OP is entered
    follow_state(before);
  }
  if (events.managers_changed) check_running_configuration();
  if (events.al_control) {
    al_control_waits_ = true;
    al_control_due_ = options_.state_change_time;
    if (al_control_due_.count() <= 0) look_at_al_control();
  }
  serve_mailbox();
}

// ---- states ----

void EmulatedSlave::look_at_al_control() noexcept {
  al_control_waits_ = false;
  const std::uint16_t control = controller_.take_al_control();
  const AlState before = machine_.state();
  const bool outputs_valid = !outputs_ || outputs_seen_;
  machine_.request(control, obstacle_to(AlStateMachine::requested_state(control)), outputs_valid,
                   options_.outputs_time);
  follow_state(before);
}

std::uint16_t EmulatedSlave::obstacle_to(AlState state) const noexcept {
  if (state < AlState::kPreOp) return al_code::kNone;
  const bool optional =
      options_.mailbox_demand == MailboxDemand::kWhereSiiNames && description_.mailbox_protocols == 0;
  const std::uint16_t mailbox = mailbox_obstacle(settings_, controller_.manager_registers(), optional);
  if (mailbox != al_code::kNone || state < AlState::kSafeOp) return mailbox;
  return process_data_obstacle(settings_, controller_.manager_registers(), controller_.fmmus(),
                               controller_.memory_end());
}

void EmulatedSlave::check_running_configuration() noexcept {
  // Switched off, it is cleared; the next master starts with an empty one.
  if (mailbox_in_ && !controller_.manager(*mailbox_in_).guarding()) mailbox_.clear();
  const AlState before = machine_.state();
  const std::uint16_t obstacle = obstacle_to(before);
  if (before == AlState::kInit || obstacle == al_code::kNone) return;
  machine_.fall_back(obstacle == al_code::kInvalidMailbox ? AlState::kInit : AlState::kPreOp, obstacle);
  follow_state(before);
}

void EmulatedSlave::report_error(AlState state, std::uint16_t al_status_code) noexcept {
  const AlState before = machine_.state();
  machine_.fall_back(std::min(state, before), al_status_code);
  follow_state(before);
}

void EmulatedSlave::follow_state(AlState before) noexcept {
  const AlState state = machine_.state();
  controller_.set_al_status(machine_.status(), machine_.code());
  if (state == before) return;
  if (state < before) outputs_seen_ = false;
  if (state == AlState::kInit) mailbox_.clear();
  shut_or_open_managers();
  application_->state_changed(state);
  if (machine_.state() != state) return;  // the board reported an error immediately
  if (state == AlState::kOp) deliver_outputs();
  if (state == AlState::kSafeOp && before < state) refresh_inputs();
}

void EmulatedSlave::shut_or_open_managers() noexcept {
  for (std::size_t i = 0; i < settings_.size(); ++i) {
    const bool mailbox = i == mailbox_out_ || i == mailbox_in_;
    controller_.set_deactivated(i, machine_.state() < (mailbox ? AlState::kPreOp : AlState::kSafeOp));
  }
}

// ---- data ----

bool EmulatedSlave::post_mailbox(std::span<const std::uint8_t> reply) noexcept {
  return powered_ && mailbox_in_ && machine_.state() >= AlState::kPreOp && mailbox_.post(reply);
}

void EmulatedSlave::hang_mailbox(bool hung) noexcept { mailbox_.hang(hung); }

void EmulatedSlave::serve_mailbox() noexcept {
  if (!mailbox_out_ || machine_.state() < AlState::kPreOp) return;
  SyncManager& in = controller_.manager(*mailbox_in_);
  mailbox_.take_request(controller_.manager(*mailbox_out_), *application_);
  if (controller_.repeat_requested(*mailbox_in_) && mailbox_.repeat(in))
    controller_.acknowledge_repeat(*mailbox_in_);
  mailbox_.hand_out(in);
}

void EmulatedSlave::deliver_outputs() noexcept {
  if (!outputs_) return;
  const std::span<const std::uint8_t> outputs = controller_.manager(*outputs_).firmware_read();
  if (!outputs.empty()) application_->outputs_changed(outputs);
}

void EmulatedSlave::refresh_inputs() noexcept {
  if (!inputs_ || machine_.state() < AlState::kSafeOp) return;
  SyncManager& manager = controller_.manager(*inputs_);
  const std::span<std::uint8_t> buffer = manager.firmware_buffer();
  if (buffer.empty()) return;
  std::ranges::fill(buffer, std::uint8_t{0});
  application_->inputs(buffer);
  manager.firmware_publish();
}

}  // namespace sim::bus
