#include "runtime/recording/started.h"

#include <spdlog/fmt/chrono.h>
#include <spdlog/fmt/fmt.h>

#include <chrono>

namespace runtime {

RecordingFile::Comment started_now() {
  using std::chrono::system_clock;
  const system_clock::time_point now = system_clock::now();
  const auto seconds = std::chrono::floor<std::chrono::seconds>(now);
  return {"started", fmt::format("{:%Y-%m-%dT%H:%M:%S}.{:03}Z", fmt::gmtime(system_clock::to_time_t(seconds)),
                                 std::chrono::floor<std::chrono::milliseconds>(now - seconds).count())};
}

}  // namespace runtime
