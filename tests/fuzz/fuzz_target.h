/// @file
/// What each fuzz target defines. libFuzzer calls it with inputs that reach new code;
/// run_without_libfuzzer.cpp with seeded mutations of the target's own seeds.
#pragma once
#include <cstdint>
#include <cstdlib>
#include <span>
#include <vector>

// NOLINTNEXTLINE(readability-identifier-naming): libFuzzer's name
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);

namespace fuzz {

using Bytes = std::vector<std::uint8_t>;

/// Valid inputs, to be mutated.
std::vector<Bytes> seeds();

/// A property of a parser; both drivers report the input that violates it.
inline void require(bool promise) {
  if (!promise) std::abort();
}

/// Consumes an input; zeros at its end.
class Input {
 public:
  Input(const std::uint8_t* data, std::size_t size) : left_(data, size) {}
  bool empty() const { return left_.empty(); }
  std::uint8_t byte() {
    if (left_.empty()) return 0;
    const std::uint8_t value = left_.front();
    left_ = left_.subspan(1);
    return value;
  }
  /// In its own memory, so that the address sanitizer detects an overrun.
  Bytes bytes(std::size_t count) {
    const auto taken = left_.first(count < left_.size() ? count : left_.size());
    left_ = left_.subspan(taken.size());
    return {taken.begin(), taken.end()};
  }
  Bytes rest() { return bytes(left_.size()); }

 private:
  std::span<const std::uint8_t> left_;
};

}  // namespace fuzz
