// The SII image, byte by byte, and how a master reads it through the controller.
#include <gtest/gtest.h>

#include <stdexcept>

#include "sim/bus/sii_image.h"
#include "tests/sim/bus_hand_master.h"

namespace sim::bus::test {
namespace bus_sii_test {

std::uint16_t word(const Bytes& image, std::size_t address) {
  return static_cast<std::uint16_t>(image[2 * address] | image[2 * address + 1] << 8);
}

// The content of a category, empty if it is not there.
Bytes category(const Bytes& image, std::uint16_t type) {
  for (std::size_t at = 0x40; word(image, at) != 0xFFFF; at += 2U + word(image, at + 1)) {
    if (word(image, at) != type) continue;
    const auto first = image.begin() + static_cast<std::ptrdiff_t>(2 * (at + 2));
    return {first, first + 2 * word(image, at + 1)};
  }
  return {};
}

TEST(SiiImage, ChecksumIsThatOfConfigurationAreasMadeByOthers) {
  // The first words of EEPROMs of KickCAT's examples (f10386d): LAN9252 and XMC4800.
  const std::array<std::uint8_t, 14> lan9252{0x80, 0x06, 0x00, 0x44, 0x64};
  const std::array<std::uint8_t, 14> xmc4800{0x80, 0x02, 0x81, 0x00};
  EXPECT_EQ(sii_checksum(lan9252), 0xF3);
  EXPECT_EQ(sii_checksum(xmc4800), 0xD1);
}

TEST(SiiImage, HeadHoldsIdentityMailboxSizeAndVersion) {
  SlaveDescription description = drive();
  description.station_alias = 0x00A5;
  description.mailbox_protocols = mailbox_protocol::kCoE | mailbox_protocol::kFoE;
  description.boot_mailbox_out = {.start = 0x1400, .length = 128};
  description.boot_mailbox_in = {.start = 0x1480, .length = 128};
  const Bytes image = build_sii_image(description);
  ASSERT_EQ(image.size(), 2048U);
  EXPECT_EQ(word(image, 0x04), 0x00A5);
  EXPECT_EQ(word(image, 0x07), sii_checksum(std::span(image).first<14>()));
  EXPECT_EQ(word(image, 0x08), 0x0286);
  EXPECT_EQ(word(image, 0x0A), 0x0011);
  EXPECT_EQ(word(image, 0x0C), 0x0001);
  EXPECT_EQ(word(image, 0x0D), 0x0002);
  EXPECT_EQ(word(image, 0x0E), 0x5678);
  EXPECT_EQ(word(image, 0x0F), 0x1234);
  EXPECT_EQ(word(image, 0x14), 0x1400);
  EXPECT_EQ(word(image, 0x17), 128);
  EXPECT_EQ(word(image, 0x18), 0x1000);
  EXPECT_EQ(word(image, 0x19), 32);
  EXPECT_EQ(word(image, 0x1A), 0x1040);
  EXPECT_EQ(word(image, 0x1B), 32);
  EXPECT_EQ(word(image, 0x1C), 0x000C);
  EXPECT_EQ(word(image, 0x3E), 15);  // 16 Kibit
  EXPECT_EQ(word(image, 0x3F), 1);
}

TEST(SiiImage, CategoriesAreThoseOfTheStandardByteByByte) {
  const Bytes image = build_sii_image(drive());
  EXPECT_EQ(category(image, 10), (Bytes{1, 9, 'T', 'M', 'C', 'M', '-', '1', '6', '1', '0', 0}));
  const Bytes general = category(image, 30);
  ASSERT_EQ(general.size(), 32U);
  EXPECT_EQ(general[3], 1);      // name: first string
  EXPECT_EQ(general[16], 0x11);  // ports 0 and 1: MII
  EXPECT_EQ(category(image, 40), (Bytes{1, 2, 3, 0xFF}));
  EXPECT_EQ(category(image, 41), (Bytes{0x00, 0x10, 32, 0, 0x26, 0, 1, 1,  //
                                        0x40, 0x10, 32, 0, 0x22, 0, 1, 2,  //
                                        0x00, 0x11, 5,  0, 0x64, 0, 1, 3,  //
                                        0x80, 0x11, 20, 0, 0x20, 0, 1, 4}));
  // 5 bytes out: one number of 32 bits, one of 8.
  EXPECT_EQ(category(image, 51), (Bytes{0x00, 0x16, 2, 2, 0,    0,  0, 0,  //
                                        0x00, 0x70, 1, 0, 0x07, 32, 0, 0,  //
                                        0x00, 0x70, 2, 0, 0x05, 8,  0, 0}));
  const Bytes inputs = category(image, 50);
  ASSERT_EQ(inputs.size(), 8U * 6);
  EXPECT_EQ(inputs[2], 5);  // entries
  EXPECT_EQ(inputs[3], 3);  // sync manager
  EXPECT_EQ(category(image, 60).size(), 24U);
}

TEST(SiiImage, AGroupIsTheLastStringAndLeavesNameAndOrderCodeInTheirPlaces) {
  SlaveDescription description = power_board();
  description.group = "abc";
  for (const bool order_code : {false, true}) {
    if (order_code) description.order_code = "xy";
    const Bytes image = build_sii_image(description);
    const Bytes general = category(image, 30);
    EXPECT_EQ(general[0], order_code ? 3 : 2);
    EXPECT_EQ(general[2], 1);
    EXPECT_EQ(general[3], order_code ? 2 : 1);
    EXPECT_EQ(category(image, 10),
              order_code ? (Bytes{3, 2, 'x', 'y', 6, 'K', 'R', '-', '8', '4', '5', 3, 'a', 'b', 'c', 0})
                         : (Bytes{2, 6, 'K', 'R', '-', '8', '4', '5', 3, 'a', 'b', 'c'}));
  }
  EXPECT_EQ(category(build_sii_image(power_board()), 30)[0], 0) << "none";
}

TEST(SiiImage, SlaveWithoutProcessDataHasNoSuchCategories) {
  const Bytes image = build_sii_image(power_board());
  EXPECT_TRUE(category(image, 40).empty());
  EXPECT_TRUE(category(image, 41).empty());
  EXPECT_TRUE(category(image, 50).empty());
  EXPECT_TRUE(category(image, 51).empty());
  EXPECT_TRUE(category(image, 60).empty());
  EXPECT_EQ(category(image, 10), (Bytes{1, 6, 'K', 'R', '-', '8', '4', '5'}));
}

TEST(SiiImage, OwnEntriesAreKeptAndFilledUp) {
  SlaveDescription description = drive();
  description.outputs.entries = {{.index = 0x7010, .subindex = 1, .bits = 12}};
  const Bytes outputs = category(build_sii_image(description), 51);
  unsigned bits = 0;
  for (std::size_t at = 8; at < outputs.size(); at += 8) bits += outputs[at + 5];
  EXPECT_EQ(bits, 40U);
  EXPECT_EQ(outputs[8], 0x10);
  EXPECT_EQ(outputs[13], 12);
}

TEST(SlaveDescription, NamesEverythingThatIsWrong) {
  SlaveDescription description = drive();
  description.fmmu_count = 2;
  description.inputs.start = 0x1108;  // inside the three output buffers
  try {
    validate(description);
    FAIL();
  } catch (const std::invalid_argument& error) {
    const std::string message = error.what();
    EXPECT_NE(message.find("TMCM-1610"), std::string::npos) << message;
    EXPECT_NE(message.find("FMMU"), std::string::npos) << message;
    EXPECT_NE(message.find("sync manager 3 overlaps sync manager 2"), std::string::npos) << message;
  }
}

class SiiAccess : public ::testing::Test {
 protected:
  SiiAccess() { bus.add(drive()); }
  // The way SOEM does it: command and address in one datagram, data with the next frame.
  Answer read_word(std::uint16_t address) {
    master.write(0, reg::kSiiControl, 0x0100 | std::uint64_t{address} << 16, 6);
    return master.read(0, reg::kSiiData, 8);
  }
  EmulatedBus bus;
  HandMaster master{bus};
};

TEST_F(SiiAccess, EightBytesFromVendorOn) {
  master.write(0, reg::kStationAddress, kStation, 2);
  const Answer written =
      master.run(Command::kFpwr, kStation, reg::kSiiControl, {0x00, 0x01, 0x08, 0x00, 0x00, 0x00});
  EXPECT_EQ(written.counter, 1);
  // Idle, no error, reads 8 bytes.
  EXPECT_EQ(master.run(Command::kFprd, kStation, reg::kSiiControl, Bytes(2)).data, (Bytes{0x40, 0x00}));
  EXPECT_EQ(master.run(Command::kFprd, kStation, reg::kSiiData, Bytes(8)).data,
            (Bytes{0x86, 0x02, 0x00, 0x00, 0x11, 0x00, 0x00, 0x00}));
}

TEST_F(SiiAccess, TheAnswerIsNotYetThereInTheFrameOfTheCommand) {
  const std::vector<Answer> answers = master.run(
      HandFrame()
          .add(Command::kApwr, drivers::ethercat::address_of(0, reg::kSiiControl), {0x00, 0x01, 8, 0, 0, 0})
          .add(Command::kAprd, drivers::ethercat::address_of(0, reg::kSiiData), Bytes(4)));
  EXPECT_EQ(answers[1].data, Bytes(4));
}

TEST_F(SiiAccess, BehindTheEndAllBitsAreSet) { EXPECT_EQ(read_word(0x0500).number(), ~std::uint64_t{0}); }

TEST_F(SiiAccess, AWordIsWrittenAndOutlivesAPowerCycle) {
  master.write(0, reg::kSiiData, 0xBEEF, 2);
  master.write(0, reg::kSiiControl, 0x0201 | std::uint64_t{0x0004} << 16, 6);
  EXPECT_EQ(read_word(4).number() & 0xFFFF, 0xBEEFU);
  EXPECT_EQ(master.read(0, reg::kStationAlias, 2).number(), 0U) << "loaded at power-up only";
  bus.set_power(0, false);
  bus.set_power(0, true);
  EXPECT_EQ(read_word(4).number() & 0xFFFF, 0xBEEFU);
}

TEST_F(SiiAccess, AWrongChecksumShutsTheMemoryAndShowsInTheStatus) {
  master.write(0, reg::kSiiData, 0xBEEF, 2);
  master.write(0, reg::kSiiControl, 0x0201 | std::uint64_t{0x0004} << 16, 6);
  bus.set_power(0, false);
  bus.set_power(0, true);
  EXPECT_EQ(master.read(0, reg::kSiiControl, 2).number(), 0x1840U);
  EXPECT_EQ(master.read(0, reg::kDlStatus, 2).number() & 1U, 0U);
  EXPECT_EQ(master.read(0, 0x1800, 4).counter, 0);
}

TEST_F(SiiAccess, AWriteWithoutEnableIsAnErrorUntilCleared) {
  master.write(0, reg::kSiiControl, 0x0200 | std::uint64_t{0x0004} << 16, 6);
  EXPECT_EQ(master.read(0, reg::kSiiControl, 2).number(), 0x4040U);
  EXPECT_EQ(read_word(8).number(), 0U) << "no command while an error waits";
  master.write(0, reg::kSiiControl, 0x0000, 2);
  EXPECT_EQ(master.read(0, reg::kSiiControl, 2).number(), 0x0040U);
  EXPECT_EQ(read_word(8).number() & 0xFFFF, 0x0286U);
}

TEST_F(SiiAccess, AnUnknownCommandIsAnError) {
  master.write(0, reg::kSiiControl, 0x0300, 2);
  EXPECT_EQ(master.read(0, reg::kSiiControl, 2).number(), 0x2040U);
}

TEST_F(SiiAccess, IsDeafWhileTheFirmwareHasTheEeprom) {
  master.write(0, reg::kSiiConfiguration, 0x01, 1);
  EXPECT_EQ(read_word(8).number(), 0U);
  master.write(0, reg::kSiiConfiguration, 0x00, 1);
  EXPECT_EQ(read_word(8).number() & 0xFFFF, 0x0286U);
}

TEST(SiiTiming, BusyForItsTimeThenFourBytes) {
  EmulatedBus bus;
  bus.add(drive(), {.sii = {.reads_8_bytes = false, .read_time = 200us, .write_time = 5ms}});
  HandMaster master(bus);
  master.write(0, reg::kSiiControl, 0x0100 | std::uint64_t{8} << 16, 6);
  EXPECT_EQ(master.read(0, reg::kSiiControl, 2).number(), 0x8100U);
  bus.advance(199us);
  EXPECT_EQ(master.read(0, reg::kSiiControl, 2).number(), 0x8100U);
  master.write(0, reg::kSiiAddress, 0, 4);  // locked
  bus.advance(1us);
  EXPECT_EQ(master.read(0, reg::kSiiControl, 2).number(), 0x0000U);
  EXPECT_EQ(master.read(0, reg::kSiiData, 8).number(), 0x0000'0286U);
}

}  // namespace bus_sii_test
}  // namespace sim::bus::test
