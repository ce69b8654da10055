/// @file
/// Passes the newest value from one thread to one other.
#pragma once
#include <array>
#include <atomic>
#include <cstdint>

namespace hal {

/// One thread may publish() and one other may take(). Both are wait-free: they copy one value and exchange
/// one byte. Of the values published between two takes, only the last is kept.
template <typename T>
class NewestValue {
 public:
  NewestValue() = default;
  /// Slots are copies of `like`: publishing values that hold vectors of the same sizes allocates nothing.
  explicit NewestValue(const T& like) : slots_{like, like, like} {}

  /// Cycle, writer.
  void publish(const T& value) noexcept {
    slots_[written_] = value;
    written_ =
        waiting_.exchange(static_cast<std::uint8_t>(written_ | kNew), std::memory_order_acq_rel) & kSlot;
  }

  /// Cycle, reader: false, with `value` unchanged, if nothing was published since the last call.
  bool take(T& value) noexcept {
    if ((waiting_.load(std::memory_order_relaxed) & kNew) == 0) return false;
    read_ = waiting_.exchange(read_, std::memory_order_acq_rel) & kSlot;
    value = slots_[read_];
    return true;
  }

 private:
  static constexpr std::uint8_t kNew = 4;
  static constexpr std::uint8_t kSlot = 3;
  static_assert(std::atomic<std::uint8_t>::is_always_lock_free);

  // Each slot belongs to the writer or the reader, or waits between them.
  std::array<T, 3> slots_{};
  std::uint8_t written_ = 0;
  std::uint8_t read_ = 1;
  std::atomic<std::uint8_t> waiting_{2};
};

}  // namespace hal
