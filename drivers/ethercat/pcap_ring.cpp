#include "drivers/ethercat/pcap_ring.h"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <ctime>
#include <fstream>
#include <ostream>
#include <stdexcept>

#include "drivers/ethercat/bus_error.h"

namespace drivers::ethercat {
namespace {

using std::chrono::nanoseconds;

// pcapng, draft-ietf-opsawg-pcapng: blocks of 32-bit words; option values are padded to words, too.
constexpr std::uint32_t kSectionHeader = 0x0A0D0D0A;
constexpr std::uint32_t kInterfaceDescription = 1;
constexpr std::uint32_t kEnhancedPacket = 6;
constexpr std::uint32_t kByteOrderMagic = 0x1A2B3C4D;
constexpr std::uint16_t kLinkTypeEthernet = 1;
// Option codes, each valid within its kind of block.
constexpr std::uint16_t kEndOfOptions = 0;
constexpr std::uint16_t kComment = 1;
constexpr std::uint16_t kSectionApplication = 4;
constexpr std::uint16_t kInterfaceName = 2;
constexpr std::uint16_t kTimestampResolution = 9;
constexpr std::uint16_t kFrameCheckSequenceBytes = 13;
constexpr std::uint16_t kPacketFlags = 2;
constexpr std::uint32_t kInbound = 1;
constexpr std::uint32_t kOutbound = 2;
constexpr std::size_t kLongestOption = 1000;  // a length field has 16 bits

/// A block under construction.
class Block {
 public:
  explicit Block(std::uint32_t type) {
    bytes_.reserve(kMaxFrameBytes + 64);  // once, for a packet and its options
    add(type);
    add(std::uint32_t{0});  // length, filled in at the end
  }
  template <typename T>
  void add(T value) {
    const std::size_t at = bytes_.size();
    bytes_.resize(at + sizeof(T));
    store_le(&bytes_[at], value);
  }
  void add_padded(std::span<const std::uint8_t> data) {
    bytes_.insert(bytes_.end(), data.begin(), data.end());
    bytes_.resize((bytes_.size() + 3) / 4 * 4);
  }
  void add_option(std::uint16_t code, std::span<const std::uint8_t> value) {
    add(code);
    add(static_cast<std::uint16_t>(value.size()));
    add_padded(value);
  }
  void add_option(std::uint16_t code, const std::string& text) {
    std::vector<std::uint8_t> value(text.begin(), text.end());
    value.resize(std::min(value.size(), kLongestOption));
    add_option(code, value);
  }
  void end_options() { add_option(kEndOfOptions, std::span<const std::uint8_t>()); }
  void write(std::ostream& out) {
    const auto length = static_cast<std::uint32_t>(bytes_.size() + 4);
    add(length);
    store_le(&bytes_[4], length);
    out.write(reinterpret_cast<const char*>(bytes_.data()), static_cast<std::streamsize>(bytes_.size()));
  }

 private:
  std::vector<std::uint8_t> bytes_;
};

nanoseconds read_clock(clockid_t id) noexcept {
  timespec time{};
  clock_gettime(id, &time);
  return std::chrono::seconds(time.tv_sec) + nanoseconds(time.tv_nsec);
}

}  // namespace

nanoseconds wall_clock_minus_monotonic() noexcept {
  // Wall clock between the two readings that are closest together.
  nanoseconds best = nanoseconds::max();
  nanoseconds offset{};
  for (int i = 0; i < 5; ++i) {
    const nanoseconds before = read_clock(CLOCK_MONOTONIC);
    const nanoseconds wall = read_clock(CLOCK_REALTIME);
    const nanoseconds width = read_clock(CLOCK_MONOTONIC) - before;
    if (width >= best) continue;
    best = width;
    offset = wall - (before + width / 2);
  }
  return offset;
}

PcapRing::PcapRing(const Options& options)
    : interface_(options.interface),
      slot_bytes_(options.bytes),
      clock_(options.clock),
      slots_(options.frames),
      memory_(options.frames * options.bytes) {
  if (memory_.empty()) throw std::invalid_argument("PcapRing: needs room for at least one byte of one frame");
}

void PcapRing::frame(Direction direction, std::span<const std::uint8_t> bytes) noexcept {
  if (stopped_.load(std::memory_order_relaxed)) return;
  Slot& slot = slots_[next_];
  slot.stamp = clock_();
  slot.original_bytes = static_cast<std::uint32_t>(bytes.size());
  slot.kept_bytes = static_cast<std::uint32_t>(std::min(bytes.size(), slot_bytes_));
  slot.direction = direction;
  std::copy_n(bytes.begin(), slot.kept_bytes, &memory_[next_ * slot_bytes_]);
  next_ = next_ + 1 < slots_.size() ? next_ + 1 : 0;
  ++seen_;
  if (stopping_ && --left_ == 0) stopped_.store(true, std::memory_order_release);
}

void PcapRing::stop_after(std::size_t frames) noexcept {
  if (stopping_) return;
  stopping_ = true;
  left_ = frames;
  if (frames == 0) stopped_.store(true, std::memory_order_release);
}

void PcapRing::resume() noexcept {
  seen_ = 0;
  next_ = 0;
  stopping_ = false;
  stopped_.store(false, std::memory_order_relaxed);
}

std::size_t PcapRing::size() const noexcept {
  return static_cast<std::size_t>(std::min<std::uint64_t>(seen_, slots_.size()));
}

void PcapRing::write(std::ostream& out, nanoseconds wall_clock_minus_monotonic,
                     const std::string& comment) const {
  Block section(kSectionHeader);
  section.add(kByteOrderMagic);
  section.add(std::uint16_t{1});  // version 1.0
  section.add(std::uint16_t{0});
  section.add(std::int64_t{-1});  // length of the section: unspecified
  section.add_option(kComment, (comment.empty() ? "" : comment + "; ") + "the last " +
                                   std::to_string(size()) + " of " + std::to_string(seen_) + " frames");
  section.add_option(kSectionApplication, std::string("youbot-hal"));
  section.end_options();
  section.write(out);

  Block interface(kInterfaceDescription);
  interface.add(kLinkTypeEthernet);
  interface.add(std::uint16_t{0});
  interface.add(static_cast<std::uint32_t>(slot_bytes_));
  interface.add_option(kInterfaceName, interface_);
  interface.add_option(kTimestampResolution, std::array<std::uint8_t, 1>{9});  // 10^-9 s
  interface.add_option(kFrameCheckSequenceBytes,
                       std::array<std::uint8_t, 1>{0});  // otherwise padding is mistaken for it
  interface.end_options();
  interface.write(out);

  const std::size_t count = size();
  for (std::size_t i = 0; i < count; ++i) {
    const std::size_t place = (next_ + slots_.size() - count + i) % slots_.size();
    const Slot& slot = slots_[place];
    const auto stamp = static_cast<std::uint64_t>((slot.stamp + wall_clock_minus_monotonic).count());
    Block packet(kEnhancedPacket);
    packet.add(std::uint32_t{0});  // interface
    packet.add(static_cast<std::uint32_t>(stamp >> 32));
    packet.add(static_cast<std::uint32_t>(stamp));
    packet.add(slot.kept_bytes);
    packet.add(slot.original_bytes);
    packet.add_padded(std::span(memory_).subspan(place * slot_bytes_, slot.kept_bytes));
    std::array<std::uint8_t, 4> flags{};
    store_le(flags.data(), slot.direction == Direction::kReceived ? kInbound : kOutbound);
    packet.add_option(kPacketFlags, flags);
    packet.end_options();
    packet.write(out);
  }
}

void PcapRing::write(const std::string& path, const std::string& comment) const {
  errno = 0;
  std::ofstream file(path, std::ios::binary | std::ios::trunc);
  write(file, wall_clock_minus_monotonic(), comment);
  file.close();
  if (!file)
    throw BusError(path, "write the capture of " + interface_,
                   errno != 0 ? std::strerror(errno) : "the file cannot be written");
}

}  // namespace drivers::ethercat
