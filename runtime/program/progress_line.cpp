#include "runtime/program/progress_line.h"

#include <poll.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <utility>

namespace runtime {
namespace {

constexpr std::chrono::milliseconds kBarInterval{200};
constexpr std::chrono::seconds kLineInterval{10};
constexpr std::chrono::seconds kStageInterval{1};
constexpr int kBarWidth = 30;

/// Dropped while standard error accepts nothing: the next one says more, and a blocked reader delays nothing.
void print(const std::string& text) {
  pollfd error{STDERR_FILENO, POLLOUT, 0};
  if (poll(&error, 1, 0) <= 0) return;
  std::fputs(text.c_str(), stderr);
  std::fflush(stderr);
}

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

ProgressLine::ProgressLine(std::string name, bool quiet)
    : name_(std::move(name)),
      quiet_(quiet),
      terminal_(isatty(STDERR_FILENO) != 0),
      begin_(Clock::now()),
      printed_(begin_) {}

std::string ProgressLine::text(Clock::time_point now) const {
  std::string text = name_ + ": ";
  const bool known = !std::isnan(done_);
  if (terminal_ && known) {
    const auto filled = static_cast<std::size_t>(done_ * kBarWidth);
    text += "[" + std::string(filled, '#') + std::string(kBarWidth - filled, '.') + "] ";
  }
  std::string parts = known ? std::to_string(std::lround(std::floor(100 * done_))) + " %" : "";
  for (const std::string* part : {&stage_, &detail_})
    if (!part->empty()) parts += (parts.empty() ? "" : ", ") + *part;
  text += parts;
  const double passed_s = std::chrono::duration<double>(now - begin_).count();
  if (done_ > 0) text += ", " + duration_text(passed_s * (1 - done_) / done_) + " left";
  return text;
}

void ProgressLine::show(std::string_view stage, double done, std::string_view detail) {
  if (quiet_) return;
  const Clock::time_point now = Clock::now();
  stage_ = stage;
  detail_ = detail;
  done_ = std::isnan(done) ? done : std::clamp(done, 0.0, 1.0);

  const bool new_stage = stage_ != printed_stage_;
  const Clock::duration wait = terminal_   ? Clock::duration(kBarInterval)
                               : new_stage ? Clock::duration(kStageInterval)
                                           : Clock::duration(kLineInterval);
  const bool first_stage = new_stage && printed_stage_.empty();
  if (!first_stage && now - printed_ < wait) return;
  printed_ = now;
  printed_stage_ = stage_;
  shown_ = true;
  print(terminal_ ? "\r\x1b[K" + text(now) : text(now) + "\n");
}

void ProgressLine::finish() {
  if (shown_ && terminal_) print("\r\x1b[K" + text(Clock::now()) + "\n");
  shown_ = false;
}

ProgressLine::~ProgressLine() {
  if (shown_ && terminal_) print("\r\x1b[K");
}

}  // namespace runtime
