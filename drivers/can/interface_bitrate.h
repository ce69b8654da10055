/// @file
/// Bit rate of a CAN interface. Reading it needs no rights; setting it does, and is left to the operator.
#pragma once
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

namespace drivers::can {

/// Setup: asks the kernel (rtnetlink). Empty if the interface has none (vcan) or the kernel does not report
/// it.
std::optional<std::uint32_t> interface_bitrate(unsigned interface_index) noexcept;

/// Bit rate in the kernel's answer, RTM_NEWLINK / IFLA_LINKINFO / IFLA_INFO_DATA / IFLA_CAN_BITTIMING.
/// Accepts any bytes.
std::optional<std::uint32_t> bitrate_in(std::span<const std::byte> link_message) noexcept;

}  // namespace drivers::can
