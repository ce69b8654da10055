// Every fault of the emulated bus, one at a time and many in a row, against the whole stack in virtual time.
// The true motion of the joints comes from the plant, not from the samples.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <optional>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "hal/ethercat_robot.h"
#include "hal/setup_error.h"
#include "sim/bus/bus_link.h"
#include "sim/bus/youbot_bus.h"
#include "tests/support/watched_robot.h"

namespace hal {
namespace fault_survival_test {

using namespace std::chrono_literals;
using drivers::tmcl::Firmware;
using sim::bus::BoardFault;
using sim::bus::FaultEvent;
using sim::bus::FaultKind;
using std::chrono::milliseconds;
using std::chrono::nanoseconds;
using Kind = YoubotKind;

constexpr double kSpeed_rad_per_s = 1.0;
// A drive that receives nothing continues for 100 ms (parameter 90), then returns to its position at that
// time: 60 mrad to stop at 2000 rpm/s of the motor (parameter 11), and back at 10/s. Without power, friction
// takes 5 rad/s² off a lifted wheel.
constexpr nanoseconds kStandstillAfter = 900ms;
constexpr double kStandstill_rad_per_s = 0.03;  // quivering of a velocity loop that holds still
constexpr double kHeld_rad = 0.01;
constexpr double kStoppingDistance_rad = kSpeed_rad_per_s * 0.1 + 0.1;
// A sample is up to two periods old when it is compared with the truth; an encoder step is 60 µrad.
constexpr double kSampleError_rad = 0.005;
constexpr double kFastestSample_rad_per_s = 2 * kSpeed_rad_per_s;  // overshoot, noise, resolution
constexpr nanoseconds kRecovery = 2s;

constexpr std::uint32_t kArmPower = 5;  // place on the bus, behind the base's power board and the wheels
std::size_t joints_of(Kind kind) { return kind == Kind::kBase ? 4 : 9; }
std::uint32_t slaves_of(Kind kind) { return kind == Kind::kBase ? 5 : 11; }
/// -1: power boards have none.
int joint_at(std::uint32_t slave) {
  if (slave == 0 || slave == kArmPower) return -1;
  return static_cast<int>(slave < kArmPower ? slave - 1 : slave - 2);
}
/// Or is treated as if it had: configured from INIT, a drive is not trusted to have kept its memory.
bool takes_power(FaultKind kind) {
  return kind == FaultKind::kSlaveOff || kind == FaultKind::kBrownOut || kind == FaultKind::kForeignWrite;
}

/// A robot on a faulty bus, commanded to turn all joints. Each cycle checks the invariants.
struct Rig {
  Rig(Kind robot_kind, Firmware firmware, std::vector<FaultEvent> faults, int tolerated_cycles = 10)
      : kind(robot_kind),
        emulation(options(robot_kind, firmware, std::move(faults))),
        robot(watch.over(make_ethercat_robot(
            [this]() -> std::unique_ptr<drivers::ethercat::Link> {
              return std::make_unique<sim::bus::BusLink>(emulation.wire(), &emulation);
            },
            {.kind = robot_kind, .tolerated_cycles = tolerated_cycles}, clock, 1ms))) {
    for (std::size_t i = 0; i < joints_of(kind); ++i) {
      // Arm joints stand close to one end of their range: slowly towards its middle.
      speed_rad_per_s[i] = i < 4 ? kSpeed_rad_per_s : i == 6 ? -kSpeed_rad_per_s / 4 : kSpeed_rad_per_s / 4;
      command.joints[i] = JointCommand::velocity_rad_per_s(speed_rad_per_s[i]);
      left_at_rad[i] = true_position_rad(i);
    }
  }

  static sim::bus::YoubotBusOptions options(Kind kind, Firmware firmware, std::vector<FaultEvent> faults) {
    sim::bus::YoubotBusOptions options;
    options.robot = kind == Kind::kBase ? sim::bus::YoubotKind::kBase : sim::bus::YoubotKind::kBaseAndArm;
    options.board.firmware = firmware;
    options.base.on_ground = false;
    options.wire.faults = std::move(faults);
    return options;
  }

  nanoseconds now() { return emulation.wire().now(); }
  bool faults_over() { return emulation.wire().faults().finished(); }
  double true_position_rad(std::size_t joint) { return emulation.position_rad(joint); }
  double true_velocity_rad_per_s(std::size_t joint) {
    return joint < 4 ? emulation.base().wheel(static_cast<int>(joint)).velocity_rad_per_s()
                     : emulation.arm_joint(0, joint - 4).velocity_rad_per_s();
  }
  bool all_move() {
    for (std::size_t i = 0; i < joints_of(kind); ++i)
      if (true_velocity_rad_per_s(i) / speed_rad_per_s[i] < 0.8) return false;
    return true;
  }

  void step() {
    clock.sleep_until(clock.now() + 1ms);
    const nanoseconds due = now() + 1ms;
    const RobotSample before = sample;
    status = robot->exchange(command, sample);
    if (due > now()) emulation.advance(due - now());
    if (complained) return;  // once is enough
    check_motion();
    check_sample(before);
    complained = ::testing::Test::HasFailure();
  }
  template <typename Condition>
  bool run_until(Condition&& condition, nanoseconds limit) {
    for (const nanoseconds end = now() + limit; !condition(); step())
      if (now() >= end) return false;
    return true;
  }
  void run(nanoseconds duration) {
    (void)run_until([] { return false; }, duration);
  }
  void enable() {
    command.enable = true;
    ASSERT_TRUE(run_until([this] { return sample.enabled; }, kRecovery)) << where(0);
  }

  /// Only enabled drives move, or those being enabled, when firmware 2.0 turns for its commutation.
  void check_motion() {
    const bool may_move = command.enable && status.ok();
    if (may_move) moved_until = now();
    const bool stands = now() > moved_until + kStandstillAfter;
    for (std::size_t i = 0; i < joints_of(kind); ++i) {
      const double position_rad = true_position_rad(i);
      if (may_move || (stands && !was_standing)) left_at_rad[i] = position_rad;
      EXPECT_NEAR(position_rad, left_at_rad[i], stands ? kHeld_rad : kStoppingDistance_rad) << where(i);
      if (stands) {
        EXPECT_LT(std::abs(true_velocity_rad_per_s(i)), kStandstill_rad_per_s) << where(i);
      }
    }
    was_standing = stands;
  }

  /// Finite, in order, and true. A counter begins at zero whenever its board gets power.
  void check_sample(const RobotSample& before) {
    EXPECT_GE(sample.stamp, before.stamp);
    if (sample.stamp == before.stamp) return;
    if (!offset_rad || counters_restart) {
      offset_rad.emplace();
      for (std::size_t i = 0; i < joints_of(kind); ++i)
        (*offset_rad)[i] = sample.joints[i].position_rad - true_position_rad(i);
    }
    for (std::size_t i = 0; i < joints_of(kind); ++i) {
      const JointSample& joint = sample.joints[i];
      EXPECT_TRUE(std::isfinite(joint.position_rad) && std::isfinite(joint.velocity_rad_per_s) &&
                  std::isfinite(joint.torque_Nm))
          << where(i);
      if (spoiled) continue;
      EXPECT_NEAR(joint.position_rad - true_position_rad(i), (*offset_rad)[i], kSampleError_rad) << where(i);
      EXPECT_LT(std::abs(joint.velocity_rad_per_s), kFastestSample_rad_per_s) << where(i);
    }
  }
  std::string where(std::size_t joint) {
    return robot->joints()[joint].name + " at " + std::to_string(now() / 1us) +
           " us: " + describe(status.fault) + " at joint " + std::to_string(status.joint);
  }

  Kind kind;
  VirtualClock clock;
  sim::bus::YoubotBus emulation;
  support::BusWatch watch{emulation};
  std::unique_ptr<Robot> robot;
  RobotCommand command;
  RobotSample sample;
  CycleStatus status;
  bool spoiled = false;           // measurements are false
  bool counters_restart = false;  // some have lost their power, and count from zero
  std::array<double, kMaxJoints> speed_rad_per_s{};
  bool complained = false;

 private:
  nanoseconds moved_until = -1s;  // enabled last
  bool was_standing = true;
  std::array<double, kMaxJoints> left_at_rad{};
  std::optional<std::array<double, kMaxJoints>> offset_rad;  // sample - truth
};

/// What must come of a fault.
struct Outcome {
  Fault fault = Fault::kNone;  // kNone: bridged without notice
  int joint = -1;
  JointFault detail = JointFault::kNone;
};
constexpr Outcome kBridged{};
constexpr Outcome kFrameLost{.fault = Fault::kFrameLost};
constexpr Outcome partial(int joint) { return {.fault = Fault::kPartialBus, .joint = joint}; }
constexpr Outcome joint_fault(int joint, JointFault detail) {
  return {.fault = Fault::kJointFault, .joint = joint, .detail = detail};
}

struct Case {
  std::string name;
  FaultEvent event;
  std::vector<Outcome> outcomes;  // any of them
  Kind kind = Kind::kBase;
  Firmware firmware = Firmware::k148;
  bool spoils_samples = false;
};
void PrintTo(const Case& value, std::ostream* out) { *out << value.name; }

bool is(const Outcome& outcome, const CycleStatus& status) {
  return outcome.fault == status.fault && outcome.joint == status.joint &&
         (outcome.fault != Fault::kJointFault || static_cast<std::uint32_t>(outcome.detail) == status.detail);
}

class FaultSurvival : public ::testing::TestWithParam<Case> {};

TEST_P(FaultSurvival, IsBridgedOrStopsTheRobotUntilItIsEnabledAgain) {
  Case test = GetParam();
  constexpr nanoseconds kFaultAt = 800ms;  // commutation is over, with either firmware
  test.event.at = kFaultAt;
  Rig rig(test.kind, test.firmware, {test.event});
  rig.robot->activate();
  rig.enable();
  ASSERT_TRUE(rig.run_until([&] { return rig.now() >= kFaultAt - 1ms; }, 2s));
  ASSERT_TRUE(rig.all_move());

  rig.counters_restart = takes_power(test.event.kind);
  rig.spoiled = test.spoils_samples;
  CycleStatus first;
  int after = 0;
  bool always_enabled = true;
  const auto over_and_noticed = [&] {
    if (first.ok()) first = rig.status;
    always_enabled = always_enabled && rig.sample.enabled;
    // Cycles that are bridged, and those that count a slave as lost; or in which each register is read once.
    return rig.faults_over() && ++after > (test.event.kind == FaultKind::kForeignWrite ? 200 : 30);
  };
  ASSERT_TRUE(rig.run_until(over_and_noticed, test.event.duration + 2s));
  // Counts that a stuck encoder missed are lost for good.
  rig.spoiled = rig.spoiled && test.event.kind == FaultKind::kBoardFault;
  EXPECT_TRUE(std::ranges::any_of(test.outcomes, [&](const Outcome& outcome) { return is(outcome, first); }))
      << describe(first.fault) << " at joint " << int{first.joint} << ", detail " << first.detail;
  EXPECT_EQ(always_enabled, first.ok()) << "a fault that is not reported must not interrupt";

  if (!first.ok()) {
    // Without a change of the enable switch nothing moves, and the first cause stays.
    rig.run(1s);
    EXPECT_EQ(rig.status.fault, first.fault);
    EXPECT_EQ(rig.status.joint, first.joint);
    EXPECT_FALSE(rig.sample.enabled);
    rig.command.enable = false;
    rig.run(5ms);
    EXPECT_TRUE(rig.status.ok()) << "not repaired: " << rig.where(0);
    rig.enable();
    rig.counters_restart = false;
  }
  EXPECT_TRUE(rig.run_until([&] { return rig.all_move(); }, 500ms)) << rig.where(0);
  rig.run(50ms);
  EXPECT_TRUE(rig.status.ok()) << rig.where(0);
}

/// Bursts that are bridged, and bursts that are not.
void add_frame_faults(std::vector<Case>& cases) {
  for (const std::uint32_t count : {1U, 3U, 20U, 200U}) {
    const auto add = [&](const std::string& name, FaultEvent event, const Outcome& outcome) {
      event.count = count;
      cases.push_back({name + " x" + std::to_string(count), event, {outcome}});
    };
    const Outcome lost = count <= 10 ? kBridged : kFrameLost;
    add("request lost", {.kind = FaultKind::kDropRequest}, lost);
    add("reply lost", {.kind = FaultKind::kDropReply}, lost);
    add("late", {.kind = FaultKind::kDelay, .delay = 200us}, kBridged);
    add("too late", {.kind = FaultKind::kDelay, .delay = 700us}, lost);
    add("cycles too late", {.kind = FaultKind::kDelay, .delay = 3300us}, lost);
    add("twice", {.kind = FaultKind::kDuplicate}, kBridged);
    for (const std::int32_t change : {-1, 1}) {
      const std::string name = change < 0 ? "counter too low " : "counter too high ";
      const auto of_datagram = [&](std::uint32_t number) {
        return FaultEvent{.kind = FaultKind::kWrongCounter, .counter_change = change, .datagram = number};
      };
      // In doubt every slave has its own datagram: the first is wheel 1's, the second wheel 2's.
      const auto counted = [count](int joint) { return count <= 10 ? kBridged : partial(joint); };
      add(name + "of the image", of_datagram(0), counted(0));
      add(name + "of the state of all", of_datagram(1), counted(1));
      add(name + "of one slave's state", of_datagram(2), kBridged);
    }
  }
  for (const Kind kind : {Kind::kBase, Kind::kBaseAndArm})
    for (std::uint32_t cable = 0; cable < slaves_of(kind); ++cable)
      for (const std::uint32_t count : {3U, 20U})
        cases.push_back({"damage on cable " + std::to_string(cable) + " x" + std::to_string(count),
                         {.kind = FaultKind::kDamageOnCable, .count = count, .slave = cable},
                         {count <= 10 ? kBridged : kFrameLost},
                         kind});
}

// Places in the base's frame while nothing is wrong: image, state of all, state of one slave. While something
// is, the image is split, and what lies behind the first datagram's header moves.
constexpr std::uint32_t kImage = 16;
constexpr std::uint32_t kImageData = kImage + 10;
constexpr std::uint32_t kImageCounter = kImageData + 4 * (40 + 40);
constexpr std::uint32_t kState = kImageCounter + 2;
constexpr std::uint32_t kSupervision = kState + 10 + 2 + 2;
constexpr std::uint32_t kWheel1 = kImageData + 40;  // behind its outputs
constexpr std::uint32_t kWheel1Flags = kWheel1 + 12;
constexpr std::uint32_t kFrameEnd = kSupervision + 10 + 6 + 2;
constexpr std::uint32_t kLongestEnd = kFrameEnd + 10 + 16 + 2;  // with a register that is read back

/// What the check sequence of a real frame would not let through, and a raw socket on veth does.
void add_spoiled_frames(std::vector<Case>& cases) {
  for (const std::uint32_t size :
       {0U, 1U, 13U, 14U, kImage - 1, kImage, kImage + 9, kImageData, kImageData + 1, kImageCounter,
        kImageCounter + 1, kState, kState + 9, kSupervision - 1, kSupervision, kFrameEnd - 1})
    for (const std::uint32_t count : {3U, 20U})
      cases.push_back({"cut off at " + std::to_string(size) + " x" + std::to_string(count),
                       {.kind = FaultKind::kTruncate, .count = count, .offset = size},
                       {count <= 10 ? kBridged : kFrameLost}});

  const auto add = [&](const std::string& name, std::uint32_t offset, std::uint32_t count,
                       const Outcome& outcome, bool spoils_samples = false) {
    cases.push_back({name + " byte " + std::to_string(offset) + " x" + std::to_string(count),
                     {.kind = FaultKind::kCorrupt, .count = count, .offset = offset},
                     {outcome},
                     Kind::kBase,
                     Firmware::k148,
                     spoils_samples});
  };
  for (const std::uint32_t count : {1U, 20U}) {
    const Outcome lost = count <= 10 ? kBridged : kFrameLost;
    for (const std::uint32_t offset : {0U, 5U}) add("destination address", offset, count, kBridged);
    // From another sender no answer is taken, and when such frames keep coming it is a master.
    for (const std::uint32_t offset : {6U, 11U})
      add("source address", offset, count, count <= 10 ? kBridged : Outcome{.fault = Fault::kOtherMaster});
    for (const std::uint32_t offset : {12U, 13U}) add("EtherType", offset, count, lost);
    for (const std::uint32_t offset : {14U, 15U}) add("EtherCAT header", offset, count, lost);
    for (const std::uint32_t offset : {0U, 1U, 6U, 7U}) add("image header", kImage + offset, count, lost);
    for (const std::uint32_t offset : {0U, 12U}) add("echo of wheel 1", kImageData + offset, count, kBridged);
    for (const std::uint32_t offset : {0U, 3U, 7U, 8U, 11U})
      add("values of wheel 1", kWheel1 + offset, count, kBridged, true);
    // A drive's report is believed at once.
    add("flags of wheel 1", kWheel1Flags, count, joint_fault(0, JointFault::kUndervoltage));
    add("flags of wheel 1", kWheel1Flags + 1, count, joint_fault(0, JointFault::kEmergencyStop));
    add("flags of wheel 1", kWheel1Flags + 2, count, joint_fault(0, JointFault::kCommandTimeout));
  }
  for (std::uint32_t offset = kImageCounter; offset < kLongestEnd; ++offset)
    add("behind the image", offset, 1, kBridged);
}

/// Power, cables and boards, slave by slave.
void add_faults_that_last(std::vector<Case>& cases) {
  const auto text = [](milliseconds duration) { return " for " + std::to_string(duration.count()) + " ms"; };
  for (const Kind kind : {Kind::kBase, Kind::kBaseAndArm}) {
    for (const milliseconds duration : {1ms, 50ms, 1000ms}) {
      for (std::uint32_t slave = 0; slave < slaves_of(kind); ++slave) {
        const std::string number = std::to_string(slave + 1);
        const bool power_board = joint_at(slave) < 0;
        const int first_behind = joint_at(power_board ? slave + 1 : slave);
        const Outcome out_of_reach = slave == 0 ? kFrameLost : partial(first_behind);
        std::vector<Outcome> off{out_of_reach};
        // Drives keep their state when only their power board restarts.
        if (power_board && duration == 1ms) off = {partial(-1), kBridged};
        if (!power_board && duration == 1ms) off = {partial(joint_at(slave))};
        for (const Firmware firmware : {Firmware::k148, Firmware::k200})
          cases.push_back({"slave " + number + " off" + text(duration),
                           {.kind = FaultKind::kSlaveOff, .duration = duration, .slave = slave},
                           off,
                           kind,
                           firmware});
        cases.push_back({"cable " + number + " out" + text(duration),
                         {.kind = FaultKind::kCableOut, .duration = duration, .slave = slave},
                         {duration == 1ms ? kBridged : out_of_reach},
                         kind});
      }
      for (const Firmware firmware : {Firmware::k148, Firmware::k200})
        cases.push_back({"brown-out" + text(duration),
                         {.kind = FaultKind::kBrownOut, .duration = duration},
                         {duration == 1ms ? partial(0) : kFrameLost},
                         kind,
                         firmware});
    }
    for (std::uint32_t slave = 0; slave < slaves_of(kind); ++slave) {
      const std::string name = "slave " + std::to_string(slave + 1);
      // Nothing is asked in operation.
      cases.push_back({name + " mailbox hung",
                       {.kind = FaultKind::kMailboxHung, .duration = 100ms, .slave = slave},
                       {kBridged},
                       kind});
      const int joint = joint_at(slave);
      if (joint < 0) continue;
      const auto add = [&](const char* what, BoardFault fault, const Outcome& outcome) {
        cases.push_back(
            {name + " " + what,
             {.kind = FaultKind::kBoardFault, .duration = 100ms, .slave = slave, .board_fault = fault},
             {outcome},
             kind,
             Firmware::k148,
             fault == BoardFault::kStuckEncoder});
      };
      add("encoder stuck", BoardFault::kStuckEncoder, kBridged);  // no flag of the drive shows it
      add("hall sensor", BoardFault::kHallSensor, joint_fault(joint, JointFault::kHallSensor));
      add("undervoltage", BoardFault::kUndervoltage, joint_fault(joint, JointFault::kUndervoltage));
      add("overvoltage", BoardFault::kOvervoltage, joint_fault(joint, JointFault::kOvervoltage));
      add("overtemperature", BoardFault::kOvertemperature, joint_fault(joint, JointFault::kOvertemperature));
    }
  }
}

/// Registers that the master has configured, written by another one whose frames are not seen.
void add_foreign_writes(std::vector<Case>& cases) {
  for (const Kind kind : {Kind::kBase, Kind::kBaseAndArm})
    for (std::uint32_t slave = 0; slave < slaves_of(kind); ++slave) {
      const int joint = joint_at(slave);
      Outcome outcome{.fault = Fault::kOtherMaster, .joint = joint};
      const auto add = [&](const char* what, std::uint32_t offset, std::uint16_t value, std::uint32_t words) {
        for (const Firmware firmware : {Firmware::k148, Firmware::k200})
          cases.push_back({"slave " + std::to_string(slave + 1) + " gets " + what,
                           {.kind = FaultKind::kForeignWrite,
                            .count = words,
                            .slave = slave,
                            .offset = offset,
                            .value = value},
                           {outcome},
                           kind,
                           firmware});
      };
      add("no address", 0x0010, 0, 1);
      add("a strange address", 0x0010, 0x0777, 1);
      add("the next slave's address", 0x0010,
          static_cast<std::uint16_t>(0x1001 + (slave + 1) % slaves_of(kind)), 1);
      if (joint < 0) continue;
      add("no mapped outputs", 0x0600, 0, 8);
      add("no mapped inputs", 0x0610, 0, 8);
      add("no mapped data", 0x0600, 0, 16);
      add("no watchdog", 0x0420, 0, 1);
      outcome = partial(joint);  // with these the slave leaves operation by itself, and says so
      add("too short a watchdog", 0x0400, 0, 1);
      add("no mailbox", 0x0806, 0, 1);
      add("no sync manager of its outputs", 0x0816, 0, 1);
    }
}

std::vector<Case> all_cases() {
  std::vector<Case> cases;
  add_frame_faults(cases);
  add_spoiled_frames(cases);
  add_faults_that_last(cases);
  add_foreign_writes(cases);
  for (Case& test : cases) {
    test.name = std::string(test.kind == Kind::kBase ? "base " : "base and arm ") +
                (test.firmware == Firmware::k148 ? "148 " : "200 ") + test.name;
    for (char& c : test.name)
      if (std::isalnum(static_cast<unsigned char>(c)) == 0) c = '_';
  }
  return cases;
}
INSTANTIATE_TEST_SUITE_P(Bus, FaultSurvival, ::testing::ValuesIn(all_cases()),
                         [](const auto& parameter) { return parameter.param.name; });

// ---- many in a row ----

/// Everything there is, each `gap` after the end of the one before.
std::vector<FaultEvent> all_in_a_row(Kind kind, nanoseconds at, nanoseconds gap) {
  std::vector<FaultEvent> events;
  for (const Case& test : all_cases()) {
    if (test.kind != kind || test.firmware != Firmware::k148 || test.event.duration > 100ms) continue;
    events.push_back(test.event);
    events.back().at = at;
    // Frames come one a millisecond, or less often while they are late.
    at += gap + test.event.duration +
          milliseconds(test.event.kind <= FaultKind::kDamageOnCable ? 1 : 0) * test.event.count;
  }
  return events;
}

TEST(FaultsInARow, MoveNothingThatWasNeverEnabled) {
  for (const Kind kind : {Kind::kBase, Kind::kBaseAndArm}) {
    Rig rig(kind, Firmware::k200, all_in_a_row(kind, 50ms, 10ms));
    rig.spoiled = true;
    rig.robot->activate();
    EXPECT_TRUE(rig.run_until([&] { return rig.faults_over(); }, 60s));
    rig.spoiled = false;
    rig.counters_restart = true;
    rig.run(kRecovery);
    EXPECT_TRUE(rig.status.ok()) << rig.where(0);
    EXPECT_FALSE(rig.sample.enabled);
    for (std::size_t i = 0; i < joints_of(kind); ++i)
      EXPECT_NEAR(rig.true_position_rad(i),
                  kind == Kind::kBase || i < 4 ? 0.0
                  : i == 6                     ? -0.2
                                               : 0.2,
                  kHeld_rad);
  }
}

/// Random, overlapping faults. The operator disables when a fault is reported and enables when it is gone.
TEST(FaultsInARow, AtRandomAreSurvivedToo) {
  std::mt19937 random(1);
  const auto below = [&](std::size_t limit) { return static_cast<std::size_t>(random() % limit); };
  for (int round = 0; round < 12; ++round) {
    const Kind kind = round % 4 == 3 ? Kind::kBaseAndArm : Kind::kBase;
    std::vector<FaultEvent> events = all_in_a_row(kind, 0s, 0s);
    std::ranges::shuffle(events, random);
    events.resize(30);
    for (FaultEvent& event : events) {
      event.at = 500ms + milliseconds(below(6000));
      event.duration = std::min<nanoseconds>(event.duration, milliseconds(1 + below(100)));
      event.mask = static_cast<std::uint8_t>(1 + below(255));
    }
    Rig rig(kind, round % 2 == 0 ? Firmware::k148 : Firmware::k200, events);
    rig.spoiled = rig.counters_restart = true;
    rig.robot->activate();
    nanoseconds disabled_until{};
    while (!rig.faults_over() && rig.now() < 60s) {
      if (!rig.status.ok() && rig.command.enable) {
        rig.command.enable = false;
        disabled_until = rig.now() + milliseconds(below(300));
      } else if (rig.status.ok() && rig.now() > disabled_until) {
        rig.command.enable = true;
      }
      rig.step();
    }
    ASSERT_TRUE(rig.faults_over());
    rig.command.enable = false;
    rig.run(200ms);  // the last fault is seen, and seen to be over
    EXPECT_TRUE(rig.run_until([&] { return rig.status.ok(); }, kRecovery)) << "round " << round;
    rig.enable();
    EXPECT_TRUE(rig.run_until([&] { return rig.all_move(); }, 500ms)) << "round " << round << rig.where(0);
    rig.spoiled = rig.counters_restart = false;
    rig.run(50ms);
    EXPECT_TRUE(rig.status.ok()) << "round " << round << rig.where(0);
  }
}

// ---- gaps that are bridged, again and again ----

/// The driving base while `fault` comes to every `period`th frame, for two seconds or until a fault.
struct Losses {
  Losses(FaultEvent fault, int period) : rig(Kind::kBase, Firmware::k148, events(fault, period)) {
    rig.robot->activate();
    rig.enable();
    rig.run_until([&] { return rig.now() >= kBegin; }, 2s);
    rig.run_until([&] { return !rig.status.ok(); }, 2s);
    losses = rig.robot->losses().value_or(BusLosses{});
    for (const std::string& line : rig.robot->device_faults())
      warned = warned || line.find("bus: more than 2 % of the last 1000 cycles") == 0;
  }
  static std::vector<FaultEvent> events(FaultEvent fault, int period) {
    std::vector<FaultEvent> events;
    for (int i = 0; i < 2000 / period; ++i) {
      fault.at = kBegin + period * i * 1ms;
      events.push_back(fault);
    }
    return events;
  }
  static constexpr nanoseconds kBegin = 800ms;  // commutation is over
  Rig rig;
  BusLosses losses;
  bool warned = false;
};

TEST(LossBudget, EverySecondAnswerLostIsAFault) {
  Losses test({.kind = FaultKind::kDropReply}, 2);
  EXPECT_EQ(test.rig.status.fault, Fault::kFrameLoss);
  EXPECT_EQ(test.losses.level, BusLosses::Level::kFault);
  EXPECT_GE(test.losses.lost, 200);
  EXPECT_LT(test.rig.now(), Losses::kBegin + 450ms) << "every second of the 200 it takes, two cycles each";
  const std::string words = test.rig.robot->explain(test.rig.status);
  EXPECT_NE(words.find("too many frames were lost"), std::string::npos) << words;
  EXPECT_NE(words.find("ethercat.loss_fault allows 20 %"), std::string::npos) << words;
  // Latched, and refused as long as it was within the last second.
  test.rig.command.enable = false;
  test.rig.run(5ms);
  test.rig.command.enable = true;
  test.rig.run(5ms);
  EXPECT_EQ(test.rig.status.fault, Fault::kFrameLoss);
  EXPECT_FALSE(test.rig.sample.enabled);
}

TEST(LossBudget, SaysHowLongLossesCountAndAfterThatTheRobotCanBeEnabled) {
  std::vector<FaultEvent> events = Losses::events({.kind = FaultKind::kDropReply}, 2);
  events.resize(220);
  Rig lossy(Kind::kBase, Firmware::k148, std::move(events));
  lossy.robot->activate();
  lossy.enable();
  lossy.run_until([&] { return !lossy.status.ok(); }, 5s);
  ASSERT_EQ(lossy.status.fault, Fault::kFrameLoss);
  const std::string words = lossy.robot->explain(lossy.status);
  EXPECT_NE(words.find("losses count for 1 s, and until then an enable is refused"), std::string::npos)
      << words;
  lossy.command.enable = false;
  lossy.run(1000ms);
  lossy.command.enable = true;
  lossy.run_until([&] { return lossy.sample.enabled || !lossy.status.ok(); }, 2s);
  EXPECT_TRUE(lossy.sample.enabled) << lossy.robot->explain(lossy.status);
}

TEST(LossBudget, AnswersThatOvertakeEachOtherAreAFaultAndCountedAsLate) {
  Losses test({.kind = FaultKind::kDelay, .delay = 1200us}, 2);
  EXPECT_EQ(test.rig.status.fault, Fault::kFrameLoss);
  EXPECT_GE(test.losses.late, 150);
}

TEST(LossBudget, OneInTwentyIsAWarningWithItsKindAndGoesOn) {
  for (const FaultEvent& fault :
       {FaultEvent{.kind = FaultKind::kDropRequest}, FaultEvent{.kind = FaultKind::kTruncate, .offset = 20},
        FaultEvent{.kind = FaultKind::kWrongCounter, .counter_change = -1}}) {
    Losses test(fault, 20);
    EXPECT_TRUE(test.rig.status.ok()) << test.rig.where(0);
    EXPECT_TRUE(test.rig.sample.enabled);
    EXPECT_TRUE(test.warned);
    EXPECT_EQ(test.losses.level, BusLosses::Level::kWarning);
    EXPECT_NEAR(test.losses.cycles, 50, 2);
    EXPECT_NEAR(test.losses.damaged, fault.kind == FaultKind::kTruncate ? 50 : 0, 2);
    EXPECT_NEAR(test.losses.incomplete, fault.kind == FaultKind::kWrongCounter ? 50 : 0, 2);
  }
}

TEST(LossBudget, OneBridgeIsNothingToWarnOf) {
  Losses test({.kind = FaultKind::kDropReply, .count = 10}, 2000);
  EXPECT_TRUE(test.rig.status.ok());
  EXPECT_TRUE(test.rig.sample.enabled);
  EXPECT_FALSE(test.warned);
  EXPECT_EQ(test.losses.level, BusLosses::Level::kOk);
}

// Otherwise a robot that was without power for a second could not be enabled for the next one.
TEST(LossBudget, AGapThatWasAFaultOfItsOwnIsNotCountedAgain) {
  Losses test({.kind = FaultKind::kBrownOut, .duration = 500ms}, 2000);
  EXPECT_EQ(test.rig.status.fault, Fault::kFrameLost);
  test.rig.run(200ms);
  EXPECT_EQ(test.rig.robot->losses()->level, BusLosses::Level::kFault) << "while it lasts";
  EXPECT_GE(test.rig.robot->losses()->cycles, 150);
  test.rig.counters_restart = true;
  test.rig.run(600ms);
  test.rig.command.enable = false;
  test.rig.run_until([&] { return test.rig.status.ok(); }, kRecovery);
  EXPECT_LE(test.rig.robot->losses()->cycles, 10);
  EXPECT_EQ(test.rig.robot->losses()->level, BusLosses::Level::kOk);
}

// ---- during start-up ----

/// A frame that is lost, late or damaged is asked for again, three times in a row too. A wrong counter may
/// end the start-up, with a reason; the next start succeeds.
TEST(FaultsDuringStartUp, AnyFrameMayBeSpoiled) {
  for (std::uint64_t frame = 0; frame < 320; frame += frame < 20 ? 1 : 17) {
    for (FaultEvent event :
         {FaultEvent{.kind = FaultKind::kDropRequest}, FaultEvent{.kind = FaultKind::kDropReply},
          FaultEvent{.kind = FaultKind::kDelay, .delay = 3ms}, FaultEvent{.kind = FaultKind::kDuplicate},
          FaultEvent{.kind = FaultKind::kTruncate, .offset = 20},
          FaultEvent{.kind = FaultKind::kCorrupt, .offset = 17},
          FaultEvent{.kind = FaultKind::kDamageOnCable, .slave = 3},
          FaultEvent{.kind = FaultKind::kDropReply, .count = 3},
          FaultEvent{.kind = FaultKind::kWrongCounter}}) {
      event.at_frame = frame;
      Rig rig(Kind::kBase, Firmware::k148, {event});
      const bool must_start = event.kind != FaultKind::kWrongCounter;
      try {
        rig.robot->activate();
      } catch (const SetupError& error) {
        EXPECT_FALSE(must_start) << "frame " << frame << ", fault " << static_cast<int>(event.kind) << ": "
                                 << error.what();
        EXPECT_TRUE(rig.faults_over()) << error.what();
        EXPECT_NO_THROW(rig.robot->activate());
      }
      rig.run(5ms);
      EXPECT_TRUE(rig.status.ok()) << rig.where(0);
    }
  }
}

struct StartUpCase {
  const char* name;
  FaultEvent event;
  const char* complaint;  // empty: it starts all the same
};
void PrintTo(const StartUpCase& value, std::ostream* out) { *out << value.name; }
class StartUpFaults : public ::testing::TestWithParam<StartUpCase> {};

TEST_P(StartUpFaults, AreNamedAndTheNextStartSucceeds) {
  const StartUpCase& test = GetParam();
  Rig rig(Kind::kBase, Firmware::k148, {test.event});
  std::string complaint;
  try {
    rig.robot->activate();
  } catch (const SetupError& error) {
    complaint = error.what();
  }
  EXPECT_EQ(complaint.empty(), *test.complaint == '\0') << complaint;
  EXPECT_NE(complaint.find(test.complaint), std::string::npos) << complaint;
  if (!complaint.empty()) {
    if (!rig.faults_over()) rig.emulation.advance(1s);
    rig.robot->activate();
  }
  rig.enable();
  EXPECT_TRUE(rig.run_until([&] { return rig.all_move(); }, 500ms)) << rig.where(0);
}
INSTANTIATE_TEST_SUITE_P(
    Bus, StartUpFaults,
    ::testing::Values(
        StartUpCase{"a_slave_off",
                    {.kind = FaultKind::kSlaveOff, .duration = 300ms, .slave = 3},
                    "slave 4, wheel 3 (rear-left): check the bus: missing"},
        StartUpCase{"a_cable_out",
                    {.kind = FaultKind::kCableOut, .duration = 300ms, .slave = 3},
                    "check the cable from slave 3 (TMCM-1632), port 1"},
        StartUpCase{"no_power", {.kind = FaultKind::kBrownOut, .duration = 1500ms}, "no frame comes back"},
        StartUpCase{"no_power_for_a_moment", {.kind = FaultKind::kBrownOut, .duration = 300ms}, ""},
        StartUpCase{"power_lost_while_scanned",
                    {.kind = FaultKind::kSlaveOff, .at = 500us, .duration = 300ms, .slave = 3},
                    "slave 4"},
        StartUpCase{"power_lost_in_pre_op",
                    {.kind = FaultKind::kSlaveOff, .at = 2ms, .duration = 300ms, .slave = 3},
                    "slave 4"},
        StartUpCase{"a_mailbox_hung_for_a_while",
                    {.kind = FaultKind::kMailboxHung, .duration = 300ms, .slave = 2},
                    ""}),
    [](const auto& parameter) { return std::string(parameter.param.name); });

/// Faults while drives are being prepared: reported with the joint, and gone with the next enable.
TEST(FaultsWhileEnabling, AreReportedAndTheNextEnableSucceeds) {
  for (const Firmware firmware : {Firmware::k148, Firmware::k200})
    for (const nanoseconds at : {21ms, 50ms, 150ms})
      for (const FaultEvent& fault :
           {FaultEvent{.kind = FaultKind::kSlaveOff, .duration = 100ms, .slave = 3},
            FaultEvent{.kind = FaultKind::kCableOut, .duration = 100ms, .slave = 3},
            FaultEvent{.kind = FaultKind::kBrownOut, .duration = 100ms},
            FaultEvent{.kind = FaultKind::kDropReply, .count = 30},
            FaultEvent{.kind = FaultKind::kMailboxHung, .duration = 500ms, .slave = 3},
            FaultEvent{.kind = FaultKind::kBoardFault, .duration = 100ms, .slave = 3}}) {
        FaultEvent event = fault;
        event.at = at;
        event.board_fault = BoardFault::kHallSensor;
        Rig rig(Kind::kBase, firmware, {event});
        rig.counters_restart = true;
        rig.robot->activate();
        rig.run(20ms - rig.now());
        rig.command.enable = true;
        rig.run_until([&] { return rig.faults_over(); }, 2s);
        rig.run(1s);
        if (!rig.status.ok()) {
          EXPECT_TRUE(rig.status.fault == Fault::kFrameLost || rig.status.joint == 2) << rig.where(2);
          rig.command.enable = false;
          rig.run(10ms);
          EXPECT_TRUE(rig.status.ok()) << rig.where(2);
        } else {
          EXPECT_TRUE(rig.sample.enabled) << "neither enabled nor a reason reported: " << rig.where(2);
        }
        rig.enable();
        EXPECT_TRUE(rig.run_until([&] { return rig.all_move(); }, 500ms)) << rig.where(2);
      }
}

/// A short loss of power cannot be bridged: the drive has lost its position and its state.
TEST(FaultSurvivalOfPower, ADriveThatLostItsPowerStopsTheRobotHoweverQuicklyItIsBack) {
  for (const nanoseconds duration : {1ms, 20ms}) {
    Rig rig(Kind::kBase, Firmware::k148,
            {{.kind = FaultKind::kSlaveOff, .at = 800ms, .duration = duration, .slave = 3}}, 90);
    rig.counters_restart = true;
    rig.robot->activate();
    rig.enable();
    rig.run_until([&] { return rig.now() > 1500ms; }, 2s);
    EXPECT_EQ(rig.status.fault, Fault::kPartialBus);
    EXPECT_EQ(rig.status.joint, 2);
    EXPECT_FALSE(rig.sample.enabled) << "it moves again without a new enable";
  }
}

TEST(FaultSurvivalOfPower, PositionsGoOnWhereTheyWereAfterALossOfPower) {
  Rig rig(Kind::kBase, Firmware::k148,
          {{.kind = FaultKind::kSlaveOff, .at = 2s, .duration = 50ms, .slave = 3}});
  rig.spoiled = true;  // what it moved unseen is not in the samples
  rig.robot->activate();
  rig.enable();
  rig.run_until([&] { return !rig.status.ok(); }, 3s);
  const double before_rad = rig.sample.joints[2].position_rad;
  ASSERT_GT(before_rad, 1.0);
  rig.run(1s);
  EXPECT_NEAR(rig.sample.joints[2].position_rad, before_rad, kStoppingDistance_rad);
}

TEST(FaultsWhileEnabling, AnUnfitDriveIsReportedByItsDefectWhenEnabled) {
  Rig rig(Kind::kBase, Firmware::k148, {});
  rig.robot->activate();
  rig.run(10ms);
  rig.emulation.slave(1).set_fault(BoardFault::kOvertemperature, true);
  rig.run(10ms);
  rig.command.enable = true;
  rig.run_until([&] { return !rig.status.ok(); }, 2s);
  EXPECT_TRUE(is(joint_fault(1, JointFault::kOvertemperature), rig.status)) << rig.where(1);
}

}  // namespace fault_survival_test
}  // namespace hal
