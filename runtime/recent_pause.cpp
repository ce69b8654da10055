#include "runtime/recent_pause.h"

#include <spdlog/fmt/fmt.h>

#include "hal/seconds.h"

namespace runtime {

std::string then(std::chrono::nanoseconds pause) {
  return pause.count() > 0 ? fmt::format("this program did not run for {:.3f} s, then ", hal::seconds(pause))
                           : "";
}

}  // namespace runtime
