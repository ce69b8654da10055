// SII images constructed by hand from ETG.2010: word addresses of the fixed area, categories from 0x40.
#include "drivers/ethercat/sii.h"

#include <gtest/gtest.h>

#include <random>

#include "sim/bus/sii_image.h"
#include "tests/drivers/ethercat_fakes.h"

namespace drivers::ethercat::test {
namespace ethercat_sii_test {

class Image {
 public:
  Image() : bytes_(2 * 0x40) {
    word(0x04, 0x0007);
    word(0x08, 0x0286), word(0x09, 0x0000);
    word(0x0A, 0x0011), word(0x0B, 0x0000);
    word(0x0C, 0x0001), word(0x0D, 0x0002);
    word(0x0E, 0x5678), word(0x0F, 0x1234);
    word(0x18, 0x1000), word(0x19, 0x0040);
    word(0x1A, 0x1080), word(0x1B, 0x0030);
    word(0x1C, 0x0004);
  }
  Image& word(std::size_t address, std::uint16_t value) {
    store_le(&bytes_[2 * address], value);
    return *this;
  }
  Image& category(std::uint16_t type, Bytes content) {
    if (content.size() % 2 != 0) content.push_back(0);
    return header(type, static_cast<std::uint16_t>(content.size() / 2)).append(content);
  }
  Image& header(std::uint16_t type, std::uint16_t words) {
    return append({static_cast<std::uint8_t>(type), static_cast<std::uint8_t>(type >> 8),
                   static_cast<std::uint8_t>(words), static_cast<std::uint8_t>(words >> 8)});
  }
  Image& append(const Bytes& more) {
    bytes_.insert(bytes_.end(), more.begin(), more.end());
    return *this;
  }
  Image& end() { return append({0xFF, 0xFF}); }
  const Bytes& bytes() const { return bytes_; }

 private:
  Bytes bytes_;
};

struct Reading {
  SiiInfo info;
  std::string error;
  int reads = 0;
};

// Plays the EEPROM: bytes beyond the image read `beyond`.
Reading read(const Bytes& image, std::size_t bytes_at_once, std::uint8_t beyond = 0xFF) {
  SiiReader reader;
  Reading result;
  // Every word of the largest EEPROM read once, 4 bytes at a time: more would be going round in circles.
  while (result.reads < 0x8000) {
    const auto word = reader.next_word();
    if (!word) break;
    Bytes data(bytes_at_once, beyond);
    for (std::size_t i = 0; i < data.size(); ++i)
      if (2U * *word + i < image.size()) data[i] = image[2U * *word + i];
    reader.store(data);
    ++result.reads;
  }
  EXPECT_FALSE(reader.next_word().has_value()) << "still reading";
  result.info = reader.info();
  result.error = reader.error();
  return result;
}

const Bytes kStrings{3,   3,   'a', 'b', 'c', 9,   'T', 'M', 'C', 'M', '-',
                     '1', '6', '1', '0', 5,   'm', 'o', 't', 'o', 'r'};
const Bytes kGeneral{3, 0, 0, 2, 0, 0};
const Bytes kManagers{0x00, 0x10, 0x40, 0, 0x26, 0, 1, 1, 0x80, 0x10, 0x30, 0, 0x22, 0, 1, 2,
                      0x00, 0x11, 0x05, 0, 0x64, 0, 1, 3, 0x00, 0x12, 0x14, 0, 0x20, 0, 1, 4};
// A PDO: index, entries, sync manager, sync unit, name, flags; an entry: index, subindex, name, type, bits,
// flags.
const Bytes kTxPdo{0x00, 0x1A, 2, 3, 0,    0,    0, 0, 0x00, 0x60, 1, 0,
                   0,    32,   0, 0, 0x00, 0x60, 2, 0, 0,    128,  0, 0};
const Bytes kRxPdo{0x00, 0x16, 1, 2, 0, 0, 0, 0, 0x00, 0x70, 1, 0, 0, 40, 0, 0};

Image whole() {
  Image image;
  image.category(10, kStrings).category(30, kGeneral).category(40, Bytes(2)).category(41, kManagers);
  image.category(50, kTxPdo).category(51, kRxPdo).end();
  return image;
}

class SiiReads : public ::testing::TestWithParam<std::size_t> {};

TEST_P(SiiReads, AHandMadeImageIsUnderstood) {
  const Reading result = read(whole().bytes(), GetParam());
  EXPECT_EQ(result.error, "");
  const SiiInfo& info = result.info;
  EXPECT_EQ(info.vendor, 0x286U);
  EXPECT_EQ(info.product, 0x11U);
  EXPECT_EQ(info.revision, 0x00020001U);
  EXPECT_EQ(info.serial, 0x12345678U);
  EXPECT_EQ(info.alias, 7);
  EXPECT_EQ(info.name, "TMCM-1610");
  EXPECT_EQ(info.first_string, "abc");
  EXPECT_EQ(info.group, "motor");
  EXPECT_TRUE(info.is_called("abc") && info.is_called("TMCM-1610"));
  EXPECT_FALSE(info.is_called("TMCM-1632"));
  EXPECT_EQ(info.mailbox_out.start, 0x1000);
  EXPECT_EQ(info.mailbox_out.length, 0x40);
  EXPECT_EQ(info.mailbox_in.start, 0x1080);
  EXPECT_EQ(info.mailbox_in.length, 0x30);
  EXPECT_TRUE(info.speaks_coe());
  ASSERT_EQ(info.sync_managers.size(), 4U);
  EXPECT_EQ(info.sync_managers[2].start, 0x1100);
  EXPECT_EQ(info.sync_managers[2].length, 5);
  EXPECT_EQ(info.sync_managers[2].control, 0x64);
  EXPECT_EQ(info.sync_managers[2].use, SyncManagerUse::kOutputs);
  ASSERT_EQ(info.input_pdos.size(), 1U);
  EXPECT_EQ(info.input_pdos[0].index, 0x1A00);
  EXPECT_EQ(info.input_pdos[0].sync_manager, 3);
  EXPECT_EQ(info.input_pdos[0].bits, 160);
  ASSERT_EQ(info.output_pdos.size(), 1U);
  EXPECT_EQ(info.output_pdos[0].bits, 40);
}

TEST_P(SiiReads, AllPossibleReadsCoverTheImageOnceAndNoMore) {
  const Bytes image = whole().bytes();
  // One read more than the size requires: a category may begin in the middle of a block read before a jump.
  EXPECT_LE(read(image, GetParam()).reads, static_cast<int>(image.size() / GetParam()) + 2);
}

TEST_P(SiiReads, UnknownCategoriesAreJumpedOver) {
  Image image;
  image.category(0x0801, Bytes(4000, 0xAB)).category(10, kStrings).category(30, kGeneral).end();
  const Reading result = read(image.bytes(), GetParam());
  EXPECT_EQ(result.error, "");
  EXPECT_EQ(result.info.name, "TMCM-1610");
  EXPECT_LT(result.reads, 128 / 4 + 20) << "the 4000 bytes were read";
}

TEST_P(SiiReads, AnImageOfTheEmulatedSlavesIsUnderstood) {
  const Reading result = read(sim::bus::build_sii_image(drive("TMCM-1632")), GetParam());
  EXPECT_EQ(result.error, "");
  EXPECT_EQ(result.info.name, "TMCM-1632");
  EXPECT_EQ(result.info.mailbox_in.start, kMailboxIn);
  EXPECT_FALSE(result.info.speaks_coe());
}

TEST_P(SiiReads, WithoutEndMarkerTheBlankRestEndsIt) {
  Image image;
  image.category(10, kStrings).category(30, kGeneral);
  const Reading result = read(image.bytes(), GetParam(), 0xFF);
  EXPECT_EQ(result.error, "");
  EXPECT_EQ(result.info.name, "TMCM-1610");
}

TEST_P(SiiReads, WithoutEndMarkerAndWithZerosBehindItGivesUp) {
  Image image;
  image.category(10, kStrings);
  EXPECT_TRUE(contains(read(image.bytes(), GetParam(), 0x00).error, "not plausible (category 0 of 0 words)"));
}

TEST_P(SiiReads, ABlankEepromIsNamed) {
  EXPECT_EQ(read(Bytes(2048, 0xFF), GetParam()).error, "the EEPROM is blank (vendor 0xFFFFFFFF)");
}

TEST_P(SiiReads, AnEepromOfZerosIsNotPlausible) {
  const Reading result = read(Bytes(2048, 0x00), GetParam(), 0x00);
  EXPECT_TRUE(contains(result.error, "is the EEPROM programmed?"));
  EXPECT_LT(result.reads, 200);
}

TEST_P(SiiReads, ACategoryThatIsTooLargeIsNotRead) {
  for (const std::uint16_t words : {std::uint16_t{0x1001}, std::uint16_t{0x7FFF}, std::uint16_t{0xFFFF}}) {
    Image image;
    image.header(41, words).append(kManagers);
    const Reading result = read(image.bytes(), GetParam());
    EXPECT_TRUE(contains(result.error, "category 41 of " + std::to_string(words) + " words"));
    EXPECT_LT(result.reads, 64);
  }
}

TEST_P(SiiReads, AChainHasUpTo64Categories) {
  for (const int categories : {64, 65}) {
    Image image;
    for (int i = 0; i < categories; ++i) image.header(0x0900, 0);
    const std::string error = read(image.bytes(), GetParam()).error;
    EXPECT_EQ(contains(error, "not plausible (category 2304 of 0 words)"), categories > 64) << error;
  }
}

TEST_P(SiiReads, AChainThatLeavesTheEepromEnds) {
  Image image;
  image.header(0x0900, 0xFFF0);
  EXPECT_EQ(read(image.bytes(), GetParam()).error, "the category chain runs out of the EEPROM");
}

TEST_P(SiiReads, AMailboxThatFitsNoFrameIsRefused) {
  Image image = whole();
  image.word(0x1B, 1487);
  EXPECT_EQ(read(image.bytes(), GetParam()).error, "a mailbox of 1487 bytes does not fit a frame");
  image.word(0x1B, 1486);
  EXPECT_EQ(read(image.bytes(), GetParam()).error, "");
}

TEST_P(SiiReads, StringsThatEndEarlyAreNamed) {
  for (const Bytes& strings :
       {Bytes{3, 3, 'a', 'b', 'c'}, Bytes{1, 200, 'a', 'b'}, Bytes{255, 0}, Bytes{3, 0, 0, 5}}) {
    Image image;
    image.category(10, strings).category(30, kGeneral).end();
    const Reading result = read(image.bytes(), GetParam());
    EXPECT_EQ(result.error, "the strings end before their count");
  }
}

TEST_P(SiiReads, APdoThatEndsEarlyIsNamed) {
  Bytes pdo = kTxPdo;
  pdo[2] = 3;
  Image image;
  image.category(50, pdo).end();
  const Reading result = read(image.bytes(), GetParam());
  EXPECT_EQ(result.error, "a PDO ends before its entries");
  EXPECT_TRUE(result.info.input_pdos.empty());
}

TEST_P(SiiReads, NameNumbersBeyondTheStringsGiveNoName) {
  Image image;
  image.category(10, kStrings).category(30, {5, 0, 0, 4}).end();
  const SiiInfo info = read(image.bytes(), GetParam()).info;
  EXPECT_EQ(info.name, "");
  EXPECT_EQ(info.group, "");
}

TEST_P(SiiReads, EmptyCategoriesAreHarmless) {
  Image image;
  for (const std::uint16_t type : std::array<std::uint16_t, 5>{10, 30, 41, 50, 51}) image.category(type, {});
  const Reading result = read(image.end().bytes(), GetParam());
  EXPECT_EQ(result.error, "");
  EXPECT_TRUE(result.info.sync_managers.empty());
}

TEST_P(SiiReads, EveryPrefixEnds) {
  const Bytes image = whole().bytes();
  for (std::size_t size = 0; size < image.size(); ++size)
    for (const std::uint8_t beyond : {std::uint8_t{0xFF}, std::uint8_t{0}})
      (void)read({image.begin(), image.begin() + static_cast<std::ptrdiff_t>(size)}, GetParam(), beyond);
}

TEST_P(SiiReads, SeededMutationsEnd) {
  std::mt19937 random(4711);
  const Bytes original = whole().bytes();
  int errors = 0;
  for (int run = 0; run < 1000; ++run) {
    Bytes image = original;
    for (auto changes = 1 + random() % 6; changes > 0; --changes)
      image[random() % image.size()] = static_cast<std::uint8_t>(random());
    errors += read(image, GetParam()).error.empty() ? 0 : 1;
  }
  EXPECT_GT(errors, 50) << "the mutations spoil nothing";
}

INSTANTIATE_TEST_SUITE_P(FourOrEightBytes, SiiReads, ::testing::Values(4, 8));

}  // namespace ethercat_sii_test
}  // namespace drivers::ethercat::test
