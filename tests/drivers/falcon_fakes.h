/// @file
/// USB ports between a Falcon's driver and the emulated device.
#pragma once
#include <algorithm>
#include <chrono>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <tuple>
#include <utility>
#include <vector>

#include "drivers/usb/usb_port.h"

namespace drivers::haptic::tests {

using Control = std::tuple<int, int>;  ///< request, value

/// Records transfers, fails selected ones, and controls the clock.
class WatchedPort final : public usb::UsbPort {
 public:
  explicit WatchedPort(usb::UsbPort& port) : port_(port) {}

  usb::TransferResult control_out(std::uint8_t request, std::uint16_t value,
                                  std::uint16_t index) noexcept override {
    controls.emplace_back(request, value);
    indices.push_back(index);
    order.push_back('c');
    return result([&] { return port_.control_out(request, value, index); });
  }
  usb::TransferResult write(std::span<const std::uint8_t> bytes,
                            std::chrono::nanoseconds timeout) noexcept override {
    writes.emplace_back(bytes.begin(), bytes.end());
    order.push_back('w');
    return result([&] { return port_.write(bytes, timeout); });
  }
  usb::TransferResult read(std::span<std::uint8_t> buffer,
                           std::chrono::nanoseconds timeout) noexcept override {
    return result([&] { return port_.read(buffer, timeout); });
  }
  std::chrono::nanoseconds now() noexcept override {
    return port_.now() + (transfers > shift_from ? shift : std::chrono::nanoseconds(0));
  }

  std::vector<Control> controls;
  std::vector<int> indices;
  std::vector<std::vector<std::uint8_t>> writes;
  std::string order;
  int fail_at = -1;  ///< number of the transfer, from 0
  int fail_count = 1;
  usb::TransferResult failure;
  bool only_says_so = false;         ///< the failed transfer has its effect
  std::chrono::nanoseconds shift{};  ///< of the clock, visible after ...
  int shift_from = -1;               ///< ... this transfer
  int transfers = 0;

 private:
  usb::TransferResult result(auto transfer) noexcept {
    const int number = transfers++;
    const bool fails = fail_at >= 0 && number >= fail_at && number < fail_at + fail_count;
    if (!fails) return transfer();
    if (only_says_so) (void)transfer();
    return failure;
  }
  usb::UsbPort& port_;
};

/// Answers everything with the same bytes, and takes the whole time-out.
class AnsweringPort final : public usb::UsbPort {
 public:
  explicit AnsweringPort(std::vector<std::uint8_t> answer) : answer_(std::move(answer)) {}

  usb::TransferResult control_out(std::uint8_t /*request*/, std::uint16_t /*value*/,
                                  std::uint16_t /*index*/) noexcept override {
    return {};
  }
  usb::TransferResult write(std::span<const std::uint8_t> bytes,
                            std::chrono::nanoseconds /*timeout*/) noexcept override {
    answers_ = true;
    return {usb::TransferStatus::kDone, bytes.size(), 0};
  }
  usb::TransferResult read(std::span<std::uint8_t> buffer,
                           std::chrono::nanoseconds timeout) noexcept override {
    if (!answers_) {
      now_ += timeout;
      return {usb::TransferStatus::kTimeout, 0, 0};
    }
    answers_ = false;
    buffer[0] = 0x01;
    buffer[1] = 0x60;
    std::ranges::copy(answer_, buffer.begin() + 2);
    return {usb::TransferStatus::kDone, 2 + answer_.size(), 0};
  }
  std::chrono::nanoseconds now() noexcept override { return now_; }

 private:
  std::vector<std::uint8_t> answer_;
  std::chrono::nanoseconds now_{};
  bool answers_ = false;
};

/// A device that sends empty packets endlessly, in no time.
class FloodingPort final : public usb::UsbPort {
 public:
  usb::TransferResult control_out(std::uint8_t /*request*/, std::uint16_t /*value*/,
                                  std::uint16_t /*index*/) noexcept override {
    return {};
  }
  usb::TransferResult write(std::span<const std::uint8_t> bytes,
                            std::chrono::nanoseconds /*timeout*/) noexcept override {
    if (replies_ > 0) {
      --replies_;
      reply_ = true;
    }
    return {usb::TransferStatus::kDone, bytes.size(), 0};
  }
  usb::TransferResult read(std::span<std::uint8_t> buffer,
                           std::chrono::nanoseconds /*timeout*/) noexcept override {
    ++reads;
    buffer[0] = 0x01;
    buffer[1] = 0x60;
    if (!reply_) return {usb::TransferStatus::kDone, 2, 0};
    reply_ = false;
    constexpr std::string_view kReply = "<AAAAAAAAAAAAAA>";
    std::copy(kReply.begin(), kReply.end(), buffer.begin() + 2);
    return {usb::TransferStatus::kDone, 18, 0};
  }
  std::chrono::nanoseconds now() noexcept override { return {}; }

  int reads = 0;

 private:
  int replies_ = 1;  // one, for activation
  bool reply_ = false;
};

}  // namespace drivers::haptic::tests
