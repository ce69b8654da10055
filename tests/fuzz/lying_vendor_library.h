/// @file
/// How the fuzzer steers lying_vendor_library.cpp, which it loads in place of the vendor's library.
#pragma once
#include <array>
#include <cstdint>
#include <span>

namespace fuzz {

struct VendorLies {
  /// A byte for each answer: below kHonest it is what a healthy omega.6 says, and so is all after the last.
  std::span<const std::uint8_t> left;
  long calls = 0;
  bool refuses_stop = false;          ///< the latest dhdStop failed
  std::array<double, 3> command_N{};  ///< the latest force commanded, zero after a stop that worked
  double largest_command_N = 0;       ///< NaN when one was no number
};

/// extern "C" VendorLies* vendor_lies();
inline constexpr const char* kVendorLies = "vendor_lies";
using VendorLiesFunction = VendorLies*();

}  // namespace fuzz
