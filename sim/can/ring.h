/// @file
#pragma once
#include <array>
#include <cstddef>

namespace sim::can {

/// A queue without heap allocation. Cycle: everything.
template <typename T, std::size_t kCapacity>
class Ring {
 public:
  bool empty() const noexcept { return first_ == end_; }
  std::size_t size() const noexcept { return end_ - first_; }
  /// False if full.
  bool push(const T& item) noexcept {
    if (size() == kCapacity) return false;
    items_[end_++ % kCapacity] = item;
    return true;
  }
  const T& front() const noexcept { return items_[first_ % kCapacity]; }
  void pop() noexcept { ++first_; }
  void clear() noexcept { first_ = end_; }

 private:
  std::array<T, kCapacity> items_{};
  std::size_t first_ = 0;
  std::size_t end_ = 0;
};

}  // namespace sim::can
