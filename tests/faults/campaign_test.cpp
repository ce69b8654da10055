// The campaign itself: it is repeatable, it shrinks scripts, and each of its rules can fail.
#include "tests/faults/campaign.h"
#include "runtime/log.h"

#include <gtest/gtest.h>

#include "drivers/tmcl/process_data.h"

#include <algorithm>
#include <cctype>
#include <chrono>
#include <ctime>
#include <fstream>
#include <set>
#include <sstream>

namespace faults {
namespace {

using namespace std::chrono_literals;

/// Between daemon and bus. Each defect is one that a daemon could have.
class DefectiveRobot : public hal::Robot {
 public:
  explicit DefectiveRobot(std::unique_ptr<hal::Robot> robot) : robot_(std::move(robot)) {}
  std::span<const hal::JointInfo> joints() const noexcept override { return robot_->joints(); }
  void activate() override { robot_->activate(); }
  void deactivate() noexcept override { robot_->deactivate(); }
  std::string explain(const hal::CycleStatus& status) const override { return robot_->explain(status); }
  hal::CycleStatus exchange(const hal::RobotCommand& command, hal::RobotSample& sample) noexcept override {
    hal::RobotCommand spoiled = command;
    spoil(spoiled);
    const hal::CycleStatus status = robot_->exchange(spoiled, sample);
    spoil(sample);
    return status;
  }

 protected:
  virtual void spoil(hal::RobotCommand& /*command*/) noexcept {}
  virtual void spoil(hal::RobotSample& /*sample*/) noexcept {}

 private:
  std::unique_ptr<hal::Robot> robot_;
};

template <typename Robot>
Outcome run_with(const std::string& script) {
  return run(parsed_script(script), {.robot = [](std::unique_ptr<hal::Robot> robot) {
               return std::make_unique<Robot>(std::move(robot));
             }});
}

std::string all(const Outcome& outcome) {
  std::string text;
  for (const std::string& violation : outcome.violations) text += violation + '\n';
  return text;
}

void expect_caught(const Outcome& outcome, const std::string& violation) {
  EXPECT_NE(all(outcome).find(violation), std::string::npos)
      << "not '" << violation << "' but: " << all(outcome);
}

struct Campaign : testing::Test {
  Campaign() { spdlog::set_level(spdlog::level::off); }
  Campaign(const Campaign&) = delete;
  Campaign& operator=(const Campaign&) = delete;
  ~Campaign() override { spdlog::set_level(spdlog::level::info); }
};

TEST_F(Campaign, TheSameSeedRepeatsAScriptToTheLastCount) {
  std::set<std::uint64_t> digests;
  for (const std::uint64_t seed : {1U, 2U, 3U, 7U, 10U}) {
    const Script script = drawn_script(seed);
    const Outcome first = run(script);
    const Outcome second = run(parsed_script(text(script)));
    EXPECT_EQ(first.digest, second.digest) << text(script);
    EXPECT_EQ(first.violations, second.violations);
    digests.insert(first.digest);
  }
  EXPECT_EQ(digests.size(), 5U) << "other seeds are other scripts";
}

TEST_F(Campaign, AScriptReadsBackAsItIsWritten) {
  for (std::uint64_t seed = 1; seed <= 200; ++seed) {
    const std::string written = text(drawn_script(seed));
    EXPECT_EQ(text(parsed_script(written)), written);
  }
  EXPECT_THROW((void)parsed_script("base"), std::invalid_argument);
  EXPECT_THROW((void)parsed_script("base/1: cable-out"), std::invalid_argument);
  EXPECT_THROW((void)parsed_script("base/1: ghosts@1+1/0*1"), std::invalid_argument);
}

TEST_F(Campaign, EveryKindIsDrawn) {
  std::set<std::string_view> names;
  for (const Kind& kind : kinds()) names.insert(kind.name);
  EXPECT_EQ(names.size(), kinds().size()) << "two kinds have one name";
  EXPECT_GE(names.size(), 80U);
  std::set<Machine> machines;
  for (std::uint64_t seed = 1; seed <= 5000; ++seed) {
    const Script script = drawn_script(seed);
    machines.insert(script.machine);
    for (const Event& event : script.events) names.erase(event.kind->name);
  }
  EXPECT_TRUE(names.empty()) << *names.begin();
  EXPECT_EQ(machines.size(), 2U);
}

TEST_F(Campaign, ShrinksToWhatIsNeededToFail) {
  const auto fails = [](const Script& script) {
    bool cable = false;
    bool pause = false;
    for (const Event& event : script.events) {
      cable = cable || (event.kind->name == "cable-out" && event.duration >= 40ms);
      pause = pause || event.kind->name == "loop-jitters";
    }
    return cable && pause;
  };
  const Script least =
      shrunk(parsed_script("base/5: hall-sensor@10+20/1*0.50 cable-out@900+640/2*0.30 disabled@950+0/0*0.10 "
                           "loop-jitters@1000+0/0*0.20 brown-out@2000+50/0*0.70"),
             fails);
  EXPECT_EQ(text(least), "base/5: cable-out@900+40/2*1.00 loop-jitters@1000+0/0*1.00");
}

/// Goes on with the last torque when the drives are to be off.
class NeverOff final : public DefectiveRobot {
  using DefectiveRobot::DefectiveRobot;
  void spoil(hal::RobotCommand& command) noexcept override {
    if (command.enable) last_ = command;
    if (last_.enable) command = last_;
  }
  hal::RobotCommand last_;
};

TEST_F(Campaign, ADaemonThatGoesOnAfterItsRunIsCaught) {
  const Outcome outcome = run_with<NeverOff>("base/1: disabled@1000+0/0*0.50");
  EXPECT_NE(all(outcome).find("commanded without an enable"), std::string::npos) << all(outcome);
}

/// Switches off for some cycles and continues.
class OffAndOnAgain final : public DefectiveRobot {
  using DefectiveRobot::DefectiveRobot;
  void spoil(hal::RobotCommand& command) noexcept override {
    if (command.enable && ++cycles_ % 500 > 490) command.enable = false;
  }
  void spoil(hal::RobotSample& sample) noexcept override { sample.enabled = cycles_ > 50; }
  int cycles_ = 0;
};

TEST_F(Campaign, ARunThatSwitchesOffAndOnAgainIsCaught) {
  const Outcome outcome = run_with<OffAndOnAgain>("base/1:");
  EXPECT_NE(all(outcome).find("commanded again in a run that stopped it"), std::string::npos) << all(outcome);
}

/// Reads positions a hundredth too large.
class Misreads final : public DefectiveRobot {
  using DefectiveRobot::DefectiveRobot;
  void spoil(hal::RobotSample& sample) noexcept override {
    for (hal::JointSample& joint : sample.joints) joint.position_rad *= 1.01;
  }
};

TEST_F(Campaign, ARecordingOfWhatDidNotHappenIsCaught) {
  const Outcome outcome = run_with<Misreads>("base/1:");
  EXPECT_NE(all(outcome).find("position_rad was not"), std::string::npos) << all(outcome);
}

/// Its drives never obey.
class NeverEnabled final : public DefectiveRobot {
  using DefectiveRobot::DefectiveRobot;
  void spoil(hal::RobotSample& sample) noexcept override { sample.enabled = false; }
};

TEST_F(Campaign, ARobotThatDoesNotComeBackIsCaught) {
  const Outcome outcome = run_with<NeverEnabled>("base/1:");
  EXPECT_NE(all(outcome).find("does not come to work"), std::string::npos) << all(outcome);
}

/// Commands the first wheel more torque than the limits allow.
class TooStrong final : public DefectiveRobot {
  using DefectiveRobot::DefectiveRobot;
  void spoil(hal::RobotCommand& command) noexcept override {
    if (command.enable && ++cycles_ > 200) command.joints[0] = hal::JointCommand::torque_Nm(2.6);
  }
  int cycles_ = 0;
};

/// Reads twice the torque.
class MisreadsTorque final : public DefectiveRobot {
  using DefectiveRobot::DefectiveRobot;
  void spoil(hal::RobotSample& sample) noexcept override {
    for (hal::JointSample& joint : sample.joints) joint.torque_Nm *= 1.05;
  }
};

/// Sends a little less than it is given.
class LosesTorque final : public DefectiveRobot {
  using DefectiveRobot::DefectiveRobot;
  void spoil(hal::RobotCommand& command) noexcept override {
    for (hal::JointCommand& joint : command.joints) joint.target *= 0.97;
  }
};

TEST_F(Campaign, TorqueAboveTheLimitIsCaught) {
  expect_caught(run_with<TooStrong>("base/1:"), "is commanded 2.");
}

TEST_F(Campaign, ARecordingOfOtherTorquesIsCaught) {
  expect_caught(run_with<MisreadsTorque>("base/1:"), "torque_measured_Nm was not");
  expect_caught(run_with<LosesTorque>("base/1:"), "torque_command_Nm was not");
}

TEST_F(Campaign, SpeedAboveTheLimitIsCaught) {
  const Sabotage fast_base{.period = [](World& world) {
    if (world.enabled()) world.emulation().base().set_twist({1.0, 0, 0});
  }};
  expect_caught(run(parsed_script("base/1:"), fast_base), "the base drives at 1.0");
  const Sabotage fast_wheel{.period = [](World& world) {
    if (world.enabled()) world.emulation().base().wheel(2).set_velocity(15);
  }};
  expect_caught(run(parsed_script("base/1:"), fast_wheel), "wheel 3 turns at 15");
  const Sabotage fast_arm{.period = [](World& world) {
    world.emulation().set_on_ground(false);  // the wheels stand still
    if (world.enabled()) world.emulation().manipulator()->push_tip({0, 200, 0});
  }};
  expect_caught(run(parsed_script("manipulator/1:"), fast_arm), "arm joint");
}

/// Its motors ignore the commands.
class WildPen final : public hal::HapticLink {
 public:
  WildPen(std::unique_ptr<hal::HapticLink> pen, double gain, double push_N)
      : pen_(std::move(pen)), gain_(gain), push_N_(push_N) {}
  const hal::HapticInfo& info() const noexcept override { return pen_->info(); }
  void open() override { pen_->open(); }
  bool close() noexcept override { return pen_->close(); }
  hal::HapticStatus exchange(const hal::HapticCommand& command, std::chrono::nanoseconds now,
                             hal::HapticSample& sample) noexcept override {
    hal::HapticCommand spoiled = command;
    spoiled.enable = true;
    spoiled.f_D_H_N = gain_ * command.f_D_H_N + Eigen::Vector3d(push_N_, 0, 0);
    return pen_->exchange(spoiled, now, sample);
  }

 private:
  std::unique_ptr<hal::HapticLink> pen_;
  double gain_;
  double push_N_;
};

TEST_F(Campaign, AForceOnTheHandThatWasNotAllowedIsCaught) {
  const auto wild = [](double gain, double push_N) {
    return Sabotage{.pen = [gain, push_N](std::unique_ptr<hal::HapticLink> pen) {
      return std::make_unique<WildPen>(std::move(pen), gain, push_N);
    }};
  };
  expect_caught(run(parsed_script("manipulator/1:"), wild(1, 9)), "the hand feels 9.");
  expect_caught(run(parsed_script("manipulator/1:"), wild(1, 0.5)),
                "the hand feels a force without an enable");
}

/// A controller behind which the first board's old process data stay.
Sabotage repeating_controller() {
  return {.period = [](World& world) {
    const drivers::tmcl::DriveOutput output{drivers::tmcl::ControllerMode::kCurrent, 200};
    std::array<std::uint8_t, 5> bytes{};
    (void)drivers::tmcl::pack(output, bytes);
    if (world.enabled()) world.emulation().board(0).outputs_changed(bytes);
  }};
}

TEST_F(Campaign, TorqueThatOutlivesALossIsCaught) {
  expect_caught(run(parsed_script("base/1: all-requests-lost@1500+1000/0*0.50"), repeating_controller()),
                "joint 1 is commanded 115 ms after all-requests-lost");
}

/// A client's words reach the daemon as others.
Sabotage heard(std::string request, std::vector<std::string> others) {
  return {.request = [request, others](const std::string& asked) {
    return asked == request ? others : std::vector<std::string>{asked};
  }};
}

TEST_F(Campaign, OrdersThatDoSomethingElseAreCaught) {
  expect_caught(run(parsed_script("base/1: hall-sensor@1500+300/0*0.50 enabled-again@2000+0/0*1.00"),
                    heard("enable", {"acknowledge", "enable"})),
                "an enable is granted after a fault that was not acknowledged");
  expect_caught(run(parsed_script("base/1: stopped@1500+0/0*0.50"), heard("stop", {"alive"})),
                "is commanded 1500 ms after stopped");
  expect_caught(
      run(parsed_script("base/1: limit-raised@1500+0/0*0.50"), heard("set limits.force_N 1e9", {"status"})),
      "the daemon grants 'set limits.force_N 1e9'");
  expect_caught(run(parsed_script("base/1:"), heard("disable", {"alive"})), "the drives do not go off");
}

TEST_F(Campaign, OrdersOfWhoMayNotCommandAndOrdersThatWaitedAreCaught) {
  expect_caught(
      run(parsed_script("base/1: disabled-without-rights@1500+0/0*0.50"), heard("disable", {"alive"})),
      "the daemon grants 'disable'");
  expect_caught(run(parsed_script("base/1: everything-held-up-while-orders-wait@1500+1500/0*0.50"),
                    heard("enable", {"status"})),
                "the daemon grants 'enable', which waited while it was held up");
}

TEST_F(Campaign, AWallClockThatJumpsIsSeenByTheDaemonAndChangesNothing) {
  const auto before = std::chrono::system_clock::now();
  const std::time_t seconds_before = std::time(nullptr);
  bool jumped = false;
  const Sabotage watching{.period = [&](World&) {
    jumped = jumped || (std::chrono::system_clock::now() - before < -20h &&
                        std::time(nullptr) - seconds_before < -20 * 3600);
  }};
  const Outcome outcome = run(parsed_script("base/1: wall-clock-jumps@1500+0/0*0.00"), watching);
  EXPECT_TRUE(outcome.violations.empty()) << all(outcome);
  EXPECT_TRUE(jumped);
  EXPECT_GE(std::chrono::system_clock::now(), before) << "each script begins at the true time";
}

TEST_F(Campaign, ADaemonThatDoesNotDoItsWorkIsCaught) {
  expect_caught(run(parsed_script("base/1: disabled@3900+0/0*0.50"), heard("enable", {"status"})),
                "no enable works within 2 s");
  expect_caught(run(parsed_script("base/1: daemon-killed@1500+300/0*0.50"),
                    {.period = [](World& world) { world.daemon_held_down = true; }}),
                "the daemon does not start");
  expect_caught(run(parsed_script("base/1:"), {.period =
                                                   [](World& world) {
                                                     sim::Base& base = world.emulation().base();
                                                     base.set_twist(control::PlanarVector::Zero());
                                                   }}),
                "the enabled robot does not drive");
  expect_caught(run(parsed_script("base/1:"), {.period =
                                                   [](World& world) {
                                                     if (world.commander_silent)
                                                       world.loop_paused_until = std::chrono::hours(1);
                                                   }}),
                "the robot does not stop");
  expect_caught(run(parsed_script("base/1:"), {.ignores_its_end = true}), "the daemon does not end");
}

/// Rewrites the lines of the recording of the first run.
template <typename Edit>
Sabotage edited(const char* name, Edit edit) {
  return {.recordings = [name, edit](const std::filesystem::path& folder) {
    const std::filesystem::path file = folder / "run-1" / name;
    std::vector<std::string> lines;
    std::ifstream in(file);
    for (std::string line; std::getline(in, line);) lines.push_back(line);
    edit(lines);
    std::ofstream out(file);
    for (const std::string& line : lines) out << line << '\n';
  }};
}

TEST_F(Campaign, ABadRecordingIsCaught) {
  const Script script = parsed_script("base/1:");
  using Lines = std::vector<std::string>;
  expect_caught(run(script, edited("base.csv", [](Lines& lines) { lines.back().resize(20); })), "is torn");
  expect_caught(run(script, edited("base.csv", [](Lines& lines) { lines.push_back(lines.back()); })),
                "time stands still");
  expect_caught(run(script, edited("base.csv",
                                   [](Lines& lines) {
                                     std::erase_if(lines, [](const std::string& line) {
                                       return std::isdigit(line[0]) != 0;
                                     });
                                   })),
                "no rows");
  expect_caught(run(script, {.recordings =
                                 [](const std::filesystem::path& folder) {
                                   std::filesystem::remove_all(folder / "run-1");
                                 }}),
                "runs have");
  // The tank's level, independent of the column order.
  const auto overdrawn = [](Lines& lines) {
    const auto header =
        std::ranges::find_if(lines, [](const auto& line) { return line.starts_with("time_s"); });
    std::istringstream names(*header);
    std::istringstream values(lines.back());
    std::string row;
    for (std::string name, value; std::getline(names, name, ',') && std::getline(values, value, ',');)
      row += (row.empty() ? "" : ",") + (name == "tank_J" ? "-0.5" : value);
    lines.back() = row;
  };
  expect_caught(run(parsed_script("manipulator/1:"), edited("teleoperation.csv", overdrawn)),
                "tank_J was not -0.5");
}

TEST_F(Campaign, TheLastTorqueAfterALossIsMeasured) {
  const Outcome outcome = run(parsed_script("base/3: brown-out@2000+1000/0*0.50"));
  EXPECT_TRUE(outcome.violations.empty()) << all(outcome);
  ASSERT_TRUE(outcome.last_torque_after);
  EXPECT_LE(*outcome.last_torque_after, 1ms) << "without power";
  EXPECT_NE(outcome.fault.find("no answer from the bus"), std::string::npos) << outcome.fault;
}

}  // namespace
}  // namespace faults
