/// @file
/// What a USB device says of itself, in words: its descriptors as the kernel keeps them (see
/// descriptors_of()), the device's followed by each configuration's. Source: USB 2.0 specification,
/// chapter 9.6. Any bytes are answered with a text, never with an error.
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
  /// What is wrong and at which byte. The lines then tell what could be read: all of it where only a value
  /// makes no sense, what came before where a length does not.
  std::optional<std::string> malformed{};
};

DescriptorReport report_descriptors(std::span<const std::uint8_t> bytes);

}  // namespace drivers::usb
