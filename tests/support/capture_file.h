/// @file
/// Frames of a bus as drivers::ethercat::PcapRing writes them to a pcapng file, read again.
#pragma once
#include <chrono>
#include <cstdint>
#include <filesystem>
#include <vector>

#include "drivers/ethercat/frame_tap.h"

namespace support {

struct CapturedFrame {
  std::chrono::nanoseconds stamp{};
  drivers::ethercat::Direction direction{};
  std::vector<std::uint8_t> bytes;
};

/// In the file's order. @throws std::runtime_error naming the file if it is not PcapRing's, or truncated.
std::vector<CapturedFrame> read_capture(const std::filesystem::path& path);

}  // namespace support
