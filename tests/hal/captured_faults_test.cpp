// Captures of bus faults, replayed through the whole master byte by byte: the master must send what it sent
// during the capture, and it gets the captured answers.
//
// tests/data/captures/start.pcapng is a base from the first frame to its motion; each other capture continues
// from there. They come from the emulated bus. After an intended change of the master's frames, this command
// regenerates them; without a change it produces the same files:
//     YOUBOT_RECORD_CAPTURES=1 build/tests/test_hal --gtest_filter='*CapturedFault*'
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdlib>
#include <fstream>
#include <functional>
#include <memory>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "drivers/ethercat/frame.h"
#include "drivers/ethercat/pcap_ring.h"
#include "drivers/ethercat/registers.h"
#include "drivers/tmcl/process_data.h"
#include "hal/clock.h"
#include "hal/ethercat_robot.h"
#include "sim/bus/bus_link.h"
#include "sim/bus/youbot_bus.h"
#include "tests/drivers/ethercat_fakes.h"
#include "tests/support/built_paths.h"
#include "tests/support/capture_file.h"
#include "tests/support/replay_link.h"

namespace hal {
namespace captured_faults_test {

using namespace std::chrono_literals;
using drivers::ethercat::Command;
using drivers::ethercat::Datagram;
using drivers::ethercat::Direction;
using drivers::ethercat::Link;
using drivers::ethercat::MacAddress;
using drivers::ethercat::PcapRing;
using drivers::ethercat::test::Bytes;
using drivers::ethercat::test::contains;
using drivers::ethercat::test::frame_of_another_master;
using drivers::tmcl::ControllerMode;
using sim::bus::BusLink;
using sim::bus::FaultEvent;
using sim::bus::FaultKind;
using sim::bus::YoubotBus;
using std::chrono::nanoseconds;
namespace reg = drivers::ethercat::reg;

/// When the start is over, and the fault: by the time of the bus, which is the same in each run.
constexpr nanoseconds kMoving = 200ms;
constexpr nanoseconds kFaultAt = kMoving + 5ms;
// Short captures: as few bytes as the boards' firmware has, and a quick commutation.
constexpr std::size_t kProcessData_bytes = 20;
constexpr nanoseconds kCommutation = 10ms;

/// A base whose wheels are commanded to turn, cycle by cycle.
class Master {
 public:
  Master(std::function<std::unique_ptr<Link>()> open_link, drivers::ethercat::FrameTap* tap)
      : robot(make_ethercat_robot(std::move(open_link),
                                  {.kind = YoubotKind::kBase, .tolerated_cycles = 10, .tap = tap}, clock_,
                                  1ms)) {}

  /// `cycle_ends` lets the time of the bus go on until the end of the period.
  template <typename Now, typename CycleEnds>
  void cycle(Now now, CycleEnds cycle_ends) {
    clock_.sleep_until(clock_.now() + 1ms);
    const nanoseconds due = now() + 1ms;
    status = robot->exchange(command, sample);
    if (due > now()) cycle_ends(due);
  }

 private:
  VirtualClock clock_;

 public:
  std::unique_ptr<Robot> robot;
  RobotCommand command;
  RobotSample sample;
  CycleStatus status;
};

/// One fault, and the observation time.
struct Fault {
  const char* name;
  int cycles;
  std::vector<FaultEvent> script{};
  /// What another party does to the bus before each cycle behind kMoving.
  std::function<void(YoubotBus&, int cycle)> meddle{};
  /// The robot is disabled with this cycle, and enabled two cycles later.
  int enabled_again_at = -1;
};

/// Result of a run.
struct Seen {
  std::vector<CycleStatus> status;                   // of each cycle behind kMoving
  std::vector<std::array<ControllerMode, 4>> modes;  // of the drives, in each frame sent then that has any
  std::string explained;                             // the first fault
  std::set<std::string> faults;                      // each line that was there
  std::optional<BusLosses> losses;
  bool moved_before = false;
};

/// Starts, moves, meets the fault. The same calls in the same cycles, whatever bus it is.
template <typename Now, typename CycleEnds>
Seen run(Master& master, const Fault& fault, Now now, CycleEnds cycle_ends,
         const std::function<void()>& moving, const std::function<void(int)>& meddle) {
  Seen seen;
  master.robot->activate();
  master.command.enable = true;
  while (now() < kMoving) {
    for (std::size_t i = 0; i < 4 && master.sample.enabled; ++i)
      master.command.joints[i] = JointCommand::velocity_rad_per_s(1.0);
    master.cycle(now, cycle_ends);
  }
  seen.moved_before = master.sample.enabled && master.status.ok();
  moving();
  for (int cycle = 0; cycle < fault.cycles; ++cycle) {
    meddle(cycle);
    master.command.enable =
        fault.enabled_again_at < 0 || cycle < fault.enabled_again_at || cycle > fault.enabled_again_at + 1;
    master.cycle(now, cycle_ends);
    if (!master.status.ok() && seen.explained.empty()) seen.explained = master.robot->explain(master.status);
    seen.status.push_back(master.status);
    for (std::string& line : master.robot->device_faults()) seen.faults.insert(std::move(line));
  }
  seen.losses = master.robot->losses();
  return seen;
}

std::string path_of(const std::string& name) {
  return support::source_dir() + "/tests/data/captures/" + name + ".pcapng";
}

/// The clock of the capture under way.
const Link* captured_link = nullptr;
nanoseconds capture_time() noexcept {
  return captured_link != nullptr ? captured_link->now() : nanoseconds(0);
}

/// Gives the master's frames and their replies the address that a master has before it draws its own, so that
/// captures that are recorded again are the same files.
class WithoutOwnAddress final : public drivers::ethercat::FrameTap {
 public:
  explicit WithoutOwnAddress(PcapRing& ring) : ring_(ring) {}

  void frame(Direction direction, std::span<const std::uint8_t> bytes) noexcept override {
    Bytes copy(bytes.begin(), bytes.end());
    MacAddress source{};
    const auto at = copy.begin() + drivers::ethercat::kSourceMacOffset;
    std::copy_n(at, source.size(), source.begin());
    if (direction == Direction::kSent)
      own_ = source;
    else
      source[0] &= static_cast<std::uint8_t>(~drivers::ethercat::kReturnedBit);
    if (source == own_) {
      std::copy(drivers::ethercat::kMasterMac.begin(), drivers::ethercat::kMasterMac.end(), at);
      if (direction == Direction::kReceived) *at |= drivers::ethercat::kReturnedBit;
    }
    ring_.frame(direction, copy);
  }

 private:
  PcapRing& ring_;
  MacAddress own_{};
};

/// Against the emulated bus, into the files.
void record(const Fault& fault) {
  sim::bus::YoubotBusOptions options;
  options.base.on_ground = false;
  options.board.firmware = drivers::tmcl::Firmware::k148;
  options.board.commutation_time = kCommutation;
  options.process_data_bytes = kProcessData_bytes;
  options.wire.faults = fault.script;
  YoubotBus bus(options);
  PcapRing ring({.interface = "emulated base",
                 .frames = 4096,
                 .bytes = drivers::ethercat::kMaxFrameBytes,
                 .clock = capture_time});
  WithoutOwnAddress tap(ring);
  Master master(
      [&bus]() -> std::unique_ptr<Link> {
        auto link = std::make_unique<BusLink>(bus.wire(), &bus);
        captured_link = link.get();
        return link;
      },
      &tap);
  const auto write = [&ring](const std::string& name, const std::string& comment) {
    std::ofstream file(path_of(name), std::ios::binary);
    ring.write(file, nanoseconds(0), comment);
    ASSERT_TRUE(file.flush()) << path_of(name);
    ring.resume();
  };
  (void)run(
      master, fault, [&] { return bus.wire().now(); },
      [&](nanoseconds due) { bus.advance(due - bus.wire().now()); },
      [&] { write("start", "from the first frame to all wheels in motion"); },
      [&](int cycle) {
        if (fault.meddle) fault.meddle(bus, cycle);
      });
  write(fault.name, "goes on where start.pcapng ends");
  captured_link = nullptr;
}

/// Modes of the four drives as the master's frame has them, in one piece or slave by slave.
std::optional<std::array<ControllerMode, 4>> modes_of(Bytes frame) {
  Bytes image;
  drivers::ethercat::FrameReader reader;
  Datagram datagram;
  if (reader.parse(frame) != drivers::ethercat::FrameError::kNone) return std::nullopt;
  while (reader.next(datagram))
    if (datagram.command == Command::kLrw)
      image.insert(image.end(), datagram.data.begin(), datagram.data.end());
  if (image.size() < 8 * kProcessData_bytes) return std::nullopt;
  std::array<ControllerMode, 4> modes{};
  for (std::size_t i = 0; i < modes.size(); ++i) {
    drivers::tmcl::DriveOutput output;
    // Of each slave its outputs, then its inputs.
    if (!drivers::tmcl::unpack(std::span(image).subspan(2 * i * kProcessData_bytes, kProcessData_bytes),
                               output))
      return std::nullopt;
    modes[i] = output.mode;
  }
  return modes;
}

Seen replay(const Fault& fault) {
  if (std::getenv("YOUBOT_RECORD_CAPTURES") != nullptr) record(fault);
  std::vector<support::CapturedFrame> frames = support::read_capture(path_of("start"));
  const std::vector<support::CapturedFrame> rest = support::read_capture(path_of(fault.name));
  frames.insert(frames.end(), rest.begin(), rest.end());
  auto opened = std::make_unique<support::ReplayLink>(std::move(frames));
  support::ReplayLink& link = *opened;
  Master master([&opened] { return std::move(opened); }, nullptr);
  std::size_t sent_before = 0;
  Seen seen = run(
      master, fault, [&link] { return link.now(); }, [&link](nanoseconds due) { link.advance_to(due); },
      [&] { sent_before = link.sent.size(); }, [](int) {});
  EXPECT_EQ(link.difference(), "");
  EXPECT_TRUE(link.at_end()) << "the master sent less than when it was captured";
  EXPECT_TRUE(seen.moved_before);
  for (std::size_t i = sent_before; i < link.sent.size(); ++i)
    if (const auto modes = modes_of(link.sent[i])) seen.modes.push_back(*modes);
  EXPECT_FALSE(seen.modes.empty());
  EXPECT_EQ(seen.modes.front(), (std::array{ControllerMode::kVelocity, ControllerMode::kVelocity,
                                            ControllerMode::kVelocity, ControllerMode::kVelocity}));
  return seen;
}

constexpr std::array kAllStop{ControllerMode::kMotorStop, ControllerMode::kMotorStop,
                              ControllerMode::kMotorStop, ControllerMode::kMotorStop};

/// Cycles from the fault's beginning to its report; -1: there was none.
int reported_after(const Seen& seen) {
  const auto first = std::find_if(seen.status.begin(), seen.status.end(),
                                  [](const CycleStatus& status) { return !status.ok(); });
  return first == seen.status.end() ? -1 : static_cast<int>(first - seen.status.begin()) - 5;
}

/// Once it is latched, each frame stops all motors.
void expect_latched_and_off(const Seen& seen) {
  EXPECT_FALSE(seen.status.back().ok());
  const auto first = std::find(seen.modes.begin(), seen.modes.end(), kAllStop);
  ASSERT_NE(first, seen.modes.end()) << "no frame stops the motors";
  EXPECT_TRUE(std::all_of(first, seen.modes.end(), [](const auto& modes) { return modes == kAllStop; }));
  EXPECT_GT(seen.modes.end() - first, 3);
}

bool says(const Seen& seen, const std::string& part) {
  return std::any_of(seen.faults.begin(), seen.faults.end(),
                     [&part](const std::string& line) { return line.find(part) != std::string::npos; });
}

TEST(ReplayLink, AFrameThatWasNotCapturedIsFoundAndGetsNoAnswer) {
  const Bytes captured = frame_of_another_master(Command::kBrd, 0x0130);
  Bytes reply = captured;
  reply[drivers::ethercat::kSourceMacOffset] |= drivers::ethercat::kReturnedBit;
  for (const bool other : {false, true}) {
    support::ReplayLink link({{0ms, Direction::kSent, captured}, {1ms, Direction::kReceived, reply}});
    Bytes sent = captured;
    sent[drivers::ethercat::kSourceMacOffset + 5] ^= 0x10;  // a master draws its own address
    if (other) sent[20] ^= 1;
    Bytes answer(drivers::ethercat::kMaxFrameBytes);
    EXPECT_TRUE(link.send(sent));
    EXPECT_EQ(link.receive(answer, 500us), 0U) << "in the capture's time";
    EXPECT_EQ(link.receive(answer, 500us), other ? 0U : reply.size());
    EXPECT_EQ(link.difference(), other ? "frame 0: differs from byte 20 on" : "");
    const std::size_t last = drivers::ethercat::kSourceMacOffset + 5;
    EXPECT_EQ(answer[last], other ? 0 : sent[last]);
    EXPECT_EQ(link.at_end(), !other);
  }
}

TEST(CapturedFault, UpToTenLostAnswersAreBridged) {
  for (const auto& [name, count] : {std::pair("four_lost_answers", 4), std::pair("ten_lost_answers", 10)}) {
    const Seen seen = replay(
        {.name = name,
         .cycles = 20,
         .script = {
             {.kind = FaultKind::kDropReply, .at = kFaultAt, .count = static_cast<std::uint32_t>(count)}}});
    EXPECT_EQ(reported_after(seen), -1);
    ASSERT_TRUE(seen.losses);
    EXPECT_EQ(seen.losses->cycles, count);
    EXPECT_EQ(seen.losses->lost, count);
    EXPECT_EQ(std::count(seen.modes.begin(), seen.modes.end(), kAllStop), 0) << "the last command stays";
  }
}

TEST(CapturedFault, TwentyLostAnswersSwitchOffUntilItIsEnabledAgain) {
  const Seen seen = replay({.name = "twenty_lost_answers",
                            .cycles = 40,
                            .script = {{.kind = FaultKind::kDropReply, .at = kFaultAt, .count = 20}}});
  EXPECT_NEAR(reported_after(seen), 10, 1);
  EXPECT_EQ(seen.status.back().fault, hal::Fault::kFrameLost);
  EXPECT_EQ(seen.status.back().joint, -1);
  EXPECT_TRUE(contains(seen.explained, "no answer from the bus"));
  expect_latched_and_off(seen);
}

TEST(CapturedFault, LateAnswersAreLostOnes) {
  const Seen seen =
      replay({.name = "late_answers",
              .cycles = 45,
              .script = {{.kind = FaultKind::kDelay, .at = kFaultAt, .count = 20, .delay = 3300us}}});
  EXPECT_NEAR(reported_after(seen), 10, 1);
  EXPECT_EQ(seen.status.back().fault, hal::Fault::kFrameLost);
  ASSERT_TRUE(seen.losses);
  EXPECT_GT(seen.losses->late, 0);
  expect_latched_and_off(seen);
}

TEST(CapturedFault, AHeaderLengthThatDisagreesIsADamagedFrame) {
  // The low byte of the length in the EtherCAT header, behind the Ethernet header.
  const Seen seen = replay(
      {.name = "header_length",
       .cycles = 20,
       .script = {{.kind = FaultKind::kCorrupt, .at = kFaultAt, .count = 3, .offset = 14, .mask = 0x04}}});
  EXPECT_EQ(reported_after(seen), -1);
  ASSERT_TRUE(seen.losses);
  EXPECT_EQ(seen.losses->cycles, 3);
  EXPECT_EQ(seen.losses->damaged, 3) << "bridged, and none of its data taken";
}

TEST(CapturedFault, GarbageInAMailboxIsNoAnswerAndTheDriveStaysOff) {
  const Seen seen = replay({.name = "mailbox_garbage",
                            .cycles = 120,
                            .meddle =
                                [](YoubotBus& bus, int cycle) {
                                  const Bytes garbage(8, 0xA5);
                                  if (cycle >= 5) (void)bus.slave(1).post_mailbox(garbage);
                                },
                            .enabled_again_at = 10});
  EXPECT_NEAR(reported_after(seen), 108, 2) << "0.1 s for an answer";
  EXPECT_EQ(seen.status.back().fault, hal::Fault::kJointFault);
  EXPECT_EQ(seen.status.back().joint, 1);
  EXPECT_TRUE(contains(seen.explained, "the commutation is not known or could not be found"));
  EXPECT_TRUE(says(seen, "wheel-2: could not find its commutation: a mailbox request was refused"));
  EXPECT_EQ(seen.modes.back(), kAllStop);
}

TEST(CapturedFault, ASlaveThatFallsOutOfOperationIsNamed) {
  const Seen seen = replay({.name = "falls_out_of_op", .cycles = 30, .meddle = [](YoubotBus& bus, int cycle) {
                              if (cycle == 5)
                                bus.slave(1).report_error(drivers::ethercat::AlState::kSafeOp, 0x001A);
                            }});
  EXPECT_LE(reported_after(seen), 3);
  EXPECT_EQ(seen.status.back().fault, hal::Fault::kPartialBus);
  EXPECT_EQ(seen.status.back().joint, 1);
  EXPECT_TRUE(says(seen, "slave 3 (TMCM-1632): "));
  expect_latched_and_off(seen);
}

TEST(CapturedFault, FramesOfAnotherMasterStopTheRobotAndNameIt) {
  const Seen seen = replay({.name = "other_master", .cycles = 40, .meddle = [](YoubotBus& bus, int cycle) {
                              if (cycle >= 5)
                                bus.wire().send(frame_of_another_master(
                                    Command::kBrd, drivers::ethercat::address_of(0, reg::kAlStatus)));
                            }});
  EXPECT_GT(reported_after(seen), 3) << "a few may be what a program has left on the wire";
  EXPECT_EQ(seen.status.back().fault, hal::Fault::kOtherMaster);
  EXPECT_TRUE(contains(seen.explained, "01:01:01:01:01:01"));
  expect_latched_and_off(seen);
}

TEST(CapturedFault, AStationAddressThatThisMasterDidNotAssignIsAnotherMasters) {
  const Seen seen = replay(
      {.name = "station_address", .cycles = 40, .meddle = [](YoubotBus& bus, int cycle) {
         if (cycle != 5) return;
         // By a driver below our socket: not seen here.
         BusLink hidden(bus.wire(), &bus);
         hidden.send(frame_of_another_master(
             Command::kApwr,
             drivers::ethercat::address_of(drivers::ethercat::position_address(3), reg::kStationAddress),
             0x0007));
         Bytes answer(drivers::ethercat::kMaxFrameBytes);
         ASSERT_GT(hidden.receive(answer, 1ms), 0U);
       }});
  EXPECT_GE(reported_after(seen), 0);
  EXPECT_TRUE(contains(seen.explained, "it wrote register 0x0010 (station address) of slave 4"));
  expect_latched_and_off(seen);
}

TEST(CapturedFault, ACableOutIsNamedAndBackItWaitsForANewEnable) {
  const Seen seen =
      replay({.name = "cable_out_and_back",
              .cycles = 150,
              .script = {{.kind = FaultKind::kCableOut, .at = kFaultAt, .duration = 40ms, .slave = 3}},
              .enabled_again_at = 120});
  EXPECT_NEAR(reported_after(seen), 10, 2);
  const CycleStatus first = *std::find_if(seen.status.begin(), seen.status.end(),
                                          [](const CycleStatus& status) { return !status.ok(); });
  EXPECT_EQ(first.fault, hal::Fault::kPartialBus);
  EXPECT_EQ(first.joint, 2);
  for (const char* lost : {"slave 4 (TMCM-1632): does not answer", "slave 5 (TMCM-1632): does not answer"})
    EXPECT_TRUE(says(seen, lost));
  EXPECT_FALSE(says(seen, "slave 3 (TMCM-1632): does not answer"));
  EXPECT_FALSE(seen.status[119].ok()) << "latched, though the cable is back";
  EXPECT_TRUE(seen.status.back().ok()) << describe(seen.status.back().fault);
}

TEST(CapturedFault, AFirmwareThatRestartsIsNamedAndStaysOff) {
  const Seen seen =
      replay({.name = "firmware_restart",
              .cycles = 60,
              .script = {{.kind = FaultKind::kSlaveOff, .at = kFaultAt, .duration = 5ms, .slave = 2}}});
  EXPECT_GE(reported_after(seen), 0);
  EXPECT_EQ(seen.status.back().fault, hal::Fault::kPartialBus);
  EXPECT_EQ(seen.status.back().joint, 1);
  expect_latched_and_off(seen);
}

}  // namespace captured_faults_test
}  // namespace hal
