#include "drivers/station/message.h"

#include <cmath>
#include <type_traits>

namespace drivers::station {
namespace {

/// 146 years: no station's clock shows more, and sums and differences of such times do not overflow.
constexpr std::int64_t kLatest_ns = std::int64_t{1} << 62;

constexpr std::size_t kLinkStateBytes = 8 + 8 + 4 + 2 + 8 + 1 + 1 + 1 + 4;

class ByteWriter {
 public:
  explicit ByteWriter(std::span<std::uint8_t> bytes) : bytes_(bytes) {}
  template <typename Integer>
  void put(Integer value) noexcept {
    auto rest = static_cast<std::make_unsigned_t<Integer>>(value);
    for (std::size_t i = 0; i < sizeof value; ++i) {
      bytes_[at_++] = static_cast<std::uint8_t>(rest & 0xFF);
      rest = static_cast<decltype(rest)>(static_cast<std::uint64_t>(rest) >> 8);
    }
  }
  std::size_t written() const noexcept { return at_; }

 private:
  std::span<std::uint8_t> bytes_;
  std::size_t at_ = 0;
};

class ByteReader {
 public:
  explicit ByteReader(std::span<const std::uint8_t> bytes) : bytes_(bytes) {}
  template <typename Integer>
  void get(Integer& value) noexcept {
    std::uint64_t bits = 0;
    for (std::size_t i = 0; i < sizeof value; ++i) bits |= std::uint64_t{bytes_[at_++]} << (8 * i);
    value = static_cast<Integer>(static_cast<std::make_unsigned_t<Integer>>(bits));
  }

 private:
  std::span<const std::uint8_t> bytes_;
  std::size_t at_ = 0;
};

/// Calls `visit` for each number of a state, in the order of its bytes.
template <typename Handle, typename Visit>
requires std::is_same_v<std::remove_const_t<Handle>, HandleState>
void for_each_number(Handle& state, Visit visit) noexcept {
  visit(state.age_us);
  for (auto& number : state.position_nm) visit(number);
  for (auto& number : state.rotation_q30) visit(number);
  visit(state.buttons);
  for (auto& number : state.force_uN) visit(number);
}
template <typename Force, typename Visit>
requires std::is_same_v<std::remove_const_t<Force>, ForceState>
void for_each_number(Force& state, Visit visit) noexcept {
  for (auto& number : state.force_uN) visit(number);
}

constexpr std::size_t bytes_of(const HandleState& /*state*/) { return 4 + 12 + 16 + 4 + 12; }
constexpr std::size_t bytes_of(const ForceState& /*state*/) { return 12; }
static_assert(kLinkStateBytes + 1 + (kMaxRepeated + 1) * bytes_of(HandleState{}) <= kMaxMessageBytes - 40);

bool is_possible(const ForceState& /*state*/) noexcept { return true; }
bool is_possible(const HandleState& state) noexcept {
  double square = 0;
  for (const std::int32_t number : state.rotation_q30)
    square += std::ldexp(number, -30) * std::ldexp(number, -30);
  return std::abs(square - 1) < 0.02;
}

template <typename State>
std::size_t encode_any(const Message<State>& message, std::span<std::uint8_t> bytes) noexcept {
  if (message.count < 1 || message.count > message.states.size()) return 0;
  if (bytes.size() < kLinkStateBytes + 1 + message.count * bytes_of(State{})) return 0;
  ByteWriter writer(bytes);
  const LinkState& link = message.link;
  writer.put(link.sent_ns);
  writer.put(link.echo_ns);
  writer.put(link.echo_held_us);
  writer.put(link.lost_permille);
  writer.put(link.energy_in_nJ);
  writer.put(static_cast<std::uint8_t>(link.enable));
  writer.put(static_cast<std::uint8_t>(link.released));
  writer.put(static_cast<std::uint8_t>(link.fault));
  writer.put(link.detail);
  writer.put(message.count);
  for (std::size_t i = 0; i < message.count; ++i)
    for_each_number(message.states[i], [&writer](auto number) { writer.put(number); });
  return writer.written();
}

template <typename State>
bool decode_any(std::span<const std::uint8_t> bytes, Message<State>& message) noexcept {
  if (bytes.size() < kLinkStateBytes + 1) return false;
  ByteReader reader(bytes);
  LinkState& link = message.link;
  std::uint8_t enable = 0;
  std::uint8_t released = 0;
  std::uint8_t fault = 0;
  reader.get(link.sent_ns);
  reader.get(link.echo_ns);
  reader.get(link.echo_held_us);
  reader.get(link.lost_permille);
  reader.get(link.energy_in_nJ);
  reader.get(enable);
  reader.get(released);
  reader.get(fault);
  reader.get(link.detail);
  reader.get(message.count);
  if (enable > 1 || released > 1 || fault > static_cast<std::uint8_t>(haptic::HapticFault::kDeviceFault))
    return false;
  if (link.lost_permille > 1000) return false;
  if (link.sent_ns < 0 || link.sent_ns > kLatest_ns || link.echo_ns < 0 || link.echo_ns > kLatest_ns)
    return false;
  if (link.energy_in_nJ < 0) return false;
  if (message.count < 1 || message.count > message.states.size()) return false;
  if (bytes.size() != kLinkStateBytes + 1 + message.count * bytes_of(State{})) return false;
  link.enable = enable != 0;
  link.released = released != 0;
  link.fault = static_cast<haptic::HapticFault>(fault);
  for (std::size_t i = 0; i < message.count; ++i) {
    for_each_number(message.states[i], [&reader](auto& number) { reader.get(number); });
    if (!is_possible(message.states[i])) return false;
  }
  return true;
}

}  // namespace

std::size_t encode(const HandleMessage& message, std::span<std::uint8_t> bytes) noexcept {
  return encode_any(message, bytes);
}
std::size_t encode(const ForceMessage& message, std::span<std::uint8_t> bytes) noexcept {
  return encode_any(message, bytes);
}
bool decode(std::span<const std::uint8_t> bytes, HandleMessage& message) noexcept {
  return decode_any(bytes, message);
}
bool decode(std::span<const std::uint8_t> bytes, ForceMessage& message) noexcept {
  return decode_any(bytes, message);
}

}  // namespace drivers::station
