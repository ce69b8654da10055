// Frames that no master sends. The sanitizers detect errors; the seed is fixed.
#include <gtest/gtest.h>

#include <memory>
#include <random>

#include "sim/bus/sii_image.h"
#include "tests/sim/bus_hand_master.h"

namespace sim::bus::test {
namespace bus_fuzz_test {

constexpr int kFrames = 100'000;
constexpr std::uint32_t kSeed = 20'240'611;

std::vector<Bytes> valid_frames() {
  const auto at = [](std::uint16_t slave, std::uint16_t offset) {
    return drivers::ethercat::address_of(slave, offset);
  };
  return {HandFrame().add(Command::kBrd, 0, Bytes(2)).bytes(),
          HandFrame()
              .add(Command::kLrw, kLogical, Bytes(75))
              .add(Command::kFpwr, at(kStation, 0x1000), Bytes(32))
              .add(Command::kFprd, at(kStation + 1, 0x1040), Bytes(32))
              .bytes(),
          HandFrame()
              .add(Command::kApwr, at(0, reg::kSyncManager), Bytes(32, 1))
              .add(Command::kBwr, at(0, reg::kFmmu), Bytes(64, 1))
              .add(Command::kFrmw, at(kStation, reg::kDcSystemTime), Bytes(8))
              .bytes(),
          HandFrame()
              .add(Command::kFpwr, at(kStation, reg::kSiiControl), {0x00, 0x01, 0x08, 0, 0, 0})
              .add(Command::kBrw, at(0, reg::kRxErrorCounters), Bytes(20))
              .add(Command::kAprw, at(0, reg::kAlControl), {0x02, 0x00})
              .add(Command::kArmw, at(0, 0x0900), Bytes(64))
              .bytes(),
          HandFrame().add(Command::kBrw, at(0, 0x0000), Bytes(1486, 0x01)).bytes()};
}

TEST(Prefixes, EveryPrefixOfAValidFrameIsHandled) {
  EmulatedBus bus;
  for (int i = 0; i < 3; ++i) bus.add(drive());
  HandMaster(bus).bring_up(AlState::kOp);
  for (const Bytes& frame : valid_frames()) {
    for (std::size_t size = 0; size <= frame.size(); ++size) {
      Bytes prefix(frame.begin(), frame.begin() + static_cast<std::ptrdiff_t>(size));
      prefix.shrink_to_fit();  // so that the sanitizer sees its end
      const bool returned = bus.process(prefix);
      EXPECT_FALSE(returned && size < 28) << size;
      EXPECT_TRUE(returned || size < frame.size());
    }
  }
}

TEST(Fuzz, AHundredThousandMutatedFramesDoNoHarm) {
  EmulatedBus bus;
  std::vector<std::unique_ptr<RecordingBoard>> boards;
  for (const SlaveDescription& description : {drive(), power_board(), only_inputs(), drive()}) {
    boards.push_back(std::make_unique<RecordingBoard>(bus.add(description)));
    boards.back()->reply = {1, 2, 3, 4};
  }
  HandMaster master(bus);
  master.bring_up(AlState::kOp);
  const std::vector<Bytes> seeds = valid_frames();
  std::mt19937 random(kSeed);
  const auto below = [&random](std::size_t limit) { return static_cast<std::size_t>(random() % limit); };
  std::size_t returned = 0;
  for (int i = 0; i < kFrames; ++i) {
    Bytes frame = seeds[below(seeds.size())];
    const bool mutate_heads = below(4) == 0;  // most stay well-formed, so that they get past the parser
    for (std::size_t k = below(12); k > 0; --k) {
      const std::size_t first = mutate_heads ? 12 : 26;
      frame[first + below(std::min<std::size_t>(frame.size(), 160) - first)] =
          static_cast<std::uint8_t>(random());
    }
    if (frame.size() > 24 && below(2) == 0) {  // another command, address and offset for the first datagram
      frame[16] = static_cast<std::uint8_t>(below(16));
      frame[18] = static_cast<std::uint8_t>(below(8));
      frame[20] = static_cast<std::uint8_t>(random());
      frame[21] = static_cast<std::uint8_t>(below(0x40));
    }
    if (below(8) == 0) frame.resize(below(frame.size() + 1));
    frame.shrink_to_fit();
    if (bus.process(frame)) ++returned;
    bus.advance(std::chrono::microseconds(below(2000)));
    if (below(500) == 0) bus.set_power(below(4), below(2) == 0);
    if (below(500) == 0) bus.set_cable(below(4), below(2) == 0);
    if (below(200) == 0) {
      for (std::size_t k = 0; k < 4; ++k) {
        bus.set_power(k, true);
        bus.set_cable(k, true);
      }
      master.bring_up(AlState::kOp);
    }
  }
  EXPECT_GT(returned, kFrames / 10U) << "the loop must get past the parser to mean anything";

  // Whatever happened, a power cycle and a clean start lead to OP.
  for (std::size_t k = 0; k < 4; ++k) {
    bus.set_power(k, false);
    bus.set_power(k, true);
    bus.set_cable(k, true);
    for (const std::size_t word : {0U, 1U, 2U, 3U, 4U, 5U, 6U, 7U}) {  // the EEPROM outlives even this
      const std::vector<std::uint8_t> image = build_sii_image(bus.slave(k).description());
      bus.slave(k).controller().sii().image()[2 * word] = image[2 * word];
      bus.slave(k).controller().sii().image()[2 * word + 1] = image[2 * word + 1];
    }
    bus.set_power(k, false);
    bus.set_power(k, true);
  }
  master.bring_up(AlState::kOp);
  for (std::size_t k = 0; k < 4; ++k) EXPECT_EQ(bus.slave(k).state(), AlState::kOp);
}

}  // namespace bus_fuzz_test
}  // namespace sim::bus::test
