// [teleoperation] and [scene] of the daemon's configuration: accepted values, rejected values, and that
// teleop.toml states the defaults correctly.
#include <gtest/gtest.h>
#include <spdlog/fmt/fmt.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <map>
#include <numbers>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "operation/config.h"
#include "runtime/configuration/toml_reader.h"
#include "tests/support/built_paths.h"
#include "tests/support/temporary_directory.h"

namespace operation {
namespace teleop_config_test {

namespace fs = std::filesystem;
using control::Teleoperation;
using Values = std::vector<double>;

using Problems = std::vector<std::string>;

const fs::path kTeleop = support::source_dir() + "/apps/youbotd/teleop.toml";

constexpr double kDegree = std::numbers::pi / 180;

enum class Type { kNumber, kInteger, kBoolean };

struct Key {
  std::string name;  ///< "TABLE.KEY" in [teleoperation]
  Values odd;        ///< allowed and not the default, as a file has it
  Values (*read)(const Teleoperation::Config&);
  double unit = 1.0;  ///< of the file, in SI
  Type type = Type::kNumber;

  std::string table() const { return name.substr(0, name.find('.')); }
  std::string key() const { return name.substr(name.find('.') + 1); }
};

double as_number(int value) { return value; }

template <typename Array>
Values all(const Array& numbers) {
  return {numbers.begin(), numbers.end()};
}

const std::vector<Key>& keys() {
  using C = const Teleoperation::Config&;
  using V = Values;
  static const std::vector<Key> kKeys{
      {"start.centring_N_per_m", {55}, [](C c) { return V{c.centring.stiffness_N_per_m}; }},
      {"start.centring_N_s_per_m", {0.7}, [](C c) { return V{c.centring.damping_N_s_per_m}; }},
      {"start.centred_within_m", {0.02}, [](C c) { return V{c.centred_within_m}; }},
      {"start.unfolded_deg", {160, 60, -140, 100, 150}, [](C c) { return all(c.unfolded_rad); }, kDegree},
      {"start.unfolding_rad_per_s", {0.3}, [](C c) { return V{c.unfolding_speed_rad_per_s}; }},
      {"start.unfolded_within_deg", {5}, [](C c) { return V{c.unfolded_within_rad}; }, kDegree},
      {"start.position_m", {0.4, 0.1, 0.3}, [](C c) { return all(c.start_p_WT_m); }},
      {"start.pitch_deg", {118}, [](C c) { return V{c.start_pitch_rad}; }, kDegree},
      {"start.approach_s", {6}, [](C c) { return V{c.approach_s}; }},
      {"start.arrived_within_m", {0.02}, [](C c) { return V{c.arrived_within_m}; }},
      {"start.arrived_within_deg", {4}, [](C c) { return V{c.arrived_within_rad}; }, kDegree},
      {"start.slack_N", {0.2}, [](C c) { return V{c.slack_N}; }},
      {"start.resting_m_per_s", {0.02}, [](C c) { return V{c.resting_speed_m_per_s}; }},
      {"start.feedback_fade_s", {3}, [](C c) { return V{c.feedback_fade_s}; }},
      {"start.centring_timeout_s", {16}, [](C c) { return V{c.centring_timeout_s}; }},
      {"start.unfolding_timeout_s", {31}, [](C c) { return V{c.unfolding_timeout_s}; }},
      {"start.approach_timeout_s", {61}, [](C c) { return V{c.approach_timeout_s}; }},
      {"start.stop_timeout_s", {3}, [](C c) { return V{c.stop_timeout_s}; }},
      {"start.lowering_s", {4}, [](C c) { return V{c.lowering_s}; }},

      {"coupling.soft_N_per_m", {90}, [](C c) { return V{c.soft.translation_N_per_m}; }},
      {"coupling.soft_Nm_per_rad", {9}, [](C c) { return V{c.soft.rotation_Nm_per_rad}; }},
      {"coupling.stiff_N_per_m", {600}, [](C c) { return V{c.stiff.translation_N_per_m}; }},
      {"coupling.stiff_Nm_per_rad", {25}, [](C c) { return V{c.stiff.rotation_Nm_per_rad}; }},
      {"coupling.stiffening_N_per_m_s", {80}, [](C c) { return V{c.stiffening_per_s.translation_N_per_m}; }},
      {"coupling.stiffening_Nm_per_rad_s",
       {4},
       [](C c) { return V{c.stiffening_per_s.rotation_Nm_per_rad}; }},
      {"coupling.damping_ratio", {0.8}, [](C c) { return V{c.robot.spring.damping_ratio}; }},
      {"coupling.force_limit_N", {35}, [](C c) { return V{c.robot.spring.force_limit_N}; }},
      {"coupling.moment_limit_Nm", {5}, [](C c) { return V{c.robot.spring.moment_limit_Nm}; }},
      {"coupling.setpoint_distance_limit_m", {0.5}, [](C c) { return V{c.setpoint_distance_limit_m}; }},
      {"coupling.setpoint_turn_limit_deg", {100}, [](C c) { return V{c.setpoint_turn_limit_rad}; }, kDegree},

      {"mapping.motion_scale", {2}, [](C c) { return V{c.mapping.motion_scale}; }},
      {"mapping.follow_rotation",
       {0},
       [](C c) { return V{as_number(c.mapping.follow_rotation)}; },
       1,
       Type::kBoolean},
      {"mapping.smoothing_m_per_s", {0.2}, [](C c) { return V{c.smoothing.speed_m_per_s}; }},
      {"mapping.smoothing_m_per_s2", {3}, [](C c) { return V{c.smoothing.acceleration_m_per_s2}; }},
      {"mapping.smoothing_m_per_s3", {1000}, [](C c) { return V{c.smoothing.jerk_m_per_s3}; }},
      {"mapping.smoothing_deg_per_s2",
       {300},
       [](C c) { return V{c.smoothing.turn_acceleration_rad_per_s2}; },
       kDegree},
      {"mapping.smoothing_deg_per_s3",
       {1e5},
       [](C c) { return V{c.smoothing.turn_jerk_rad_per_s3}; },
       kDegree},
      {"mapping.smoothing_threshold_m", {1e-3}, [](C c) { return V{c.smoothing.threshold_m}; }},
      {"mapping.smoothing_deg_per_s", {20}, [](C c) { return V{c.smoothing.turn_speed_rad_per_s}; }, kDegree},
      {"mapping.smoothing_threshold_deg",
       {1},
       [](C c) { return V{c.smoothing.turn_threshold_rad}; },
       kDegree},
      {"mapping.rate_m_per_s", {0.2}, [](C c) { return V{c.mapping.rate_speed_m_per_s}; }},
      {"mapping.rest_deflection_m", {0.01}, [](C c) { return V{c.mapping.rest_deflection_m}; }},
      {"mapping.full_deflection_m", {0.1}, [](C c) { return V{c.mapping.full_deflection_m}; }},
      {"mapping.rest_turn_deg", {5}, [](C c) { return V{c.mapping.rest_turn_rad}; }, kDegree},
      {"mapping.full_turn_deg", {40}, [](C c) { return V{c.mapping.full_turn_rad}; }, kDegree},
      {"mapping.rate_turn_deg_per_s", {20}, [](C c) { return V{c.mapping.rate_turn_rad_per_s}; }, kDegree},
      {"mapping.leash_m", {0.02}, [](C c) { return V{c.mapping.leash_m}; }},
      {"mapping.turn_leash_deg", {8}, [](C c) { return V{c.mapping.turn_leash_rad}; }, kDegree},
      {"mapping.boundary_centre_m",
       {-0.05, 0.01, 0.02},
       [](C c) { return all(c.mapping.boundary.centre_H_m); }},
      {"mapping.boundary_half_axes_m",
       {0.2, 0.3, 0.4},
       [](C c) { return all(c.mapping.boundary.half_axes_m); }},
      {"mapping.boundary_least_x_m", {-0.03}, [](C c) { return V{c.mapping.boundary.least_x_m}; }},
      {"mapping.boundary_least_z_m", {-0.05}, [](C c) { return V{c.mapping.boundary.least_z_m}; }},
      {"mapping.rim_N_per_m", {70}, [](C c) { return V{c.mapping.boundary.rim_N_per_m}; }},

      {"feedback.enabled", {0}, [](C c) { return V{as_number(c.force_feedback)}; }, 1, Type::kBoolean},
      {"feedback.force_scale", {5}, [](C c) { return V{c.feedback.force_scale}; }},
      {"feedback.force_limit_N", {6}, [](C c) { return V{c.feedback.force_limit_N}; }},
      {"feedback.contact_share", {0.5}, [](C c) { return V{c.feedback.contact_share}; }},
      {"feedback.passivity", {0}, [](C c) { return V{as_number(c.tank.active)}; }, 1, Type::kBoolean},
      {"feedback.reserve_J", {0.01}, [](C c) { return V{c.tank.reserve_J}; }},
      {"feedback.damping_N_s_per_m", {4}, [](C c) { return V{c.tank.damping_N_s_per_m}; }},
      {"feedback.detect_release", {0}, [](C c) { return V{as_number(c.detect_release)}; }, 1, Type::kBoolean},
      {"feedback.device_mass_kg", {0.2}, [](C c) { return V{c.presence.device_mass_kg}; }},
      {"feedback.device_drag_N_s_per_m", {0.6}, [](C c) { return V{c.presence.device_drag_N_s_per_m}; }},
      {"feedback.telling_force_N", {0.4}, [](C c) { return V{c.presence.telling_force_N}; }},
      {"feedback.released_share", {0.2}, [](C c) { return V{c.presence.released_share}; }},
      {"feedback.released_impulse_N_s", {0.2}, [](C c) { return V{c.presence.released_impulse_N_s}; }},
      {"feedback.felt_hand_N", {0.2}, [](C c) { return V{c.presence.felt_hand_N}; }},
      {"feedback.unfelt_after_s", {0.4}, [](C c) { return V{c.presence.unfelt_after_s}; }},

      {"buttons.gripper", {2}, [](C c) { return V{as_number(c.gripper_button)}; }, 1, Type::kInteger},
      {"buttons.clutch", {-1}, [](C c) { return V{as_number(c.clutch_button)}; }, 1, Type::kInteger},
      {"buttons.gripper_closed_m", {0.005}, [](C c) { return V{c.gripper_closed_m}; }},
      {"buttons.gripper_open_m", {0.015}, [](C c) { return V{c.gripper_open_m}; }},

      {"arm.coulomb_Nm", {0.8, 0.7, 0.6, 0.4, 0.3}, [](C c) { return all(c.robot.arm_friction.coulomb_Nm); }},
      {"arm.viscous_Nm_s_per_rad",
       {0.5, 0.3, 0.2, 0.1, 0.05},
       [](C c) { return all(c.robot.arm_friction.viscous_Nm_s_per_rad); }},
      {"arm.compensation_margin", {0.7}, [](C c) { return V{c.robot.arm_compensator.margin}; }},
      {"arm.setpoint_rad_per_s", {0.5}, [](C c) { return V{c.joint_setpoint.speed}; }},
      {"arm.setpoint_rad_per_s2", {2}, [](C c) { return V{c.joint_setpoint.acceleration}; }},
      {"arm.setpoint_rad_per_s3", {500}, [](C c) { return V{c.joint_setpoint.jerk}; }},
      {"arm.following_error_rad", {0.2}, [](C c) { return V{c.joint_following_error_rad}; }},
      {"arm.full_command_Nm", {0.2}, [](C c) { return V{c.robot.arm_compensator.full_command_Nm}; }},
      {"arm.torque_limit_Nm", {9, 8, 5, 3, 2}, [](C c) { return all(c.robot.arm_torque_limit_Nm); }},
      {"arm.joint_speed_limit_rad_per_s", {2}, [](C c) { return V{c.joint_speed_limit_rad_per_s}; }},
      {"arm.posture_Nm_per_rad", {5}, [](C c) { return V{c.robot.posture_stiffness_Nm_per_rad}; }},
      {"arm.posture_Nm_s_per_rad", {2}, [](C c) { return V{c.robot.posture_damping_Nm_s_per_rad}; }},
      {"arm.posture_limit_Nm", {4}, [](C c) { return V{c.robot.posture_torque_limit_Nm}; }},
      {"arm.payload_kg", {0.2}, [](C c) { return V{c.robot.model.payload_kg}; }},
  };
  return kKeys;
}

/// As a file has it.
std::string text_of(const Key& key, const Values& values) {
  if (key.type == Type::kBoolean) return values[0] != 0 ? "true" : "false";
  if (values.size() == 1) return fmt::format("{}", values[0]);
  return fmt::format("[{}]", fmt::join(values, ", "));
}

std::string line_of(const Key& key, const std::string& value) {
  return "teleoperation." + key.name + " = " + value + "\n";
}

/// Keys in this table of teleop.toml.
std::set<std::string> keys_in_file(const std::string& table) {
  std::ifstream file(kTeleop);
  std::set<std::string> found;
  bool inside = false;
  for (std::string line; std::getline(file, line);) {
    if (line.starts_with("[")) inside = line.starts_with("[teleoperation." + table + "]");
    const std::size_t start = line.starts_with("# ") ? 2 : 0;  // keys without a default are comments
    if (const std::size_t end = line.find(" = "); inside && end != line.npos)
      found.insert(line.substr(start, end - start));
  }
  return found;
}

class TeleopConfig : public testing::Test {
 protected:
  Config load(const std::string& text) const {
    return load_config(directory_.write("lab.toml", text.empty() ? "robot = \"loopback\"\n" : text));
  }

  /// Of a configuration that is wrong, without the directory.
  std::vector<std::string> problems(const std::string& text) const {
    std::vector<std::string> found;
    try {
      (void)load(text);
    } catch (const runtime::ConfigError& error) {
      for (const std::string& problem : error.problems())
        found.push_back(problem.substr(directory_.path().string().size() + 1));
    }
    return found;
  }

  support::TemporaryDirectory directory_;
};

// --- [teleoperation] ---

TEST_F(TeleopConfig, TheFileShowsTheDefaults) {
  // The values in the file and the defaults in the code must be equal.
  const Config shown = load_config(kTeleop);
  for (const Teleoperation::Config& code : {load("").teleoperation, Teleoperation::Config{}})
    for (const Key& key : keys()) {
      const Values file = key.read(shown.teleoperation);
      const Values value = key.read(code);
      ASSERT_EQ(file.size(), value.size()) << key.name;
      for (std::size_t i = 0; i < value.size(); ++i)  // the code has angles in radians, rounded
        EXPECT_NEAR(file[i], value[i], 1e-3 * std::abs(value[i])) << key.name << ", value " << i;
    }
}

TEST_F(TeleopConfig, TheFileHasEveryKeyThereIsAndSoHasThisTest) {
  std::map<std::string, std::set<std::string>> tested;
  for (const Key& key : keys()) tested[key.table()].insert(key.key());
  // In a comment of the file, because it has no default; tested in arm_file_config_test.cpp.
  tested["arm"].insert("robot_file");
  for (const auto& [table, names] : tested) {
    // The answer to an unknown name lists all known ones.
    const Problems mistakes =
        problems("[teleoperation." + table + "]\nxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxx = 1\n");
    ASSERT_EQ(mistakes.size(), 1U);
    const std::string known = fmt::format("known keys are '{}'", fmt::join(names, "', '"));
    EXPECT_TRUE(mistakes[0].ends_with(known)) << mistakes[0] << "\nbut here " << known;
    EXPECT_EQ(keys_in_file(table), names) << table;
  }
  EXPECT_EQ(problems("\n[teleoperation.xxxxxxxxxxxx]\n"),
            Problems{"lab.toml:2: unknown key 'teleoperation.xxxxxxxxxxxx': known keys are 'arm', 'buttons', "
                     "'coupling', 'feedback', 'mapping', 'start'"});
  EXPECT_EQ(tested.size(), 6U);
}

TEST_F(TeleopConfig, EveryKeyArrivesWhereItBelongsAndNowhereElse) {
  const Config defaults = load("");
  for (const Key& key : keys()) {
    const Config odd = load(line_of(key, text_of(key, key.odd)));
    for (const Key& other : keys()) {
      Values expected = other.read(defaults.teleoperation);
      if (other.name == key.name) {
        const Values usual = std::exchange(expected, key.odd);
        for (double& value : expected) value *= key.unit;
        for (std::size_t i = 0; i < usual.size(); ++i) EXPECT_NE(usual[i], expected[i]) << key.name;
      }
      const Values arrived = other.read(odd.teleoperation);
      ASSERT_EQ(arrived.size(), expected.size()) << other.name;
      for (std::size_t i = 0; i < arrived.size(); ++i)
        EXPECT_NEAR(arrived[i], expected[i], 1e-12) << key.name << " in " << other.name << ", value " << i;
    }
  }
}

TEST_F(TeleopConfig, MistakesInAllKeysAreReportedTogetherWithTheirLines) {
  std::string too_large, too_small, other_type;
  for (const Key& key : keys()) {
    const bool number = key.type != Type::kBoolean;
    Values far = key.odd;
    far[0] = 1e9;
    too_large += line_of(key, number ? text_of(key, far) : "1");
    far[0] = -1e9;
    too_small += line_of(key, number ? text_of(key, far) : "-1");
    other_type += line_of(key, number ? "\"1\"" : "\"true\"");
  }
  for (const auto& [text, of_type] : {std::pair(too_large, false), {too_small, false}, {other_type, true}}) {
    const Problems mistakes = problems(text);
    ASSERT_EQ(mistakes.size(), keys().size()) << testing::PrintToString(mistakes);
    for (std::size_t i = 0; i < mistakes.size(); ++i) {
      const Key& key = keys()[i];
      const char* complaint = of_type || key.type == Type::kBoolean ? "' should be " : ", allowed is ";
      EXPECT_TRUE(mistakes[i].starts_with(fmt::format("lab.toml:{}: 'teleoperation.{}", i + 1, key.name)))
          << mistakes[i];
      EXPECT_NE(mistakes[i].find(complaint), std::string::npos) << mistakes[i];
    }
  }
}

TEST_F(TeleopConfig, AWrongKeyIsAnsweredWithTheRightOne) {
  EXPECT_EQ(
      problems("[teleoperation.coupling]\nstiff_N_per_mm = 0.7\n\n[teleoperation.start]\naproach_s = 8\n"),
      (Problems{"lab.toml:2: unknown key 'teleoperation.coupling.stiff_N_per_mm': wrong unit: expected "
                "'stiff_N_per_m'",
                "lab.toml:5: unknown key 'teleoperation.start.aproach_s': did you mean 'approach_s'?"}));
  EXPECT_EQ(problems("teleoperation = true\n"),
            Problems{"lab.toml:1: 'teleoperation' should be a table, found a boolean"});
}

TEST_F(TeleopConfig, ValuesThatContradictOthersAreReportedWithKeyAndRange) {
  EXPECT_EQ(
      problems("[teleoperation.coupling]\nstiff_N_per_m = 50\nstiff_Nm_per_rad = 4\nsoft_Nm_per_rad = 5\n"),
      (Problems{"lab.toml:2: 'teleoperation.coupling.stiff_N_per_m' is 50, allowed is at least "
                "'teleoperation.coupling.soft_N_per_m', which is 100",
                "lab.toml:3: 'teleoperation.coupling.stiff_Nm_per_rad' is 4, allowed is at least "
                "'teleoperation.coupling.soft_Nm_per_rad', which is 5"}));
  // In the robot's description joint 1 turns from 0 to 5.8992 rad, joint 3 from -5.1836 to 0 rad.
  EXPECT_EQ(
      problems("[teleoperation.start]\nunfolded_deg = [359, 65, 10, 102.5, 167.5]\n"),
      (Problems{
          "lab.toml:2: 'teleoperation.start.unfolded_deg' has 10 for joint 3, allowed is -297.0 to 0.0",
          "lab.toml:2: 'teleoperation.start.unfolded_deg' has 359 for joint 1, allowed is 0.0 to 338.0"}));
  EXPECT_EQ(
      problems("\n[teleoperation.start]\nposition_m = [0.9, 0, 0.9]\n"),
      Problems{"lab.toml:3: 'teleoperation.start.position_m' is refused: teleoperation: the arm cannot reach "
               "the start at (0.900000, 0.000000, 0.900000) m with a pitch of 2.094400 rad, 120.000281 deg"});
  EXPECT_EQ(problems("\n[teleoperation.start]\n\npitch_deg = 180\n").front().substr(0, 60),
            "lab.toml:4: 'teleoperation.start.pitch_deg' is refused: tele");
  try {
    (void)operation::load_config(
        directory_.write("set.toml", "[teleoperation.start]\nposition_m = [0.3, 0, 0.3]\n"),
        {{"teleoperation.start.pitch_deg", "180"}});
    FAIL();
  } catch (const runtime::ConfigError& error) {
    EXPECT_EQ(std::string(error.what()).substr(0, 57),
              "set: 'teleoperation.start.pitch_deg' is refused: teleoper");
  }
}

TEST_F(TeleopConfig, OneButtonDoesOneThing) {
  EXPECT_EQ(problems("[teleoperation.buttons]\ngripper = 3\nclutch = 3\n"),
            Problems{"lab.toml:3: 'teleoperation.buttons.clutch' and 'gripper' are the same button"});
  EXPECT_EQ(problems("[teleoperation.buttons]\ngripper = 1\n").size(), 1U) << "the clutch is on 1 as it is";
  EXPECT_EQ(problems("[teleoperation.buttons]\ngripper = -1\nclutch = -1\n"), Problems{}) << "none and none";
}

TEST_F(TeleopConfig, TheMastersOriginIsInsideTheBoundary) {
  for (const char* line : {"boundary_centre_m = [-0.2, 0, 0]", "boundary_half_axes_m = [0.07, 0.1, 0.1]",
                           "boundary_least_x_m = 0.01", "boundary_least_z_m = 0.01"}) {
    const Problems mistakes = problems(std::string("[teleoperation.mapping]\n") + line + "\n");
    ASSERT_EQ(mistakes.size(), 1U) << line;
    EXPECT_NE(mistakes[0].find("leave the handle's origin outside"), std::string::npos) << mistakes[0];
    EXPECT_NE(mistakes[0].find("'teleoperation.mapping.boundary_centre_m'"), std::string::npos)
        << mistakes[0];
  }
}

TEST_F(TeleopConfig, ASpaceMouseGoesFasterTheFurtherItIsPushed) {
  EXPECT_EQ(problems("[teleoperation.mapping]\nrest_deflection_m = 0.05\nfull_deflection_m = 0.05\n"
                     "rest_turn_deg = 40\n"),
            (Problems{"lab.toml:1: 'teleoperation.mapping.full_turn_deg' is not more than "
                      "'teleoperation.mapping.rest_turn_deg'",
                      "lab.toml:3: 'teleoperation.mapping.full_deflection_m' is not more than "
                      "'teleoperation.mapping.rest_deflection_m'"}));
}

TEST_F(TeleopConfig, OneLostFrameIsNotToCountAsALoopThatDidNotRun) {
  const auto with = [](const std::string& frame_timeout_s) {
    return "[loop]\ncommand_timeout_s = 0.05\n[ethercat]\ntolerated_cycles = 1\nframe_timeout_s = " +
           frame_timeout_s + "\n";
  };
  EXPECT_EQ(problems(with("0.0485")),
            Problems{"lab.toml:5: 'ethercat.frame_timeout_s' and two periods are more than "
                     "'loop.command_timeout_s': one lost frame would stop the robot"});
  EXPECT_EQ(problems(with("0.048")), Problems{}) << "more than a period is for slaves that have the time";
}

TEST_F(TeleopConfig, NoSettingWeakensBrakingOrWhatSeesAFault) {
  const auto set = [](const char* key, const char* value) { return load_config(kTeleop, {{key, value}}); };
  for (const auto& [key, weaker, stricter] : std::to_array<std::array<const char*, 3>>(
           {{"controller.damping_N_s_per_m", "0", "200"},  // zero torque would be all the braking there is
            {"controller.turning_damping_Nm_s_per_rad", "0", "30"},
            {"compensation.filter_cutoff_rad_per_s", "5", "130"},  // an overspeed would be seen 0.4 s late
            {"compensation.filter_damping", "3", "0.8"},
            {"teleoperation.feedback.reserve_J", "1", "0.001"},
            {"teleoperation.feedback.telling_force_N", "8", "0.1"},
            {"teleoperation.feedback.released_share", "0.01", "0.5"},
            {"teleoperation.feedback.released_impulse_N_s", "10", "0.05"},
            {"teleoperation.feedback.felt_hand_N", "0.001", "0.2"},
            {"teleoperation.feedback.unfelt_after_s", "10", "0.1"},
            {"teleoperation.start.lowering_s", "0.5", "20"},
            {"teleoperation.start.feedback_fade_s", "0.01", "3"},
            {"teleoperation.start.stop_timeout_s", "60", "1"},
            {"teleoperation.start.unfolding_rad_per_s", "1", "0.2"},
            {"teleoperation.mapping.rate_m_per_s", "1", "0.05"},
            {"teleoperation.mapping.rate_turn_deg_per_s", "90", "5"},
            {"teleoperation.arm.compensation_margin", "1", "0.5"},
            {"teleoperation.arm.full_command_Nm", "0.0001", "0.3"},
            {"teleoperation.arm.coulomb_Nm", "[0.9, 0.9, 0.5, 0.35, 10]", "[0, 0.9, 0.5, 0.35, 0.25]"},
            {"teleoperation.arm.viscous_Nm_s_per_rad", "[10, 0.4, 0.25, 0.15, 0.1]",
             "[0.4, 0.4, 0.25, 0.15, 0]"},
            {"teleoperation.arm.posture_limit_Nm", "20", "2"}})) {
    EXPECT_THROW((void)set(key, weaker), runtime::ConfigError) << key;
    EXPECT_NO_THROW((void)set(key, stricter)) << key;
  }
  EXPECT_THROW((void)set("teleoperation.arm.payload_kg", "0.2"), runtime::ConfigError)
      << "the arm would carry 2 N that are not there";
  // With less damping hand, end effector and posture oscillate, with more their sampled velocity injects
  // energy.
  for (const auto& [key, less, more] : std::to_array<std::array<const char*, 3>>(
           {{"teleoperation.coupling.damping_ratio", "0.6", "0.8"},
            {"teleoperation.arm.posture_Nm_s_per_rad", "1.4", "1.6"},
            {"teleoperation.start.centring_N_s_per_m", "0.4", "0.6"},
            {"teleoperation.feedback.damping_N_s_per_m", "2.9", "3.1"}}))
    for (const char* other : {less, more}) EXPECT_THROW((void)set(key, other), runtime::ConfigError) << key;
  // Release detection uses these two: for a heavier or lighter handle, no motion would look like a free
  // one's.
  for (const char* key :
       {"teleoperation.feedback.device_mass_kg", "teleoperation.feedback.device_drag_N_s_per_m"})
    for (const char* other : {"0.1", "5"}) EXPECT_THROW((void)set(key, other), runtime::ConfigError) << key;
}

TEST_F(TeleopConfig, ASettingReadsNoModelThatOthersCanWrite) {
  const auto file = directory_.write("mine.toml", "robot = \"loopback\"\n");
  const std::string models = R"(["wheel.toml", "wheel.toml", "wheel.toml", "wheel.toml"])";
  const auto set = [&] { return load_config(file, {{"compensation.models", models}}); };
  const auto wheel =
      directory_.write("wheel.toml",
                       "format = \"youbot-drive-model/1\"\nname = \"w\"\ninertia_kg_m2 = 1e-3\n"
                       "[[effect]]\ntype = \"coulomb\"\ntorque_Nm = 0.1\n");
  EXPECT_NO_THROW((void)set());
  using std::filesystem::perms;
  std::filesystem::permissions(wheel, perms::others_write, std::filesystem::perm_options::add);
  EXPECT_THROW((void)set(), runtime::ConfigError);
  std::filesystem::permissions(wheel, perms::others_write, std::filesystem::perm_options::remove);
  if (::geteuid() != 0) GTEST_SKIP() << "only root gives files away";
  ASSERT_EQ(::chown(wheel.c_str(), 65534, 65534), 0);
  EXPECT_THROW((void)set(), runtime::ConfigError);
  (void)directory_.write("mine.toml", "[compensation]\nmodels = " + models + "\n");
  EXPECT_NO_THROW((void)load_config(file)) << "the file itself names whatever it wants";
}

TEST_F(TeleopConfig, ARefusalNamesTheWallAsTheFileHasIt) {
  const auto file = directory_.write("walls.toml", "[workspace]\nbase_x_m = [-0.5, 1]\n");
  try {
    (void)load_config(file, {{"workspace.base_x_m", "[-2, 1]"}});
    FAIL() << "accepted";
  } catch (const runtime::ConfigError& error) {
    EXPECT_EQ(error.problems().front(),
              "set: 'workspace.base_x_m[0]' is -2, and " + file.string() + " allows no less than -0.5");
  }
}

TEST_F(TeleopConfig, OnlyThatTableTeleoperates) {
  EXPECT_TRUE(load_config(kTeleop).teleoperated);
  EXPECT_TRUE(load("[teleoperation]\n").teleoperated);
  EXPECT_FALSE(load("").teleoperated);
  EXPECT_FALSE(load("[haptic]\ndevice = \"falcon\"\n[[scene.table]]\n").teleoperated);
  EXPECT_FALSE(load_config(support::source_dir() + "/apps/youbotd/demo.toml").teleoperated);
}

TEST_F(TeleopConfig, WhatTheRestSaysOfRobotAndMasterHoldsForTeleoperationToo) {
  const Teleoperation::Config read = load(R"(
[loop]
period_s = 0.002
[haptic]
slew_N_per_s = 150
[limits]
force_N = 70
wheel_torque_Nm = 2.1
wheel_speed_rad_per_s = 14
[geometry]
track_m = 0.4
[compensation]
margin = 0.5
[teleoperation.feedback]
device_mass_kg = 0.25
)")
                                         .teleoperation;
  for (const double period_s :
       {read.period_s, read.robot.period_s, read.mapping.period_s, read.smoothing.period_s,
        read.presence.period_s, read.robot.base.observer.filter.period_s})
    EXPECT_EQ(period_s, 0.002);
  EXPECT_EQ(read.tank.force_rate_N_per_s, 150);
  EXPECT_EQ(read.tank.device_mass_kg, 0.25);
  EXPECT_EQ(read.wheel_speed_limit_rad_per_s, 14);
  EXPECT_EQ(read.robot.base.wrench_limits.force_N, 70);
  EXPECT_EQ(read.robot.base.torque_limit_Nm, 2.1);
  EXPECT_EQ(read.robot.base.geometry.track_m, 0.4);
  EXPECT_EQ(read.robot.base.compensator.margin, 0.5);
}

// --- [scene] ---

void expect_surface(const sim::Surface& surface, double stiffness_N_per_m, double loss_s_per_m,
                    double friction) {
  EXPECT_EQ(surface.stiffness_N_per_m, stiffness_N_per_m);
  EXPECT_EQ(surface.loss_s_per_m, loss_s_per_m);
  EXPECT_EQ(surface.friction, friction);
}

TEST_F(TeleopConfig, ASceneIsOfWallsTablesAndABox) {
  const sim::EnvironmentParameters scene = load(R"(
[[scene.wall]]
point_m = [1, 2, 3]
normal = [-1, 0.5, 0.25]
stiffness_N_per_m = 500
loss_s_per_m = 2
friction = 0.6
[[scene.wall]]
point_m = [0, -4, 0]
normal = [0, 1, 0]
[[scene.table]]
centre_m = [0.5, 0.6, 0.1]
size_m = [0.4, 0.8, 0.2]
stiffness_N_per_m = 900
loss_s_per_m = 3
friction = 0.7
[[scene.table]]
[[scene.box]]
centre_m = [0.5, 0.6, 0.25]
size_m = [0.1, 0.2, 0.3]
stiffness_N_per_m = 800
loss_s_per_m = 4
friction = 0.8
mass_kg = 0.75
)")
                                               .robot.scene;
  ASSERT_EQ(scene.walls.size(), 2U);
  EXPECT_EQ(scene.walls[0].p_W_m, Eigen::Vector3d(1, 2, 3));
  EXPECT_EQ(scene.walls[0].normal_W, Eigen::Vector3d(-1, 0.5, 0.25));
  expect_surface(scene.walls[0].surface, 500, 2, 0.6);
  EXPECT_EQ(scene.walls[1].p_W_m, Eigen::Vector3d(0, -4, 0));
  EXPECT_EQ(scene.walls[1].normal_W, Eigen::Vector3d(0, 1, 0));
  const sim::Surface wood;
  expect_surface(scene.walls[1].surface, wood.stiffness_N_per_m, wood.loss_s_per_m, wood.friction);
  ASSERT_EQ(scene.tables.size(), 2U);
  EXPECT_EQ(scene.tables[0].centre_W_m, Eigen::Vector3d(0.5, 0.6, 0.1));
  EXPECT_EQ(scene.tables[0].size_m, Eigen::Vector3d(0.4, 0.8, 0.2));
  expect_surface(scene.tables[0].surface, 900, 3, 0.7);
  ASSERT_TRUE(scene.box.has_value());
  EXPECT_EQ(scene.box->block.centre_W_m, Eigen::Vector3d(0.5, 0.6, 0.25));
  EXPECT_EQ(scene.box->block.size_m, Eigen::Vector3d(0.1, 0.2, 0.3));
  expect_surface(scene.box->block.surface, 800, 4, 0.8);
  EXPECT_EQ(scene.box->mass_kg, 0.75);
}

TEST_F(TeleopConfig, TheFilesSceneIsOneWallInFrontOfTheRobot) {
  const sim::EnvironmentParameters scene = load_config(kTeleop).robot.scene;
  ASSERT_EQ(scene.walls.size(), 1U);
  EXPECT_EQ(scene.walls[0].p_W_m, Eigen::Vector3d(1.08, 0, 0));
  EXPECT_EQ(scene.walls[0].normal_W, Eigen::Vector3d(-1, 0, 0));
  EXPECT_TRUE(scene.tables.empty());
  EXPECT_FALSE(scene.box.has_value());
}

TEST_F(TeleopConfig, WhatNoSceneCanHaveIsRefusedWithItsLine) {
  EXPECT_EQ(problems("[[scene.box]]\nmass_kg = 1\n[[scene.box]]\nsize_m = [0.1, 0.1, 0.1]\nmass_kg = 2\n"),
            Problems{"lab.toml:5: 'scene.box[1].mass_kg' is of a second box: there can be one"});
  EXPECT_EQ(problems("[[scene.wall]]\n[[scene.wall]]\nnormal = [0, 0, 0]\n"),
            Problems{"lab.toml:3: 'scene.wall[1].normal' is zero: it points out of the wall"});
  EXPECT_EQ(problems("[[scene.table]]\nsize_m = [1, 0, 1]\ncentre_m = [1, 2]\n[[scene.box]]\nmass = 1\n"),
            (Problems{"lab.toml:2: 'scene.table[0].size_m[1]' is 0, allowed is 0.001 to 100",
                      "lab.toml:3: 'scene.table[0].centre_m' should have 3 numbers, found 2",
                      "lab.toml:5: unknown key 'scene.box[0].mass': wrong unit: expected 'mass_kg'"}));
  EXPECT_EQ(problems("[scene.wall]\nnormal = [1, 0, 0]\n"),
            Problems{"lab.toml:1: 'scene.wall' should be an array of tables, found a table"});
  EXPECT_EQ(problems("[[scene.floor]]\n"),
            Problems{"lab.toml:1: unknown key 'scene.floor': known keys are 'box', 'table', 'wall'"});
}

TEST_F(TeleopConfig, ASceneHasUpTo64WallsAndTables) {
  const auto bodies = [](int count) {
    std::string text;
    for (int i = 0; i < count; ++i) text += "[[scene.wall]]\n";
    for (int i = 0; i < count; ++i) text += "[[scene.table]]\n";
    return text;
  };
  EXPECT_EQ(problems(bodies(64)), Problems{});
  EXPECT_EQ(problems(bodies(65)), (Problems{"lab.toml:1: 'scene.wall' has 65 elements, allowed are 64",
                                            "lab.toml:66: 'scene.table' has 65 elements, allowed are 64"}));
}

TEST_F(TeleopConfig, TheSimulatedFloorHasASlopeAndUpTo16Patches) {
  const auto patches = [](int count, const std::string& content) {
    std::string text = "[simulation]\nslope = [0.02, -0.01]\n";
    for (int i = 0; i < count; ++i) text += "[[simulation.patch]]\n" + content;
    return text;
  };
  const std::string good = "from_m = [0, 0]\nto_m = [1, 2]\ngrip = 0.5\nresistance = 2\n";
  EXPECT_EQ(problems(patches(16, good)), Problems{});
  EXPECT_EQ(problems(patches(17, good)),
            Problems{"lab.toml:3: 'simulation.patch' has 17 elements, allowed are 16"});
  EXPECT_EQ(problems(patches(1, "from_m = [0, 0]\nto_m = [1, 0]\n")),
            Problems{"lab.toml:5: 'simulation.patch[0].to_m' is not above 'from_m' in x and y"});
}

}  // namespace teleop_config_test
}  // namespace operation
