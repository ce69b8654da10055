#include "apps/youbotd/run_progress.h"

#include <limits>

#include "apps/common/progress_line.h"

namespace youbotd {

RunProgress::RunProgress(bool shown, std::optional<std::chrono::nanoseconds> whole) {
  if (shown) thread_ = std::jthread([this, whole](const std::stop_token& ended) { show(ended, whole); });
}

void RunProgress::show(const std::stop_token& ended, std::optional<std::chrono::nanoseconds> whole) {
  using Seconds = std::chrono::duration<double>;
  constexpr std::chrono::milliseconds kLook{100};
  apps::ProgressLine line("youbotd", /*quiet=*/false);
  for (Progress progress; !ended.stop_requested(); std::this_thread::sleep_for(kLook)) {
    if (!newest_.take(progress)) continue;
    const double done =
        whole ? Seconds(progress.time) / Seconds(*whole) : std::numeric_limits<double>::quiet_NaN();
    line.show(progress.phase, done, apps::duration_text(Seconds(progress.time).count()));
  }
}

}  // namespace youbotd
