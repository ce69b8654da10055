/// @file
/// The bit rate a CAN interface is set to. Reading it needs no rights; setting it does, and is the
/// operator's.
#pragma once
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

namespace drivers::can {

/// Setup: asks the kernel (rtnetlink). Empty when the interface has none (vcan) or the kernel does not say.
std::optional<std::uint32_t> interface_bitrate(unsigned interface_index) noexcept;

/// The bit rate in the kernel's answer, RTM_NEWLINK / IFLA_LINKINFO / IFLA_INFO_DATA / IFLA_CAN_BITTIMING.
/// Any bytes are safe.
std::optional<std::uint32_t> bitrate_in(std::span<const std::byte> link_message) noexcept;

}  // namespace drivers::can
