#include "apps/youbot_bench/progress.h"

#include <unistd.h>

#include <array>
#include <cmath>
#include <cstdio>
#include <utility>

namespace youbot_bench {
namespace {

constexpr std::chrono::milliseconds kBarInterval{200};
constexpr std::chrono::seconds kLineInterval{10};
constexpr int kBarWidth = 30;

}  // namespace

std::string duration_text(double seconds) {
  std::array<char, 48> text{};
  const long whole = std::lround(seconds);
  if (whole >= 3600)
    std::snprintf(text.data(), text.size(), "%ld h %02ld min", whole / 3600, whole / 60 % 60);
  else if (whole >= 60)
    std::snprintf(text.data(), text.size(), "%ld min %02ld s", whole / 60, whole % 60);
  else
    std::snprintf(text.data(), text.size(), "%ld s", whole);
  return text.data();
}

Progress::Progress(std::string name, int measurements, bool quiet)
    : name_(std::move(name)),
      measurements_(measurements),
      quiet_(quiet),
      terminal_(isatty(STDERR_FILENO) != 0),
      begin_(Clock::now()),
      told_(begin_) {}

std::string Progress::text() const {
  const double done_s = done_s_.load(std::memory_order_relaxed);
  const double left_s = left_s_.load(std::memory_order_relaxed);
  const double share = done_s + left_s > 0 ? done_s / (done_s + left_s) : 0.0;
  const double wall_s = std::chrono::duration<double>(Clock::now() - begin_).count();
  std::string text = name_ + ": ";
  if (terminal_) {
    const auto filled = static_cast<std::size_t>(share * kBarWidth);
    text += "[" + std::string(filled, '#') + std::string(kBarWidth - filled, '.') + "] ";
  }
  text += std::to_string(std::lround(std::floor(100 * share))) + " %, measurement " +
          std::to_string(measurement_.load(std::memory_order_relaxed) + 1) + " of " +
          std::to_string(measurements_);
  if (done_s > 0) text += ", " + duration_text(wall_s * left_s / done_s) + " left";
  return text;
}

void Progress::show() {
  if (quiet_) return;
  const Clock::time_point now = Clock::now();
  if (now - told_ < (terminal_ ? Clock::duration(kBarInterval) : Clock::duration(kLineInterval))) return;
  told_ = now;
  shown_ = true;
  std::fprintf(stderr, terminal_ ? "\r\x1b[K%s" : "%s\n", text().c_str());
  std::fflush(stderr);
}

void Progress::finish() {
  if (shown_ && terminal_) std::fprintf(stderr, "\r\x1b[K%s\n", text().c_str());
}

}  // namespace youbot_bench
