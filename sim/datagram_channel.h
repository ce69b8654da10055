/// @file
/// One direction of a bad network: delays, loses, repeats and reorders datagrams, the same way for each seed.
#pragma once
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <random>
#include <span>
#include <vector>

namespace sim {

struct NetworkConditions {
  std::chrono::nanoseconds delay{};  ///< mean of one way
  std::chrono::nanoseconds
      jitter{};           ///< each datagram's delay is uniform within ± this: they overtake each other
  double loss = 0.0;      ///< share of the datagrams, independent of each other
  double repeated = 0.0;  ///< share that arrives twice
};

/// Time is a parameter. One thread.
class DatagramChannel {
 public:
  /// Further datagrams are lost, as in a full queue of a router.
  static constexpr std::size_t kMaxWaiting = 4096;

  DatagramChannel(const NetworkConditions& conditions, std::uint64_t seed)
      : conditions_(conditions), random_(seed) {}

  void set(const NetworkConditions& conditions) noexcept { conditions_ = conditions; }
  /// While silent, everything that is sent is lost.
  void set_silent(bool silent) noexcept { silent_ = silent; }

  void send(std::span<const std::uint8_t> datagram, std::chrono::nanoseconds now);
  /// The next datagram that has arrived; its bytes, at most the size of `buffer`; 0: none.
  std::size_t receive(std::span<std::uint8_t> buffer, std::chrono::nanoseconds now);
  /// When the next one arrives; max(): none is on its way.
  std::chrono::nanoseconds next() const noexcept;

 private:
  struct Waiting {
    std::chrono::nanoseconds due{};
    std::uint64_t number = 0;  // of two due at once, the first one sent arrives first
    std::vector<std::uint8_t> bytes;
  };
  static bool later(const Waiting& a, const Waiting& b) noexcept {
    return a.due != b.due ? a.due > b.due : a.number > b.number;
  }
  /// Uniform in [0, 1).
  double draw() noexcept { return static_cast<double>(random_() >> 11) * 0x1p-53; }
  void deliver_later(std::span<const std::uint8_t> datagram, std::chrono::nanoseconds now);

  NetworkConditions conditions_;
  std::mt19937_64 random_;
  bool silent_ = false;
  std::uint64_t sent_ = 0;
  std::vector<Waiting> waiting_;  // a heap, the next one first
};

}  // namespace sim
