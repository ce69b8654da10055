#include "drivers/haptic/hid_nodes.h"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <cstddef>
#include <optional>
#include <string_view>
#include <system_error>

#include "drivers/setup_error.h"
#include "drivers/uninterrupted.h"

namespace drivers::haptic {
namespace {

namespace fs = std::filesystem;

SetupError unreadable(const fs::path& path, int error) {
  return SetupError({path.string(), "read", "what the kernel knows about HID devices",
                     std::generic_category().message(error),
                     "check that this process may open more files and that the container shows /sys"});
}

/// Not the device's fault: every other file fails alike.
bool out_of_resources(int error) noexcept { return error == EMFILE || error == ENFILE || error == ENOMEM; }

/// Nothing when the file, or the device that it is about, is gone or cannot be read.
std::optional<std::string> kernel_file(const fs::path& path) {
  const int file = uninterrupted([&] { return ::open(path.c_str(), O_RDONLY | O_CLOEXEC); });
  if (file < 0 && out_of_resources(errno)) throw unreadable(path, errno);
  if (file < 0) return std::nullopt;
  // A page: sysfs shows no more of a uevent, and the kernel takes no longer report descriptor.
  std::array<char, 4096> text{};
  std::size_t size = 0;
  ssize_t count = 0;
  do {
    count = uninterrupted([&] { return ::read(file, text.data() + size, text.size() - size); });
    if (count > 0) size += static_cast<std::size_t>(count);
  } while (count > 0 && size < text.size());
  const int error = count < 0 ? errno : 0;
  ::close(file);
  if (out_of_resources(error)) throw unreadable(path, error);
  if (error != 0) return std::nullopt;
  return std::string(text.data(), size);
}

/// Of the line "KEY=value"; empty when there is none.
std::string_view value_of(std::string_view key, std::string_view uevent) {
  while (!uevent.empty()) {
    const std::string_view line = uevent.substr(0, uevent.find('\n'));
    if (line.starts_with(key) && line.substr(key.size()).starts_with('=')) return line.substr(key.size() + 1);
    uevent.remove_prefix(std::min(line.size() + 1, uevent.size()));
  }
  return {};
}

std::optional<std::uint16_t> id_of(std::string_view digits) {
  std::uint16_t id = 0;
  const char* const end = digits.data() + digits.size();
  const auto [stop, error] = std::from_chars(digits.data(), end, id, 16);
  if (error != std::errc() || stop != end) return std::nullopt;
  return id;
}

std::string printable(std::string_view text) {
  std::string result(text);
  std::ranges::replace_if(
      result, [](char c) { return c < ' ' || c > '~'; }, '?');
  return result;
}

/// `folder`: of the HID device; its file uevent has a line "HID_ID=0003:0000256F:0000C635": bus, vendor and
/// product.
std::optional<HidNode> node_at(const fs::path& folder, const std::string& path) {
  const std::optional<std::string> uevent = kernel_file(folder / "uevent");
  if (!uevent) return std::nullopt;
  const std::string_view ids = value_of("HID_ID", *uevent);
  const std::size_t first = ids.find(':');
  const std::size_t second = ids.rfind(':');
  if (first == second) return std::nullopt;
  const std::optional<std::uint16_t> vendor = id_of(ids.substr(first + 1, second - first - 1));
  const std::optional<std::uint16_t> product = id_of(ids.substr(second + 1));
  if (!vendor || !product) return std::nullopt;
  return HidNode{.path = path,
                 .folder = folder,
                 .vendor = *vendor,
                 .product = *product,
                 .serial = printable(value_of("HID_UNIQ", *uevent))};
}

// Items of a report descriptor: type and tag, without the size in the two lowest bits (HID 1.11, 6.2.2).
constexpr std::uint8_t kUsagePage = 0x04;
constexpr std::uint8_t kUsage = 0x08;
constexpr std::uint8_t kCollection = 0xa0;
constexpr std::uint8_t kSizeBits = 0x03;
constexpr std::uint8_t kTypeBits = 0x0c;  // 0: main
constexpr std::uint8_t kLongItem = 0xfe;
constexpr std::size_t kLongItemHeader = 3;

std::size_t data_size(std::uint8_t prefix) noexcept {
  const std::size_t size = prefix & kSizeBits;
  return size == 3 ? 4 : size;
}

/// Little-endian.
std::uint32_t number(std::span<const std::uint8_t> data) noexcept {
  std::uint32_t value = 0;
  for (std::size_t i = 0; i < data.size(); ++i) value |= std::uint32_t{data[i]} << 8 * i;
  return value;
}

/// Which usage a main item gets: local items hold for the next main item, global ones until they change.
class UsageInScope {
 public:
  void take(std::uint8_t item, std::span<const std::uint8_t> data) noexcept {
    const std::uint32_t value = number(data);
    if (item == kUsagePage) page_ = static_cast<std::uint16_t>(value);
    if (item == kUsage && !usage_) {
      // Of four bytes, the upper two are the page.
      const auto page = data.size() == 4 ? static_cast<std::uint16_t>(value >> 16U) : page_;
      usage_ = HidUsage{page, static_cast<std::uint16_t>(value)};
    }
    if ((item & kTypeBits) == 0) usage_.reset();
  }
  const std::optional<HidUsage>& usage() const noexcept { return usage_; }

 private:
  std::uint16_t page_ = 0;
  std::optional<HidUsage> usage_;
};

}  // namespace

std::vector<HidNode> hid_nodes(const usb::SystemPaths& paths) {
  const fs::path all = paths.sys / "class/hidraw";
  std::error_code error;
  std::vector<HidNode> found;
  for (fs::directory_iterator entry(all, error), end; !error && entry != end; entry.increment(error)) {
    const fs::path name = entry->path().filename();
    if (auto node = node_at(entry->path() / "device", paths.dev / name)) found.push_back(std::move(*node));
  }
  // A kernel without HID devices may not have the folder.
  if (error && error != std::errc::no_such_file_or_directory) throw unreadable(all, error.value());
  // hidraw2 before hidraw10.
  std::ranges::sort(found, [](const HidNode& a, const HidNode& b) {
    return a.path.size() != b.path.size() ? a.path.size() < b.path.size() : a.path < b.path;
  });
  return found;
}

std::vector<std::uint8_t> report_descriptor_of(const HidNode& node) {
  const std::string bytes = kernel_file(node.folder / "report_descriptor").value_or("");
  return {bytes.begin(), bytes.end()};
}

bool has_collection(std::span<const std::uint8_t> report_descriptor, HidUsage wanted) noexcept {
  UsageInScope scope;
  while (!report_descriptor.empty()) {
    const std::uint8_t prefix = report_descriptor[0];
    std::size_t size = 1 + data_size(prefix);
    if (prefix == kLongItem && report_descriptor.size() >= kLongItemHeader)
      size = kLongItemHeader + report_descriptor[1];
    if (size > report_descriptor.size()) return false;
    if (prefix != kLongItem) {
      const auto item = static_cast<std::uint8_t>(prefix & ~kSizeBits);
      if (item == kCollection && scope.usage() == wanted) return true;
      scope.take(item, report_descriptor.subspan(1, size - 1));
    }
    report_descriptor = report_descriptor.subspan(size);
  }
  return false;
}

}  // namespace drivers::haptic
