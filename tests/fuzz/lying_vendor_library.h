/// @file
/// Control of lying_vendor_library.cpp, which the fuzzer loads in place of the vendor's library.
#pragma once
#include <array>
#include <cstdint>
#include <span>

namespace fuzz {

struct VendorLies {
  /// One byte per answer: below kHonest the answer is that of a healthy omega.6, as are all after the last
  /// byte.
  std::span<const std::uint8_t> left;
  long calls = 0;
  bool refuses_stop = false;          ///< the latest dhdStop failed
  std::array<double, 3> command_N{};  ///< the latest force commanded, zero after a stop that worked
  double largest_command_N = 0;       ///< NaN if one was not a number
};

/// extern "C" VendorLies* vendor_lies();
inline constexpr const char* kVendorLies = "vendor_lies";
using VendorLiesFunction = VendorLies*();

}  // namespace fuzz
