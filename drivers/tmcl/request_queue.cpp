#include "drivers/tmcl/request_queue.h"

namespace drivers::tmcl {
namespace {

// More than one can only be stale ones; the rest is read in the next cycle.
constexpr int kMaxRepliesPerCycle = 4;

}  // namespace

const char* describe(Outcome outcome) noexcept {
  switch (outcome) {
    case Outcome::kDone: return "done";
    case Outcome::kRefused: return "refused";
    case Outcome::kTimedOut: return "no reply in time";
    case Outcome::kNotSent: return "could not be sent";
  }
  return "unknown outcome";
}

bool RequestQueue::push(const Request& request, std::uint32_t tag) noexcept {
  if (size() == kCapacity) return false;
  entry(pushed_++) = {request, tag, Outcome::kNotSent, {}};
  return true;
}

std::optional<Completion> RequestQueue::pop() noexcept {
  if (taken_ == completed_) return std::nullopt;
  return entry(taken_++);
}

void RequestQueue::clear() noexcept {
  if (outstanding_) late_cycles_ = timeout_cycles_;
  outstanding_ = false;
  waited_cycles_ = 0;
  taken_ = completed_ = pushed_;
}

void RequestQueue::complete(Outcome outcome) noexcept {
  entry(completed_++).outcome = outcome;
  outstanding_ = false;
  waited_cycles_ = 0;
}

void RequestQueue::receive(Transport& transport) noexcept {
  for (int i = 0; i < kMaxRepliesPerCycle; ++i) {
    const auto reply = transport.poll();
    if (!reply) return;
    if (outstanding_ && matches(entry(completed_).request, *reply)) {
      entry(completed_).reply = *reply;
      complete(accepted(entry(completed_).request, *reply) ? Outcome::kDone : Outcome::kRefused);
    } else {
      ++discarded_;
      late_cycles_ = 0;
    }
  }
}

void RequestQueue::step(Transport& transport) noexcept {
  receive(transport);
  if (late_cycles_ > 0) --late_cycles_;
  if (idle() || late_cycles_ > 0) return;

  if (!outstanding_ && transport.post(entry(completed_).request)) {
    outstanding_ = true;
    waited_cycles_ = 0;
  }
  if (++waited_cycles_ > timeout_cycles_) {
    if (outstanding_) late_cycles_ = timeout_cycles_;
    complete(outstanding_ ? Outcome::kTimedOut : Outcome::kNotSent);
  }
}

}  // namespace drivers::tmcl
