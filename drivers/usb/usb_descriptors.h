/// @file
/// Text report of a USB device's descriptors as the kernel stores them (see descriptors_of()): the device's,
/// followed by each configuration's. Source: USB 2.0 specification, chapter 9.6. Accepts any bytes: the
/// result is always text, never an error.
#pragma once
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace drivers::usb {

struct DescriptorReport {
  std::vector<std::string> lines{};  ///< indented by two spaces per level
  std::vector<int> interfaces{};     ///< numbers, each once, of the first configuration that has them
  /// What is wrong and at which byte. The lines then contain what could be read: everything if only a value
  /// is invalid, the part before it if a length is.
  std::optional<std::string> malformed{};
};

DescriptorReport report_descriptors(std::span<const std::uint8_t> bytes);

}  // namespace drivers::usb
