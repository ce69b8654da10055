#include "drivers/usb/usb_descriptors.h"

#include <algorithm>
#include <array>
#include <cstdio>
#include <utility>

namespace drivers::usb {
namespace {

enum class Type : std::uint8_t {
  kDevice = 1,
  kConfiguration = 2,
  kInterface = 4,
  kEndpoint = 5,
  kInterfaceAssociation = 11,
  kHid = 0x21,
};

// Sizes of the standard parts; a device may append to them.
constexpr std::size_t kHeaderBytes = 2;
constexpr std::size_t kDeviceBytes = 18;
constexpr std::size_t kConfigurationBytes = 9;
constexpr std::size_t kInterfaceBytes = 9;
constexpr std::size_t kEndpointBytes = 7;
constexpr std::size_t kAssociationBytes = 8;
constexpr std::size_t kHidBytes = 9;

using Bytes = std::span<const std::uint8_t>;

template <typename... Values>
std::string format(const char* pattern, Values... values) {
  std::array<char, 160> text{};
  (void)std::snprintf(text.data(), text.size(), pattern, values...);
  return text.data();
}

unsigned word(Bytes bytes, std::size_t at) { return bytes[at] | static_cast<unsigned>(bytes[at + 1]) << 8U; }

const char* class_name(std::uint8_t code) {
  switch (code) {
    case 0x00: return "per interface";
    case 0x01: return "audio";
    case 0x02: return "communications";
    case 0x03: return "HID";
    case 0x07: return "printer";
    case 0x08: return "mass storage";
    case 0x09: return "hub";
    case 0x0A: return "communications data";
    case 0xFF: return "vendor's own";
    default: return "other";
  }
}

const char* transfer_name(unsigned attributes) {
  constexpr std::array<const char*, 4> kNames{"control", "isochronous", "bulk", "interrupt"};
  return kNames[attributes & 3U];
}

std::string version(unsigned binary_coded) {
  return format("%x.%02x", binary_coded >> 8U, binary_coded & 0xFFU);
}

std::string device_line(Bytes d) {
  return format(
      "device %04x:%04x, release %s, USB %s, class 0x%02x (%s), endpoint 0 of %u bytes, %u configuration%s",
      word(d, 8), word(d, 10), version(word(d, 12)).c_str(), version(word(d, 2)).c_str(),
      static_cast<unsigned>(d[4]), class_name(d[4]), static_cast<unsigned>(d[7]),
      static_cast<unsigned>(d[17]), d[17] == 1 ? "" : "s");
}

std::string configuration_line(Bytes d) {
  return format("configuration %u: %u interface%s, %s power, at most %u mA, %u bytes in all",
                static_cast<unsigned>(d[5]), static_cast<unsigned>(d[4]), d[4] == 1 ? "" : "s",
                (d[7] & 0x40U) != 0 ? "own" : "bus", 2U * d[8], word(d, 2));
}

std::string interface_line(Bytes d) {
  return format(
      "interface %u, alternate setting %u: class 0x%02x (%s), subclass 0x%02x, protocol 0x%02x, %u "
      "endpoint%s",
      static_cast<unsigned>(d[2]), static_cast<unsigned>(d[3]), static_cast<unsigned>(d[5]), class_name(d[5]),
      static_cast<unsigned>(d[6]), static_cast<unsigned>(d[7]), static_cast<unsigned>(d[4]),
      d[4] == 1 ? "" : "s");
}

std::string endpoint_line(Bytes d) {
  // Bits 11 and 12 of the size: additional packets per microframe, high speed only.
  const unsigned size = word(d, 4);
  return format("endpoint 0x%02x %s: %s, packets of %u bytes%s, interval %u", static_cast<unsigned>(d[2]),
                (d[2] & 0x80U) != 0 ? "IN" : "OUT", transfer_name(d[3]), size & 0x7FFU,
                (size >> 11U & 3U) != 0 ? format(", %u a microframe", 1U + (size >> 11U & 3U)).c_str() : "",
                static_cast<unsigned>(d[6]));
}

std::string other_line(Bytes d) {
  std::string text = format("descriptor 0x%02x of %zu bytes:", static_cast<unsigned>(d[1]), d.size());
  for (const std::uint8_t byte : d.subspan(kHeaderBytes))
    text += format(" %02x", static_cast<unsigned>(byte));
  return text;
}

/// Iterates over the descriptors.
class Reader {
 public:
  explicit Reader(Bytes bytes) : bytes_(bytes) {}

  DescriptorReport read() {
    if (bytes_.empty()) complain("there are none");
    while (at_ < bytes_.size()) {
      const Bytes rest = bytes_.subspan(at_);
      const std::size_t length = rest[0];
      if (length < kHeaderBytes) {
        complain(format("a length of %zu", length));
        break;
      }
      if (length > rest.size()) {
        complain(format("a length of %zu where %zu bytes are left", length, rest.size()));
        break;
      }
      take(rest.first(length));
      at_ += length;
    }
    end_configuration();
    return std::move(report_);
  }

 private:
  void complain(const std::string& what) {
    if (!report_.malformed) report_.malformed = "byte " + std::to_string(at_) + ": " + what;
  }

  void add(std::size_t level, const std::string& line) {
    report_.lines.push_back(std::string(2 * level, ' ') + line);
  }

  /// True if the descriptor has its standard part; otherwise reports an error.
  bool whole(Bytes descriptor, std::size_t bytes, const char* name) {
    if (descriptor.size() >= bytes) return true;
    complain(format("%s descriptor of %zu bytes, expected %zu", name, descriptor.size(), bytes));
    add(2, other_line(descriptor));
    return false;
  }

  void take(Bytes d) {
    switch (static_cast<Type>(d[1])) {
      case Type::kDevice:
        if (at_ != 0) complain("a second device descriptor");
        if (whole(d, kDeviceBytes, "device")) add(0, device_line(d));
        return;
      case Type::kConfiguration:
        end_configuration();
        if (!whole(d, kConfigurationBytes, "configuration")) return;
        configuration_end_ = at_ + word(d, 2);
        add(1, configuration_line(d));
        return;
      case Type::kInterface:
        if (!whole(d, kInterfaceBytes, "interface")) return;
        if (std::ranges::find(report_.interfaces, d[2]) == report_.interfaces.end())
          report_.interfaces.push_back(d[2]);
        add(2, interface_line(d));
        return;
      case Type::kEndpoint:
        if (whole(d, kEndpointBytes, "endpoint")) add(3, endpoint_line(d));
        return;
      case Type::kInterfaceAssociation:
        if (!whole(d, kAssociationBytes, "association")) return;
        add(2, format("interfaces %u to %u belong together", static_cast<unsigned>(d[2]),
                      static_cast<unsigned>(d[2]) + std::max(1U, static_cast<unsigned>(d[3])) - 1U));
        return;
      case Type::kHid:
        if (!whole(d, kHidBytes, "HID")) return;
        add(3, format("HID %s, report descriptor of %u bytes", version(word(d, 2)).c_str(), word(d, 7)));
        return;
    }
    add(3, other_line(d));
  }

  /// Its own byte count must end where the next one begins.
  void end_configuration() {
    if (configuration_end_ && *configuration_end_ != at_) {
      complain(format("the configuration ends here and says that it ends at byte %zu", *configuration_end_));
    }
    configuration_end_.reset();
  }

  Bytes bytes_;
  std::size_t at_ = 0;
  std::optional<std::size_t> configuration_end_;
  DescriptorReport report_;
};

}  // namespace

DescriptorReport report_descriptors(std::span<const std::uint8_t> bytes) { return Reader(bytes).read(); }

}  // namespace drivers::usb
