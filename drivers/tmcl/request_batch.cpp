#include "drivers/tmcl/request_batch.h"

#include <utility>

namespace drivers::tmcl {
namespace {

// More than a batch can only be strays; the rest is read in the next cycle.
constexpr int kMaxRepliesPerStep = 2 * static_cast<int>(RequestBatch::kCapacity);

}  // namespace

void RequestBatch::step(Transport& transport) noexcept {
  if (pause_ > 0) --pause_;
  for (int i = 0; i < kMaxRepliesPerStep; ++i) {
    const auto reply = transport.poll();
    if (!reply) break;
    if (answered_ == size_) {
      // A stray. Just after the last answer it may be that answer, displaced by a stray.
      if (size_ > 0) give_up();
      continue;
    }
    Completion& entry = entries_[answered_];
    if (!matches(entry.request, *reply)) {
      give_up();
      continue;
    }
    entry.outcome = accepted(entry.request, *reply) ? Outcome::kDone : Outcome::kRefused;
    entry.reply = *reply;
    entry.reply_age = transport.reply_age();
    ++answered_;
  }
  if (answered_ < size_ && ++waited_ >= patience_) give_up();
}

std::span<const Completion> RequestBatch::take() noexcept {
  if (answered_ < size_) return {};
  waited_ = 0;
  answered_ = 0;
  return {entries_.data(), std::exchange(size_, 0)};
}

bool RequestBatch::post(Transport& transport, const Request& request) noexcept {
  if (!transport.post(request)) return false;
  if (size_ == kCapacity) give_up();
  if (pause_ > 0) {
    pause_ = patience_;
  } else {
    entries_[size_++] = {request, 0, Outcome::kTimedOut, {}};
  }
  return true;
}

void RequestBatch::give_up() noexcept {
  size_ = answered_ = 0;
  waited_ = 0;
  pause_ = patience_;
  ++lost_;
}

}  // namespace drivers::tmcl
