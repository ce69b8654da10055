#include "apps/youbot_bench/progress.h"

namespace youbot_bench {

void Progress::show() {
  const double done_s = done_s_.load(std::memory_order_relaxed);
  const double left_s = left_s_.load(std::memory_order_relaxed);
  line_.show("", done_s + left_s > 0 ? done_s / (done_s + left_s) : 0.0,
             "measurement " + std::to_string(measurement_.load(std::memory_order_relaxed) + 1) + " of " +
                 std::to_string(measurements_));
}

void Progress::finish() {
  show();
  line_.finish();
}

}  // namespace youbot_bench
