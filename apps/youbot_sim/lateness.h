/// @file
/// Statistics of the emulator's late answers.
#pragma once
#include <chrono>
#include <cstdint>
#include <optional>
#include <string>

namespace youbot_sim {

/// Counts the answers that were later than a master's default time-out (`frame_timeout_s`), and reports them
/// occasionally. Adding allocates nothing.
class Lateness {
 public:
  static constexpr std::chrono::microseconds kLate{500};
  /// Between two lines of the log.
  static constexpr std::chrono::seconds kPause{5};

  struct Counts {
    std::uint64_t late = 0;
    std::chrono::nanoseconds longest{};  ///< of the late ones
  };

  /// An answer left `after` the arrival of its frame.
  void add(std::chrono::nanoseconds after) noexcept;
  /// Late answers since the last result, if any; at most once in kPause. `now` is from a steady clock.
  std::optional<Counts> due(std::chrono::nanoseconds now) noexcept;
  const Counts& total() const noexcept { return total_; }

 private:
  Counts total_;
  Counts unreported_;
  std::optional<std::chrono::nanoseconds> reported_at_;
};

/// "37 answers came later than 0.5 ms, the longest after 12.0 ms".
std::string describe(const Lateness::Counts& counts);

}  // namespace youbot_sim
