#include "drivers/ethercat/sii.h"

#include <algorithm>

#include "drivers/ethercat/frame.h"

namespace drivers::ethercat {
namespace {

// Word addresses of the fixed area.
constexpr std::size_t kAlias = 0x04;
constexpr std::size_t kRevision = 0x0C;
constexpr std::size_t kMailboxOut = 0x18;
constexpr std::size_t kMailboxIn = 0x1A;
constexpr std::size_t kMailboxProtocols = 0x1C;
constexpr std::uint32_t kFirstCategory = 0x40;
constexpr std::uint32_t kBlank = 0xFFFF'FFFF;

enum CategoryType : std::uint16_t {
  kStrings = 10,
  kGeneral = 30,
  kSyncManagers = 41,
  kTxPdos = 50,
  kRxPdos = 51,
  kEnd = 0xFFFF,
};
// String indices in the general category.
constexpr std::size_t kGeneralGroupOffset = 0;
constexpr std::size_t kGeneralNameOffset = 3;

/// The largest EEPROM has 4 Mbit; a chain beyond 64 KiB of words or of more categories is garbage.
constexpr std::uint32_t kHighestWord = 0x10000;
constexpr std::size_t kMaxCategories = 64;
/// No slave needs more than this in one of the categories read here.
constexpr std::uint32_t kMaxCategoryWords = 0x1000;

bool wanted(std::uint16_t type) noexcept {
  return type == kStrings || type == kGeneral || type == kSyncManagers || type == kTxPdos || type == kRxPdos;
}

template <typename T>
T at_word(const std::vector<std::uint8_t>& image, std::size_t word) {
  return load_le<T>(&image[2 * word]);
}

}  // namespace

std::optional<std::uint16_t> SiiReader::next_word() const noexcept {
  if (complete_) return std::nullopt;
  return static_cast<std::uint16_t>(next_word_);
}

void SiiReader::store(std::span<const std::uint8_t> bytes) {
  if (complete_) return;
  const std::size_t begin = 2 * std::size_t{next_word_};
  if (image_.size() < begin + bytes.size()) image_.resize(begin + bytes.size(), 0xFF);
  std::copy(bytes.begin(), bytes.end(), image_.begin() + static_cast<std::ptrdiff_t>(begin));
  next_word_ += static_cast<std::uint32_t>(bytes.size() / 2);
  while (!complete_ && next_word_ >= goal_word_) {
    if (reading_header_)
      take_header();
    else
      begin_header();
  }
}

void SiiReader::begin_header() {
  if (header_word_ + 2 > kHighestWord) {
    give_up("the category chain runs out of the EEPROM");
    return;
  }
  reading_header_ = true;
  next_word_ = std::max(next_word_, header_word_);
  goal_word_ = header_word_ + 2;
}

void SiiReader::take_header() {
  const auto type = at_word<std::uint16_t>(image_, header_word_);
  const auto words = at_word<std::uint16_t>(image_, header_word_ + 1);
  if (type == kEnd) {
    complete_ = true;
    return;
  }
  if (++categories_seen_ > kMaxCategories ||
      (wanted(type) && (words > kMaxCategoryWords || header_word_ + 2 + words > kHighestWord))) {
    give_up("the category chain is not plausible (category " + std::to_string(type) + " of " +
            std::to_string(words) + " words); is the EEPROM programmed?");
    return;
  }
  const std::uint32_t begin = header_word_ + 2;
  reading_header_ = false;
  goal_word_ = header_word_ = begin + words;
  if (wanted(type))
    categories_.push_back({type, 2 * std::size_t{begin}, 2 * std::size_t{words}});
  else
    next_word_ = std::max(next_word_, goal_word_);  // skipped, not read
}

void SiiReader::give_up(const std::string& error) {
  error_ = error;
  complete_ = true;
}

SiiInfo SiiReader::info() {
  SiiInfo info;
  if (image_.size() < 2 * kFirstCategory) {
    error_ = "the EEPROM could not be read";
    return info;
  }
  info.alias = at_word<std::uint16_t>(image_, kAlias);
  info.vendor = at_word<std::uint32_t>(image_, kSiiVendorWord);
  info.product = at_word<std::uint32_t>(image_, kSiiProductWord);
  info.revision = at_word<std::uint32_t>(image_, kRevision);
  info.serial = at_word<std::uint32_t>(image_, kSiiSerialWord);
  info.mailbox_out = {at_word<std::uint16_t>(image_, kMailboxOut),
                      at_word<std::uint16_t>(image_, kMailboxOut + 1)};
  info.mailbox_in = {at_word<std::uint16_t>(image_, kMailboxIn),
                     at_word<std::uint16_t>(image_, kMailboxIn + 1)};
  info.mailbox_protocols = at_word<std::uint16_t>(image_, kMailboxProtocols);
  if (info.vendor == kBlank) {
    error_ = "the EEPROM is blank (vendor 0xFFFFFFFF)";
    return info;
  }
  if (const auto longest = std::max(info.mailbox_out.length, info.mailbox_in.length);
      longest > kMaxDatagramBytes) {
    error_ = "a mailbox of " + std::to_string(longest) + " bytes does not fit a frame";
  }

  std::size_t name_index = 0;
  std::size_t group_index = 0;
  for (const Category& category : categories_) {
    if (category.begin_bytes + category.size_bytes > image_.size()) continue;
    const std::span bytes(image_.data() + category.begin_bytes, category.size_bytes);
    switch (category.type) {
      case kStrings: parse_strings(bytes); break;
      case kGeneral:
        if (bytes.size() <= kGeneralNameOffset) break;
        name_index = bytes[kGeneralNameOffset];
        group_index = bytes[kGeneralGroupOffset];
        break;
      case kSyncManagers: parse_sync_managers(bytes, info); break;
      case kTxPdos: parse_pdos(bytes, info.input_pdos); break;
      case kRxPdos: parse_pdos(bytes, info.output_pdos); break;
      default: break;
    }
  }
  if (!strings_.empty()) info.first_string = strings_.front();
  const auto string = [&](std::size_t number) {  // they count from 1
    return number > 0 && number <= strings_.size() ? strings_[number - 1] : std::string();
  };
  info.name = string(name_index);
  info.group = string(group_index);
  return info;
}

void SiiReader::parse_strings(std::span<const std::uint8_t> category) {
  strings_.clear();
  if (category.empty()) return;
  std::size_t position = 1;
  for (unsigned left = category[0]; left > 0; --left) {
    if (position >= category.size() || position + 1 + category[position] > category.size()) {
      error_ = "the strings end before their count";
      return;
    }
    const std::size_t length = category[position];
    const auto* const text = reinterpret_cast<const char*>(category.data() + position + 1);
    strings_.emplace_back(text, std::find(text, text + length, '\0'));
    position += 1 + length;
  }
}

void SiiReader::parse_sync_managers(std::span<const std::uint8_t> category, SiiInfo& info) const {
  info.sync_managers.clear();
  for (; category.size() >= 8; category = category.subspan(8))
    info.sync_managers.push_back({.start = load_le<std::uint16_t>(&category[0]),
                                  .length = load_le<std::uint16_t>(&category[2]),
                                  .control = category[4],
                                  .enable = category[6],
                                  .use = static_cast<SyncManagerUse>(category[7])});
}

void SiiReader::parse_pdos(std::span<const std::uint8_t> category, std::vector<PdoInfo>& pdos) {
  while (category.size() >= 8) {
    PdoInfo pdo{.index = load_le<std::uint16_t>(&category[0]), .sync_manager = category[3]};
    const std::size_t entries = category[2];
    category = category.subspan(8);
    if (category.size() < 8 * entries) {
      error_ = "a PDO ends before its entries";
      return;
    }
    for (std::size_t i = 0; i < entries; ++i)
      pdo.bits = static_cast<std::uint16_t>(pdo.bits + category[8 * i + 5]);
    category = category.subspan(8 * entries);
    if (pdo.index != 0) pdos.push_back(pdo);
  }
}

}  // namespace drivers::ethercat
