#include "operation/run_progress.h"

#include <condition_variable>
#include <limits>
#include <mutex>

#include "runtime/program/progress_line.h"
#include "runtime/start_thread.h"

namespace operation {

RunProgress::RunProgress(bool shown, std::optional<std::chrono::nanoseconds> whole) {
  if (!shown) return;
  thread_ = runtime::start_thread("the progress line",
                                  [this, whole](const std::stop_token& ended) { show(ended, whole); });
}

void RunProgress::show(const std::stop_token& ended, std::optional<std::chrono::nanoseconds> whole) {
  using Seconds = std::chrono::duration<double>;
  constexpr std::chrono::milliseconds kLook{100};
  runtime::ProgressLine line("youbotd", /*quiet=*/false);
  std::mutex mutex;
  std::condition_variable_any wake_up;  // notified by the stop request
  const auto pause = [&] {
    std::unique_lock lock(mutex);
    wake_up.wait_for(lock, ended, kLook, [] { return false; });
  };
  for (Progress progress; !ended.stop_requested(); pause()) {
    if (!newest_.take(progress)) continue;
    const double done =
        whole ? Seconds(progress.time) / Seconds(*whole) : std::numeric_limits<double>::quiet_NaN();
    line.show(progress.phase, done, runtime::duration_text(Seconds(progress.time).count()));
  }
}

}  // namespace operation
