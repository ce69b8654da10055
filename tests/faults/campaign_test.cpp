// The campaign itself: that it repeats, that it shrinks, and that each of its rules can fail.
#include "tests/faults/campaign.h"

#include <gtest/gtest.h>
#include <spdlog/spdlog.h>

#include <set>

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
  return run(parsed_script(script),
             [](std::unique_ptr<hal::Robot> robot) { return std::make_unique<Robot>(std::move(robot)); });
}

std::string all(const Outcome& outcome) {
  std::string text;
  for (const std::string& violation : outcome.violations) text += violation + '\n';
  return text;
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

/// Switches off for some cycles and goes on.
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
  EXPECT_NE(all(outcome).find("was not at"), std::string::npos) << all(outcome);
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

TEST_F(Campaign, TheLastTorqueAfterALossIsMeasured) {
  const Outcome outcome = run(parsed_script("base/3: brown-out@2000+1000/0*0.50"));
  EXPECT_TRUE(outcome.violations.empty()) << all(outcome);
  ASSERT_TRUE(outcome.last_torque_after);
  EXPECT_LE(*outcome.last_torque_after, 1ms) << "without power";
  EXPECT_NE(outcome.fault.find("no answer from the bus"), std::string::npos) << outcome.fault;
}

}  // namespace
}  // namespace faults
