#include "runtime/program/stop_on_signals.h"

#include <csignal>

namespace runtime {
namespace {

static_assert(std::atomic<bool>::is_always_lock_free, "written by a signal handler");

void on_signal(int /*number*/) { stop_requested.store(true, std::memory_order_relaxed); }

}  // namespace

void stop_on_signals() {
  struct sigaction action {};
  action.sa_handler = on_signal;
  for (const int signal : {SIGINT, SIGTERM, SIGHUP}) sigaction(signal, &action, nullptr);
  std::signal(SIGPIPE, SIG_IGN);
}

}  // namespace runtime
