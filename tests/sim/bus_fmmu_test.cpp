// Logical addressing: working counters, bits, registers in the process image.
#include <gtest/gtest.h>

#include "sim/bus/fmmu.h"
#include "tests/sim/bus_hand_master.h"

namespace sim::bus::test {
namespace bus_fmmu_test {

TEST(Fmmu, MapsTheFourteenBitsOfTheDataSheetsExample) {
  // Section I, table 22: logical 0x00010011.3 to 0x00010013.0 onto 0x0F01.1 to 0x0F02.6.
  const Bytes registers{0x11, 0x00, 0x01, 0x00, 3, 0, 3, 0, 0x01, 0x0F, 1, 1, 1, 0, 0, 0};
  Fmmu fmmu;
  fmmu.configure(registers);
  EXPECT_EQ(fmmu.bits(), 14U);
  const MappedBits all = fmmu.match(0x0001'0010, 8);
  EXPECT_EQ(all.first, 8U + 3);
  EXPECT_EQ(all.count, 14U);
  EXPECT_EQ(all.physical_byte(), 0x0F01U);
  EXPECT_EQ(all.physical_bytes(), 2U);
  // A datagram that begins in its second byte.
  const MappedBits rest = fmmu.match(0x0001'0012, 4);
  EXPECT_EQ(rest.first, 0U);
  EXPECT_EQ(rest.count, 9U);
  EXPECT_EQ(rest.physical_first, 8U * 0x0F01 + 1 + 5);
  EXPECT_EQ(fmmu.match(0x0001'0014, 100).count, 0U);
  EXPECT_EQ(fmmu.match(0x0001'0000, 0x11).count, 0U);
}

TEST(Fmmu, BitsOutsideTheMappingStay) {
  const MappedBits bits{.first = 3, .count = 4, .physical_first = 8 * 0x1000 + 6};
  const Bytes physical{0b0100'0000, 0b1111'1110};  // bits 6, 7, 8, 9: 1 0 0 1
  Bytes datagram{0xFF};
  copy_bits_to_datagram(bits, physical, datagram);
  EXPECT_EQ(datagram, (Bytes{0b1100'1111}));
  Bytes back(2, 0xFF);
  copy_bits_from_datagram(bits, datagram, back);
  EXPECT_EQ(back, (Bytes{0b0100'0000, 0b0000'0010}));
}

TEST(LogicalCommands, CountThreeForBothTwoForOutputsOneForInputs) {
  EmulatedBus bus;
  bus.add(power_board());
  bus.add(drive());
  bus.add(only_outputs());
  bus.add(only_inputs());
  HandMaster master(bus);
  master.bring_up(AlState::kOp);
  ASSERT_EQ(master.image_bytes(), 5U + 5 + 20 + 20);
  const Bytes image(master.image_bytes());
  EXPECT_EQ(master.run(Command::kLrw, kLogical, image).counter, 0 + 3 + 2 + 1);
  EXPECT_EQ(master.run(Command::kLrd, kLogical, image).counter, 0 + 1 + 0 + 1);
  EXPECT_EQ(master.run(Command::kLwr, kLogical, image).counter, 0 + 1 + 1 + 0);
  EXPECT_EQ(master.run(Command::kLrw, kLogical + 0x1000, image).counter, 0);
  // A piece of the image: the outputs of slave 1 only.
  EXPECT_EQ(master.run(Command::kLrw, kLogical, Bytes(5)).counter, 2);
}

TEST(LogicalCommands, CarryOutputsThereAndInputsBack) {
  EmulatedBus bus;
  RecordingBoard first(bus.add(drive()));
  RecordingBoard second(bus.add(drive()));
  HandMaster master(bus);
  master.bring_up(AlState::kOp);
  first.input_data = Bytes(20, 0x11);
  second.input_data = Bytes(20, 0x22);
  bus.advance(1ms);
  Bytes image(50);
  for (std::size_t i = 0; i < 10; ++i) image[i] = static_cast<std::uint8_t>(i + 1);
  const Answer answer = master.exchange(image);
  EXPECT_EQ(answer.counter, 6);
  EXPECT_EQ(first.outputs, (Bytes{1, 2, 3, 4, 5}));
  EXPECT_EQ(second.outputs, (Bytes{6, 7, 8, 9, 10}));
  EXPECT_EQ(Bytes(answer.data.begin(), answer.data.begin() + 10), Bytes(image.begin(), image.begin() + 10));
  EXPECT_EQ(Bytes(answer.data.begin() + 10, answer.data.begin() + 30), Bytes(20, 0x11));
  EXPECT_EQ(Bytes(answer.data.begin() + 30, answer.data.end()), Bytes(20, 0x22));
}

TEST(LogicalCommands, OutputsAndInputsMayShareTheirPlace) {
  // SOEM's overlapping map: outputs are taken from the received data, then inputs overwrite them.
  EmulatedBus bus;
  RecordingBoard board(bus.add(drive()));
  HandMaster master(bus);
  master.configure();
  master.write_fmmu(0, 1, kLogical, 20, 0, 7, 0x1180, 0, 1);
  master.request(0, AlState::kPreOp);
  master.request(0, AlState::kSafeOp);
  board.input_data = Bytes(20, 0x77);
  bus.advance(1ms);
  Bytes image(20, 0x33);
  EXPECT_EQ(master.exchange(image).data, Bytes(20, 0x77));
  master.request(0, AlState::kOp);
  EXPECT_EQ(board.outputs, Bytes(5, 0x33));
}

TEST(LogicalCommands, MailboxFullIsABitOfTheImage) {
  // SOEM maps bit 3 of 0x080D.
  EmulatedBus bus;
  EmulatedSlave& slave = bus.add(drive());
  HandMaster master(bus);
  master.bring_up(AlState::kOp);
  const std::uint32_t logical = kLogical + 0x100;
  master.write_fmmu(0, 2, logical, 1, 5, 5, 0x080D, 3, 1);
  EXPECT_EQ(master.run(Command::kLrd, logical, {0xC0}).data, (Bytes{0xC0}));
  EXPECT_EQ(master.run(Command::kLrd, logical, {0xC0}).counter, 1);
  slave.post_mailbox(Bytes{1});
  bus.advance(1ms);
  EXPECT_EQ(master.run(Command::kLrd, logical, {0xC0}).data, (Bytes{0xE0}));
}

TEST(LogicalCommands, OfTwoMappingsOfOneBitTheFirstIsRead) {
  EmulatedBus bus;
  bus.add(power_board());
  HandMaster master(bus);
  master.write(0, 0x1800, {0xAA, 0xBB});
  master.write_fmmu(0, 0, kLogical, 1, 0, 7, 0x1800, 0, 1);
  master.write_fmmu(0, 1, kLogical, 1, 0, 7, 0x1801, 0, 1);
  const Answer answer = master.run(Command::kLrd, kLogical, {0});
  EXPECT_EQ(answer.data, (Bytes{0xAA}));
  EXPECT_EQ(answer.counter, 1);
}

TEST(LogicalCommands, AnFmmuOfBothDirectionsExchanges) {
  EmulatedBus bus;
  bus.add(power_board());
  HandMaster master(bus);
  master.write(0, 0x1800, {0xAA, 0xBB});
  master.write_fmmu(0, 0, kLogical, 2, 0, 7, 0x1800, 0, 3);
  const Answer answer = master.run(Command::kLrw, kLogical, {0x01, 0x02});
  EXPECT_EQ(answer.counter, 3);
  EXPECT_EQ(answer.data, (Bytes{0xAA, 0xBB}));
  EXPECT_EQ(master.read(0, 0x1800, 2).data, (Bytes{0x01, 0x02}));
}

TEST(LogicalCommands, WritesReachRegistersToo) {
  EmulatedBus bus;
  bus.add(power_board());
  HandMaster master(bus);
  master.write_fmmu(0, 0, kLogical, 2, 0, 7, reg::kStationAddress, 0, 2);
  EXPECT_EQ(master.run(Command::kLwr, kLogical, {0x07, 0x20}).counter, 1);
  EXPECT_EQ(master.read(0, reg::kStationAddress, 2).number(), 0x2007U);
}

TEST(LogicalCommands, AnFmmuIsOffUntilActivatedAndThoseThereAreNotStayEmpty) {
  EmulatedBus bus;
  SlaveDescription description = power_board();
  description.fmmu_count = 3;
  bus.add(description);
  HandMaster master(bus);
  master.write_fmmu(0, 3, kLogical, 2, 0, 7, 0x1800, 0, 1);
  EXPECT_EQ(master.run(Command::kLrd, kLogical, Bytes(2)).counter, 0);
  EXPECT_EQ(master.read(0, reg::kFmmu + 3 * 16, 16).data, Bytes(16));
  master.write_fmmu(0, 2, kLogical, 2, 0, 7, 0x1800, 0, 1);
  EXPECT_EQ(master.run(Command::kLrd, kLogical, Bytes(2)).counter, 1);
  master.write(0, reg::kFmmu + 2 * 16 + 12, {0});
  EXPECT_EQ(master.run(Command::kLrd, kLogical, Bytes(2)).counter, 0);
}

TEST(LogicalCommands, ProcessDataDoesNotCountBelowSafeOp) {
  EmulatedBus bus;
  bus.add(drive());
  HandMaster master(bus);
  master.bring_up(AlState::kPreOp);
  EXPECT_EQ(master.exchange(Bytes(25)).counter, 0);
  master.request(0, AlState::kSafeOp);
  EXPECT_EQ(master.exchange(Bytes(25)).counter, 3);
}

}  // namespace bus_fmmu_test
}  // namespace sim::bus::test
