/// @file
/// Which of the last sequence numbers have been received.
#pragma once
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>

namespace drivers::station {

/// Remembers at least the last 960 sequence numbers before the newest one. One thread. Cycle: everything.
class ReplayWindow {
 public:
  static constexpr std::size_t kWords = 16;

  enum class Seen : std::uint8_t { kNewest, kLate, kBefore };
  /// What take() would return.
  Seen look(std::uint64_t sequence) const noexcept {
    if (sequence > newest_) return Seen::kNewest;
    // A word that the newest one is about to reuse counts as forgotten.
    if (sequence == 0 || newest_ / kBits - sequence / kBits >= kWords) return Seen::kBefore;
    return (words_[sequence / kBits % kWords] >> sequence % kBits & 1U) != 0 ? Seen::kBefore : Seen::kLate;
  }
  /// Call for genuine datagrams only.
  Seen take(std::uint64_t sequence) noexcept {
    const Seen seen = look(sequence);
    if (seen == Seen::kBefore) return seen;
    if (seen == Seen::kNewest) {
      const std::uint64_t last = sequence / kBits;
      std::uint64_t word = newest_ / kBits;
      if (last - word > kWords) word = last - kWords;
      while (word < last) words_[++word % kWords] = 0;
      newest_ = sequence;
    }
    words_[sequence / kBits % kWords] |= std::uint64_t{1} << sequence % kBits;
    return seen;
  }

  std::uint64_t newest() const noexcept { return newest_; }

  /// Of 704 numbers, but not of the newest 192 to 255, which may still be on their way. 0 before the window
  /// is full.
  unsigned lost_permille() const noexcept {
    constexpr std::size_t kUnsettled = 4;  // words, and the one that is about to be reused
    const std::uint64_t last = newest_ / kBits;
    if (last < kWords) return 0;
    unsigned received = 0;
    for (std::size_t back = kUnsettled; back < kWords - 1; ++back)
      received += static_cast<unsigned>(std::popcount(words_[(last - back) % kWords]));
    constexpr unsigned kAll = (kWords - 1 - kUnsettled) * kBits;
    return (1000 * (kAll - received) + kAll / 2) / kAll;
  }

 private:
  static constexpr std::uint64_t kBits = 64;
  std::array<std::uint64_t, kWords> words_{};
  std::uint64_t newest_ = 0;
};

/// Fewest repetitions with which at most one state in a thousand is lost, if losses are independent.
constexpr int repetitions_for(unsigned lost_permille, int most) noexcept {
  double lost = lost_permille / 1000.0;
  int repetitions = 0;
  for (; repetitions < most && lost > 1e-3; ++repetitions) lost *= lost_permille / 1000.0;
  return repetitions;
}

}  // namespace drivers::station
