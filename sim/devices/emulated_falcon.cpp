#include "sim/devices/emulated_falcon.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace sim::devices {
namespace {

using drivers::usb::TransferResult;
using drivers::usb::TransferStatus;
using std::chrono::nanoseconds;

constexpr int kStallCode = -9;  // as in libusb
constexpr int kUnpluggedCode = -4;
constexpr int kOverflowCode = -8;
constexpr int kInvalidCode = -2;
constexpr std::array<std::uint8_t, 2> kModemStatus{0x01, 0x60};  // of an idle line
constexpr std::size_t kReceiveBuffer = 1024;                     // the chip's and the host's

// An assumed mechanical range, wider than the ball of 40 mm in which the device is used.
constexpr double kOuterEnd_deg = 60.0;
constexpr double kInnerEnd_deg = 5.0;
constexpr double kZeroCount_deg = 35.0;
constexpr double kCountsPerDegree = 1280.0 / 360.0 * 110.0 / 14.25;
constexpr double kDegreesPerRadian = 57.29577951308232;
/// This device's motors: command -10 000 is 1 N·m. At most 4096 reaches them.
constexpr double kTorquePerCommand_Nm = -1e-4;

std::int16_t encoder_count(double thigh_rad, int offset) noexcept {
  const double count = (thigh_rad * kDegreesPerRadian - kZeroCount_deg) * kCountsPerDegree;
  return static_cast<std::int16_t>(std::clamp(std::lround(count) + offset, -32768L, 32767L));
}

bool take(int& count) noexcept {
  if (count <= 0) return false;
  --count;
  return true;
}

void put_letters(std::uint8_t* place, std::int16_t value) noexcept {
  auto rest = static_cast<std::uint16_t>(value);
  for (int i = 0; i < 4; ++i) {
    place[i] = static_cast<std::uint8_t>("ABCDEFGHIJKLMNOP"[rest % 16]);
    rest = static_cast<std::uint16_t>(rest / 16);
  }
}

bool get_letters(const std::uint8_t* place, std::int16_t& value) noexcept {
  int result = 0;
  for (int i = 3; i >= 0; --i) {
    if (place[i] < 'A' || place[i] > 'P') return false;
    result = result * 16 + (place[i] - 'A');
  }
  value = static_cast<std::int16_t>(result > 32767 ? result - 65536 : result);
  return true;
}

}  // namespace

EmulatedFalcon::EmulatedFalcon(EmulatedFalconOptions options) : options_(std::move(options)) {
  loaded_.reserve(1U << 16U);
  query_.reserve(16);
  received_.reserve(kReceiveBuffer);
  if (options_.firmware_running) state_ = State::kRun;
}

TransferStatus EmulatedFalcon::trouble() noexcept {
  if (unplugged_) return TransferStatus::kUnplugged;
  return take(stalls_) ? TransferStatus::kStalled : TransferStatus::kDone;
}

namespace {

TransferResult failed(TransferStatus status) noexcept {
  return {status, 0, status == TransferStatus::kUnplugged ? kUnpluggedCode : kStallCode};
}

}  // namespace

bool EmulatedFalcon::at_baud(double baud) const noexcept { return std::abs(baud_ / baud - 1.0) < 0.02; }

TransferResult EmulatedFalcon::control_out(std::uint8_t request, std::uint16_t value,
                                           std::uint16_t /*index*/) noexcept {
  if (const auto status = trouble(); status != TransferStatus::kDone) return failed(status);
  switch (request) {
    case 0:
      // Not the bytes still on the wire.
      if (value == 1)
        std::erase_if(received_, [this](const Received& received) { return received.at <= now_; });
      break;
    case 1:
      if ((value & 0x0100) != 0) {
        const bool high = (value & 1) != 0;
        if (high && !dtr_) raise_dtr();
        dtr_ = high;
      }
      break;
    case 3: {
      const double divisor = (value & 0x3FFF) + ((value & 0xC000) == 0x4000 ? 0.5 : 0.0);
      baud_ = 3e6 / divisor;
      start_if_loaded();
      break;
    }
    case 2:
    case 4: break;
    case 9:
      if (value < 1 || value > 255) return failed(TransferStatus::kStalled);
      latency_ = std::chrono::milliseconds(value);
      timer_set_ = now_;
      break;
    default: return failed(TransferStatus::kStalled);
  }
  return {};
}

void EmulatedFalcon::raise_dtr() noexcept {
  if (!options_.powered) return;
  state_ = State::kBoot;
  ++boots_;
  query_.clear();
  query_answered_ = false;
  loaded_.clear();
  chunk_ = -1;
  motors_ = {};
  homed_ = 0;
  seen_out_ = 0;
}

void EmulatedFalcon::start_if_loaded() noexcept {
  if (state_ != State::kLoad || !at_baud(1.5e6) || loaded_.empty()) return;
  if (options_.image.empty() || options_.image == loaded_) state_ = State::kRun;
}

TransferResult EmulatedFalcon::write(std::span<const std::uint8_t> bytes, nanoseconds /*timeout*/) noexcept {
  if (const auto status = trouble(); status != TransferStatus::kDone) return failed(status);
  now_ += byte_time() * static_cast<long>(bytes.size());
  if (options_.powered) {
    switch (state_) {
      case State::kCold: break;
      case State::kBoot: boot_loader(bytes); break;
      case State::kLoad: load(bytes); break;
      case State::kRun:
        if (!at_baud(1.5e6)) break;
        for (const std::uint8_t byte : bytes) firmware(byte);
        break;
    }
  }
  return {TransferStatus::kDone, bytes.size(), 0};
}

void EmulatedFalcon::boot_loader(std::span<const std::uint8_t> bytes) noexcept {
  constexpr std::array<std::uint8_t, 3> kQuery{0x0A, 0x43, 0x0D};
  constexpr std::array<std::uint8_t, 5> kAnswer{0x00, 0x0A, 0x44, 0x2C, 0x0D};
  if (std::ranges::equal(bytes, kQuery)) {
    ++queries_;
    if (!at_baud(9600) || !dtr_) return;
    query_answered_ = true;
    answer(std::span(kAnswer).subspan(options_.zero_before_query_answer ? 0 : 1));
  } else if (query_answered_ && !dtr_ && at_baud(3e6 / 21) && bytes.size() == 1 && bytes[0] == 0x41) {
    state_ = State::kLoad;
    echo(bytes);
  }
}

void EmulatedFalcon::load(std::span<const std::uint8_t> bytes) noexcept {
  if (!at_baud(3e6 / 21)) return;
  loaded_.insert(loaded_.end(), bytes.begin(), bytes.end());
  echo(bytes);
}

void EmulatedFalcon::echo(std::span<const std::uint8_t> bytes) noexcept {
  std::array<std::uint8_t, kData> back{};
  std::size_t size = std::min(bytes.size(), back.size());
  std::copy_n(bytes.begin(), size, back.begin());
  if (chunk_++ == spoilt_chunk_ && size > 0 && take(spoilt_loads_)) {
    switch (spoilt_how_) {
      case Echo::kWrongByte: back[size / 2] = static_cast<std::uint8_t>(back[size / 2] ^ 0x10); break;
      case Echo::kByteMissing: --size; break;
      case Echo::kByteTooMany: size = std::min(size + 1, back.size()); break;
    }
  }
  answer(std::span(back).first(size));
}

void EmulatedFalcon::firmware(std::uint8_t byte) noexcept {
  if (byte == '<') packet_size_ = 0;
  if (packet_size_ == 0 && byte != '<') return;
  packet_[packet_size_++] = byte;
  if (packet_size_ < packet_.size()) return;
  packet_size_ = 0;
  command();
}

void EmulatedFalcon::command() noexcept {
  std::array<std::int16_t, 3> motors{};
  bool good = packet_[15] == '>' && packet_[14] == 'A' && packet_[13] >= 'A' && packet_[13] <= 'P';
  for (std::size_t axis = 0; axis < 3; ++axis)
    good = get_letters(&packet_[1 + 4 * axis], motors[axis]) && good;
  if (!good) {
    ++malformed_commands_;
    return;
  }
  ++commands_;
  motors_ = motors;
  state_byte_ = static_cast<std::uint8_t>(packet_[13] - 'A');
  if ((state_byte_ & 1U) == 0) {
    ++commands_without_homing_;
    homed_ = 0;
    seen_out_ = 0;
  }
  move_grip(grip_m_);  // starts or stops the firmware's search for the ends
  reply();
}

void EmulatedFalcon::move_grip(const FalconVector& place_m) noexcept {
  grip_m_ = place_m;
  if (state_ != State::kRun || (state_byte_ & 1U) == 0) return;
  const FalconVector angles = falcon_thigh_angles_rad(place_m);
  for (unsigned axis = 0; axis < 3; ++axis) {
    const double degrees = angles[axis] * kDegreesPerRadian;
    if (degrees >= kOuterEnd_deg) seen_out_ |= 1U << axis;
    if (degrees <= kInnerEnd_deg && (seen_out_ >> axis & 1U) != 0) homed_ |= 1U << axis;
  }
}

void EmulatedFalcon::pull_and_push() noexcept {
  const FalconVector before = grip_m_;
  for (const double z : {0.17, 0.09}) move_grip({0.0, 0.0, z});
  move_grip(before);
}

FalconVector EmulatedFalcon::force_N() const noexcept {
  FalconVector torques{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    torques[axis] = kTorquePerCommand_Nm * std::clamp<double>(motors_[axis], -4096.0, 4096.0);
  }
  return falcon_force_N(grip_m_, torques);
}

void EmulatedFalcon::reply() noexcept {
  std::array<std::uint8_t, 17> bytes{};
  bytes.fill('A');
  bytes[0] = '<';
  bytes[15] = '>';
  const bool false_counts = take(false_);
  const FalconVector angles = falcon_thigh_angles_rad(grip_m_);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const bool axis_homed = (homed_ >> axis & 1U) != 0;
    const int offset = axis_homed ? 0 : options_.counts_before_homing[axis];
    put_letters(&bytes[1 + 4 * axis],
                false_counts ? false_counts_[axis] : encoder_count(angles[axis], offset));
  }
  bytes[13] = static_cast<std::uint8_t>('A' + (buttons_ & 15U) + 16U * homed_);

  if (take(drop_)) return;
  std::size_t size = 16;
  if (take(insert_)) {
    const std::size_t place = std::min(insert_at_, size);
    std::copy_backward(bytes.begin() + static_cast<std::ptrdiff_t>(place), bytes.end() - 1, bytes.end());
    bytes[place] = inserted_;
    ++size;
  }
  const nanoseconds delay = take(late_) ? delay_ : nanoseconds(0);
  const std::size_t first = take(split_) ? std::min(split_at_, size) : size;
  answer(std::span(bytes).first(first), delay);
  if (first < size) answer(std::span(bytes).subspan(first, size - first), delay + latency_);
}

nanoseconds EmulatedFalcon::byte_time() const noexcept { return nanoseconds(std::lround(10 * 1e9 / baud_)); }

/// If a host never reads, data beyond the buffer is lost.
void EmulatedFalcon::answer(std::span<const std::uint8_t> bytes, nanoseconds delay) noexcept {
  nanoseconds at = now_ + delay;
  if (!received_.empty()) at = std::max(at, received_.back().at);
  for (const std::uint8_t byte : bytes) {
    at += byte_time();
    if (received_.size() < kReceiveBuffer) received_.push_back({at, byte});
  }
}

/// Next expiry of the latency timer.
nanoseconds EmulatedFalcon::timer_behind(nanoseconds time) const noexcept {
  return timer_set_ + ((time - timer_set_) / latency_ + 1) * latency_;
}

/// Departure of the next packet with data.
nanoseconds EmulatedFalcon::departure() const noexcept {
  const nanoseconds timer = timer_behind(received_.front().at - nanoseconds(1));
  return received_.size() < kData ? timer : std::min(timer, received_[kData - 1].at);
}

TransferResult EmulatedFalcon::read(std::span<std::uint8_t> buffer, nanoseconds timeout) noexcept {
  if (const auto status = trouble(); status != TransferStatus::kDone) return failed(status);
  if (buffer.size() < 64) return {TransferStatus::kOther, 0, kOverflowCode};
  if (timeout < nanoseconds(0)) return {TransferStatus::kOther, 0, kInvalidCode};
  const nanoseconds end = timeout < latency_ ? now_ + timeout : timer_behind(now_);
  std::size_t size = 0;
  if (!received_.empty() && departure() <= end) {
    const nanoseconds left_at = departure();
    for (; size < std::min(kData, received_.size()) && received_[size].at <= left_at; ++size) {
      buffer[kModemStatus.size() + size] = received_[size].byte;
    }
    received_.erase(received_.begin(), received_.begin() + static_cast<std::ptrdiff_t>(size));
    now_ = std::max(now_, left_at);
  } else {
    now_ = end;
    if (timeout < latency_) return {TransferStatus::kTimeout, 0, 0};
  }
  std::ranges::copy(kModemStatus, buffer.begin());
  return {TransferStatus::kDone, kModemStatus.size() + size, 0};
}

}  // namespace sim::devices
