#include "sim/bus/al_state_machine.h"

#include "drivers/ethercat/registers.h"

namespace sim::bus {
namespace {

using drivers::ethercat::AlState;
using drivers::ethercat::reg::kAlError;

bool exists(AlState state) noexcept {
  switch (state) {
    case AlState::kInit:
    case AlState::kPreOp:
    case AlState::kBoot:
    case AlState::kSafeOp:
    case AlState::kOp: return true;
    default: return false;
  }
}

// Up one state at a time, down to any (ETG.1000.6, figure 6); the state numbers are in order.
bool connected(AlState from, AlState to) noexcept {
  if (to < from) return to != AlState::kBoot;
  return (from == AlState::kInit && to == AlState::kPreOp) ||
         (from == AlState::kPreOp && to == AlState::kSafeOp) ||
         (from == AlState::kSafeOp && to == AlState::kOp);
}

}  // namespace

std::uint16_t AlStateMachine::status() const noexcept {
  return static_cast<std::uint16_t>(static_cast<unsigned>(state_) | (error_ ? kAlError : 0U));
}

void AlStateMachine::request(std::uint16_t control, std::uint16_t obstacle, bool outputs_valid,
                             std::chrono::nanoseconds outputs_time) noexcept {
  const AlState requested = requested_state(control);
  if (error_) {
    const bool acknowledged = (control & kAlError) != 0;
    if (!acknowledged && !(exists(requested) && requested < state_)) return;
    error_ = false;
    code_ = al_code::kNone;
  }
  waiting_ = false;
  if (requested == state_) return;
  if (!exists(requested)) {
    refuse(al_code::kUnknownState);
  } else if (requested == AlState::kBoot && state_ == AlState::kInit) {
    refuse(al_code::kNoBootstrap);
  } else if (!connected(state_, requested)) {
    refuse(al_code::kInvalidStateChange);
  } else if (requested > state_ && obstacle != al_code::kNone) {
    refuse(obstacle);
  } else if (requested == AlState::kOp && !outputs_valid) {
    waiting_ = true;
    wait_left_ = outputs_time;
  } else {
    enter(requested);
  }
}

void AlStateMachine::advance(std::chrono::nanoseconds step) noexcept {
  if (!waiting_) return;
  wait_left_ -= step;
  if (wait_left_.count() > 0) return;
  waiting_ = false;
  refuse(al_code::kNoValidOutputs);
}

void AlStateMachine::outputs_arrived() noexcept {
  if (waiting_) enter(AlState::kOp);
}

void AlStateMachine::fall_back(AlState state, std::uint16_t code) noexcept {
  enter(state);
  refuse(code);
}

void AlStateMachine::refuse(std::uint16_t code) noexcept {
  error_ = true;
  code_ = code;
}

void AlStateMachine::enter(AlState state) noexcept {
  state_ = state;
  error_ = waiting_ = false;
  code_ = al_code::kNone;
}

}  // namespace sim::bus
