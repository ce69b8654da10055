#include "sim/bus/sii_image.h"

#include <algorithm>
#include <bit>
#include <string>

#include "drivers/ethercat/frame.h"

namespace sim::bus {
namespace {

using drivers::ethercat::store_le;

// Word addresses (ETG.1000.6, table 16) and category types (table 17).
constexpr std::size_t kPdiControlWord = 0x00;
constexpr std::size_t kAliasWord = 0x04;
constexpr std::size_t kChecksumWord = 0x07;
constexpr std::size_t kVendorWord = 0x08;
constexpr std::size_t kProductWord = 0x0A;
constexpr std::size_t kRevisionWord = 0x0C;
constexpr std::size_t kSerialWord = 0x0E;
constexpr std::size_t kBootMailboxWord = 0x14;      // out start, out size, in start, in size
constexpr std::size_t kStandardMailboxWord = 0x18;  // likewise
constexpr std::size_t kProtocolsWord = 0x1C;
constexpr std::size_t kSizeWord = 0x3E;     // in Kibit, minus one
constexpr std::size_t kVersionWord = 0x3F;  // 1
constexpr std::size_t kCategoriesWord = 0x40;

constexpr std::uint16_t kStrings = 10;
constexpr std::uint16_t kGeneral = 30;
constexpr std::uint16_t kFmmus = 40;
constexpr std::uint16_t kSyncManagers = 41;
constexpr std::uint16_t kTxPdos = 50;  // inputs: the slave transmits them
constexpr std::uint16_t kRxPdos = 51;
constexpr std::uint16_t kClock = 60;
constexpr std::uint16_t kEndOfCategories = 0xFFFF;

constexpr std::uint16_t kMiiPorts0And1 = 0x0011;
constexpr std::uint8_t kUnsigned8 = 0x05;  // data types as in CoE
constexpr std::uint8_t kUnsigned32 = 0x07;

using Bytes = std::vector<std::uint8_t>;

template <typename T>
void append(Bytes& bytes, T value) {
  bytes.resize(bytes.size() + sizeof(T));
  store_le(&bytes[bytes.size() - sizeof(T)], value);
}

template <typename T>
void put(Bytes& image, std::size_t word, T value) {
  store_le(&image[2 * word], value);
}

void append_category(Bytes& image, std::uint16_t type, Bytes content) {
  if (content.size() % 2 != 0) content.push_back(0);
  append(image, type);
  append(image, static_cast<std::uint16_t>(content.size() / 2));
  image.insert(image.end(), content.begin(), content.end());
}

Bytes strings(const SlaveDescription& description) {
  Bytes content{0};
  for (const std::string* text : {&description.order_code, &description.name, &description.group}) {
    if (text->empty()) continue;
    ++content[0];
    content.push_back(static_cast<std::uint8_t>(text->size()));
    content.insert(content.end(), text->begin(), text->end());
  }
  return content;
}

Bytes general(const SlaveDescription& description) {
  Bytes content(32, 0);                                              // ETG.2010, table 7
  const std::uint8_t name = description.order_code.empty() ? 1 : 2;  // strings count from 1
  content[0] = description.group.empty() ? std::uint8_t{0} : static_cast<std::uint8_t>(name + 1);
  content[2] = 1;  // order number
  content[3] = name;
  content[5] = (description.mailbox_protocols & mailbox_protocol::kCoE) != 0 ? 0x01 : 0x00;  // SDO
  content[6] = (description.mailbox_protocols & mailbox_protocol::kFoE) != 0 ? 0x01 : 0x00;
  content[7] = (description.mailbox_protocols & mailbox_protocol::kEoE) != 0 ? 0x01 : 0x00;
  store_le(&content[16], kMiiPorts0And1);
  return content;
}

Bytes fmmus(const SlaveDescription& description) {
  Bytes content;
  if (description.outputs.bytes > 0) content.push_back(1);
  if (description.inputs.bytes > 0) content.push_back(2);
  if (description.mailbox_in.length > 0) content.push_back(3);  // "mailbox full" as a bit of the image
  content.resize(content.size() + content.size() % 2, 0xFF);    // padding
  return content;
}

Bytes sync_managers(const std::vector<SyncManagerSetting>& managers) {
  Bytes content;
  for (const SyncManagerSetting& manager : managers) {
    append(content, manager.start);
    append(content, manager.length);
    content.push_back(manager.control);
    content.push_back(0);                           // status: nothing to preset
    content.push_back(manager.length > 0 ? 1 : 0);  // enable
    content.push_back(static_cast<std::uint8_t>(manager.use));
  }
  return content;
}

// One PDO over the whole image; bits without an entry are filled with numbers of 32 and 8 bits.
Bytes pdo(const ProcessImage& image, std::uint16_t pdo_index, std::uint16_t object_index,
          std::uint8_t manager) {
  std::vector<PdoEntry> entries = image.entries;
  unsigned used = 0;
  for (const PdoEntry& entry : entries) used += entry.bits;
  for (unsigned left = 8U * image.bytes - used; left > 0; left = 8U * image.bytes - used) {
    const auto bits = static_cast<std::uint8_t>(left % 8 != 0                 ? left % 8
                                                : used % 8 == 0 && left >= 32 ? 32
                                                                              : 8);
    entries.push_back(
        {.index = object_index, .subindex = static_cast<std::uint8_t>(entries.size() + 1), .bits = bits});
    used += bits;
  }

  Bytes content;
  append(content, pdo_index);
  content.push_back(static_cast<std::uint8_t>(entries.size()));
  content.push_back(manager);
  content.push_back(0);  // no distributed-clock synchronization
  content.push_back(0);  // no name
  append<std::uint16_t>(content, 0);
  for (const PdoEntry& entry : entries) {
    append(content, entry.index);
    content.push_back(entry.subindex);
    content.push_back(0);
    content.push_back(entry.bits == 32 ? kUnsigned32 : kUnsigned8);
    content.push_back(entry.bits);
    append<std::uint16_t>(content, 0);
  }
  return content;
}

void append_categories(Bytes& image, const SlaveDescription& description) {
  const std::vector<SyncManagerSetting> managers = sync_managers_of(description);
  const auto index_of = [&managers](SyncManagerUse use) {
    const auto found = std::ranges::find(managers, use, &SyncManagerSetting::use);
    return static_cast<std::uint8_t>(found - managers.begin());
  };
  append_category(image, kStrings, strings(description));
  append_category(image, kGeneral, general(description));
  append_category(image, kFmmus, fmmus(description));
  append_category(image, kSyncManagers, sync_managers(managers));
  if (description.inputs.bytes > 0) {
    append_category(image, kTxPdos,
                    pdo(description.inputs, 0x1A00, 0x6000, index_of(SyncManagerUse::kInputs)));
  }
  if (description.outputs.bytes > 0) {
    append_category(image, kRxPdos,
                    pdo(description.outputs, 0x1600, 0x7000, index_of(SyncManagerUse::kOutputs)));
  }
  if (description.has_distributed_clock) {
    Bytes clock(24, 0);
    store_le<std::uint16_t>(&clock[14], 0x0300);  // AssignActivate: cyclic unit, SYNC0
    append_category(image, kClock, clock);
  }
  append(image, kEndOfCategories);
}

}  // namespace

std::uint8_t sii_checksum(std::span<const std::uint8_t, kSiiChecksummedBytes> configuration) noexcept {
  unsigned remainder = 0xFF;
  for (const std::uint8_t byte : configuration) {
    remainder ^= byte;
    for (int bit = 0; bit < 8; ++bit) remainder = (remainder << 1) ^ ((remainder & 0x80) != 0 ? 0x107U : 0U);
  }
  return static_cast<std::uint8_t>(remainder);
}

std::vector<std::uint8_t> build_sii_image(const SlaveDescription& description) {
  validate(description);
  Bytes image(2 * kCategoriesWord, 0);
  put<std::uint16_t>(image, kPdiControlWord, 0x0008);  // 16-bit microcontroller, no device emulation
  put(image, kAliasWord, description.station_alias);
  put<std::uint16_t>(image, kChecksumWord, sii_checksum(std::span(image).first<kSiiChecksummedBytes>()));
  put(image, kVendorWord, description.vendor);
  put(image, kProductWord, description.product);
  put(image, kRevisionWord, description.revision);
  put(image, kSerialWord, description.serial);
  const auto put_mailbox = [&image](std::size_t word, const MailboxArea& out, const MailboxArea& in) {
    put(image, word, out.start);
    put(image, word + 1, out.length);
    put(image, word + 2, in.start);
    put(image, word + 3, in.length);
  };
  put_mailbox(kBootMailboxWord, description.boot_mailbox_out, description.boot_mailbox_in);
  put_mailbox(kStandardMailboxWord, description.mailbox_out, description.mailbox_in);
  put(image, kProtocolsWord, description.mailbox_protocols);
  put<std::uint16_t>(image, kVersionWord, 1);

  append_categories(image, description);
  image.resize(std::max<std::size_t>(std::bit_ceil(image.size()), 2048), 0xFF);
  put(image, kSizeWord, static_cast<std::uint16_t>(image.size() * 8 / 1024 - 1));
  return image;
}

}  // namespace sim::bus
