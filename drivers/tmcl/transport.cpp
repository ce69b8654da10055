#include "drivers/tmcl/transport.h"

#include <algorithm>
#include <thread>

#include "drivers/tmcl/firmware_version.h"

namespace drivers::tmcl {
namespace {

// A faulty carrier must not block forever.
constexpr int kMaxStaleReplies = 64;
constexpr int kMaxRepliesPerLook = 8;

bool no_answer_yet(const Request& request, const Reply& reply) noexcept {
  FirmwareVersion version;
  return asks_for_text(request) && parse_version(reply.text, version) == VersionText::kNoAnswerYet;
}

}  // namespace

std::chrono::nanoseconds SteadyClock::now() noexcept {
  return std::chrono::steady_clock::now().time_since_epoch();
}

void SteadyClock::wait(std::chrono::nanoseconds duration) noexcept { std::this_thread::sleep_for(duration); }

Exchange exchange(Transport& transport, Clock& clock, const Request& request,
                  std::chrono::nanoseconds deadline, std::chrono::nanoseconds interval) noexcept {
  for (int i = 0; i < kMaxStaleReplies && transport.poll(); ++i) {
  }
  Exchange result;
  for (bool last_look = false; !last_look;) {
    last_look = clock.now() >= deadline;
    if (!result.posted) result.posted = transport.post(request);
    for (int i = 0; result.posted && i < kMaxRepliesPerLook; ++i) {
      const auto reply = transport.poll();
      if (!reply) break;
      if (matches(request, *reply)) {
        result.reply = reply;
        return result;
      }
      ++result.discarded;
      result.discarded_last = reply;
      if (no_answer_yet(request, *reply)) return result;
    }
    if (!last_look) clock.wait(std::min(interval, deadline - clock.now()));
  }
  return result;
}

}  // namespace drivers::tmcl
