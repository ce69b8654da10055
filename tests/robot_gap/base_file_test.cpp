// Robot files of bases: every digit survives, and what is wrong is reported with its line and its remedy.
#include "runtime/configuration/base_file.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <random>
#include <string>
#include <vector>

#include "identification/robot_gap/base_terms.h"
#include "runtime/configuration/toml_reader.h"
#include "tests/support/temporary_directory.h"

namespace base_file_test {

const std::string kTwoWheels = R"(format = "youbot-robot-model/1"
name = "two-wheeler"
[base]
kinematics = "differential"
track_m = 0.2
[[wheel]]
name = "right"
radius_m = 0.043
position_column = "r"
[[wheel]]
name = "left"
radius_m = 0.042
speed_column = "l"
factor = -0.0625
load_column = "i"
[tracking]
x_column = "x"
y_column = "y"
heading_column = "th"
)";

class BaseFile : public testing::Test {
 protected:
  std::filesystem::path file(const std::string& text) {
    std::ofstream(directory_ / "robot.toml") << text;
    return directory_ / "robot.toml";
  }
  runtime::BaseFile read(const std::string& text) { return runtime::read_base_file(file(text)); }
  /// The text with one part replaced is refused at this line.
  void expect_refused(std::string text, const std::string& part, const std::string& by, int line,
                      const std::string& why) {
    text.replace(text.find(part), part.size(), by);
    try {
      read(text);
      ADD_FAILURE() << "accepted: " << by;
    } catch (const runtime::ConfigError& error) {
      const std::string place = "robot.toml:" + std::to_string(line) + ": ";
      EXPECT_TRUE(std::ranges::any_of(error.problems(),
                                      [&](const std::string& problem) {
                                        return problem.find(place) != std::string::npos &&
                                               problem.find(why) != std::string::npos;
                                      }))
          << error.what() << "\nlacks line " << line << ": " << why;
    }
  }

  support::TemporaryDirectory directory_;
};

TEST_F(BaseFile, TwoWheelsAreLeftAndRightInAnyOrder) {
  const runtime::BaseFile base = read(kTwoWheels);
  ASSERT_EQ(base.base.wheels.size(), 2U);
  EXPECT_EQ(base.base.wheels[0].name, "left");
  EXPECT_EQ(base.base.wheels[0].radius_m, 0.042);
  EXPECT_EQ(base.columns.wheels[0].speed, "l");
  EXPECT_EQ(base.columns.wheels[0].factor, -0.0625);
  EXPECT_EQ(base.columns.wheels[0].load, "i");
  EXPECT_EQ(base.columns.wheels[1].position, "r");
  EXPECT_EQ(base.base.turning_length_m, 0.2);
}

TEST_F(BaseFile, EveryDigitOfAFittedModelIsReadBack) {
  runtime::BaseFile base = read(kTwoWheels);
  base.base.wheels[0].radius_m = 0.1 / 3;
  base.base.turning_length_m = 0.2 / 3;
  base.base.slip_forward = 1.0 / 7;
  base.base.slip_with_load = 1e-7 / 3;
  base.base.floors = {{"brown", 0.1 / 9}};
  base.floor_recordings = {{"brown", "carpet \"2\""}};
  base.base.tracking = {{-0.01 / 3, 1e-3 / 7}, -0.2 / 3, 0.9 / 7};
  base.window_s = 0.7;
  base.columns.mirrored = true;
  base.columns.run = "run";
  const runtime::RobotRemark remark{"brown", "slip: why"};
  const std::string text = runtime::base_file_text(base, {}, {&remark, 1});
  EXPECT_NE(text.find("# slip: why\n[[floor]]"), std::string::npos) << text;
  const runtime::BaseFile again = read(text);
  EXPECT_EQ(again.base.wheels[0].radius_m, base.base.wheels[0].radius_m);
  EXPECT_EQ(again.base.turning_length_m, base.base.turning_length_m);
  EXPECT_EQ(again.base.slip_forward, base.base.slip_forward);
  EXPECT_EQ(again.base.slip_with_load, base.base.slip_with_load);
  EXPECT_EQ(again.base.floors[0].slip, base.base.floors[0].slip);
  EXPECT_EQ(again.floor_recordings, base.floor_recordings);
  EXPECT_EQ(again.base.tracking.p_BT_m, base.base.tracking.p_BT_m);
  EXPECT_EQ(again.base.tracking.yaw_BT_rad, base.base.tracking.yaw_BT_rad);
  EXPECT_EQ(again.base.tracking.scale, base.base.tracking.scale);
  EXPECT_EQ(again.window_s, base.window_s);
  EXPECT_TRUE(again.columns.mirrored);
  EXPECT_EQ(runtime::base_file_text(again, {}, {&remark, 1}), text);
}

const std::string kWeighed = R"(format = "youbot-robot-model/1"
[base]
kinematics = "omni"
radius_m = 0.2
mass_kg = 12
yaw_inertia_kg_m2 = 0.3
centre_m = [0.01, -0.02]
sideways_resistance_N = 1.5
[[wheel]]
name = "a"
radius_m = 0.05
angle_rad = 0
position_column = "a"
torque_column = "ia"
load_column = "ia"
torque_factor = 0.4
coulomb_Nm = 0.02
[[wheel]]
name = "b"
radius_m = 0.05
angle_rad = 2.1
position_column = "b"
torque_column = "ib"
[[wheel]]
name = "c"
radius_m = 0.05
angle_rad = 4.2
position_column = "c"
torque_column = "ic"
[tracking]
x_column = "x"
y_column = "y"
heading_column = "th"
[floor_slope]
x = 0.01
[[floor]]
name = "carpet"
recordings = ["carpet"]
resistance_N = 3
)";

TEST_F(BaseFile, MassAndFrictionAreReadBack) {
  runtime::BaseFile base = read(kWeighed);
  EXPECT_EQ(base.base.body.mass_kg, 12);
  EXPECT_EQ(base.base.body.p_BC_m, Eigen::Vector2d(0.01, -0.02));
  EXPECT_EQ(base.columns.wheels[0].torque, "ia");
  EXPECT_EQ(base.columns.wheels[0].torque_factor, 0.4);
  base.base.body.slope.y() = 0.01 / 3;
  base.base.body.turning_resistance_Nm = 0.1 / 3;
  base.base.wheels[1].viscous_Nm_s_per_rad = 0.01 / 7;
  base.base.wheels[2].torque_scale = 1.0 / 3;
  base.base.wheels[2].offset_Nm = -0.1 / 7;
  base.base.wheels[2].inertia_kg_m2 = 0.01 / 9;
  const std::string text = runtime::base_file_text(base, {}, {});
  const control::BaseDescription again = read(text).base;
  EXPECT_EQ(again.body.mass_kg, base.base.body.mass_kg);
  EXPECT_EQ(again.body.yaw_inertia_kg_m2, base.base.body.yaw_inertia_kg_m2);
  EXPECT_EQ(again.body.p_BC_m, base.base.body.p_BC_m);
  EXPECT_EQ(again.body.slope, base.base.body.slope);
  EXPECT_EQ(again.body.sideways_resistance_N, 1.5);
  EXPECT_EQ(again.body.turning_resistance_Nm, base.base.body.turning_resistance_Nm);
  EXPECT_EQ(again.floors[0].resistance_N, 3);
  EXPECT_EQ(again.wheels[0].coulomb_Nm, 0.02);
  EXPECT_EQ(again.wheels[1].viscous_Nm_s_per_rad, base.base.wheels[1].viscous_Nm_s_per_rad);
  EXPECT_EQ(again.wheels[2].torque_scale, base.base.wheels[2].torque_scale);
  EXPECT_EQ(again.wheels[2].offset_Nm, base.base.wheels[2].offset_Nm);
  EXPECT_EQ(again.wheels[2].inertia_kg_m2, base.base.wheels[2].inertia_kg_m2);
  EXPECT_EQ(runtime::base_file_text(read(text), {}, {}), text);
}

TEST_F(BaseFile, TorquesNeedAMassAndAllWheels) {
  expect_refused(kWeighed, "mass_kg = 12\n", "", 13, "weigh it and write mass_kg");
  expect_refused(kWeighed, "torque_column = \"ib\"\n", "", 9, "'b' has no torque_column");
  expect_refused(kWeighed, "mass_kg = 12", "mass_kg = 0", 5, "mass_kg");
  expect_refused(kWeighed, "coulomb_Nm = 0.02", "coulomb_Nm = -0.02", 17, "coulomb_Nm");
  expect_refused(kWeighed, "torque_factor = 0.4", "torque_factor = 0", 16, "nothing would be read");
  expect_refused(kWeighed, "\"ib\"", "\"ic\"", 9, "each has its own column");
  expect_refused(kWeighed, "x = 0.01\n", "z = 0.01\n", 35, "z");
}

TEST_F(BaseFile, TheTurningLengthOfAMecanumBaseIsHalfOfWheelbasePlusTrackUntilItIsFitted) {
  std::string text = R"(format = "youbot-robot-model/1"
[base]
kinematics = "mecanum"
wheelbase_m = 0.47
track_m = 0.30
[tracking]
x_column = "x"
y_column = "y"
heading_column = "th"
)";
  for (const char* const name : {"fl", "fr", "rl", "rr"})
    text +=
        "[[wheel]]\nname = \"" + std::string(name) + "\"\nradius_m = 0.05\nspeed_column = \"" + name + "\"\n";
  runtime::BaseFile base = read(text);
  EXPECT_DOUBLE_EQ(base.base.turning_length_m, 0.385);
  EXPECT_EQ(runtime::base_file_text(base, {}, {}).find("turning_length_m"), std::string::npos);
  base.base.turning_length_m = 0.4 / 3;
  EXPECT_EQ(read(runtime::base_file_text(base, {}, {})).base.turning_length_m, 0.4 / 3);
}

TEST_F(BaseFile, ARecordingIsOnTheFloorWithTheLongestBeginningOfItsName) {
  const runtime::BaseFile base = read(kTwoWheels + R"([[floor]]
name = "wood"
recordings = ["wood"]
[[floor]]
name = "waxed"
recordings = ["wood_waxed"]
)");
  EXPECT_EQ(base.floor_of("wood_3"), 0);
  EXPECT_EQ(base.floor_of("wood_waxed_3"), 1);
  EXPECT_EQ(base.floor_of("carpet"), -1);
}

TEST_F(BaseFile, DiffersFromAnArmsByItsTables) {
  EXPECT_TRUE(runtime::describes_base(file(kTwoWheels)));
  EXPECT_TRUE(runtime::describes_base(file("format = \"youbot-robot-model/1\"\n[base]\n")));
  EXPECT_FALSE(runtime::describes_base(file("urdf = 'a.urdf'\nbase = 'b'\n")));
}

TEST_F(BaseFile, WhatIsWrongIsReportedWithItsLineAndItsRemedy) {
  expect_refused(kTwoWheels, "\"differential\"", "\"hover\"", 4, "tricycle");
  expect_refused(kTwoWheels, "track_m = 0.2\n", "", 3, "track_m");
  expect_refused(kTwoWheels, "track_m = 0.2\n", "track_m = 0\n", 5, "track_m");
  expect_refused(kTwoWheels, "name = \"right\"", "name = \"front\"", 6,
                 R"(name = "left" and name = "right")");
  expect_refused(kTwoWheels, "position_column = \"r\"", "", 7, "exactly one of them");
  expect_refused(kTwoWheels, "factor = -0.0625", "factor = 0", 14, "nothing would be read");
  expect_refused(kTwoWheels, "x_column = \"x\"", "x_column = \"y\"", 16, "each has its own column");
  expect_refused(kTwoWheels, "heading_column = \"th\"\n", "heading_column = \"th\"\nsacle = 1\n", 20,
                 "sacle");
}

runtime::BaseFile weighed(control::BaseKinematics kinematics) {
  using control::BaseKinematics;
  runtime::BaseFile file;
  file.name = "weighed";
  control::BaseDescription& base = file.base;
  base.kinematics = kinematics;
  base.turning_length_m = 0.2;
  file.wheelbase_m = file.track_m = 0.2;
  base.body.mass_kg = 5;
  base.body.yaw_inertia_kg_m2 = 0.06;
  base.body.slope = {0.9, -0.05};
  base.floors = {{.name = "table", .slip = 0.02}, {.name = "carpet", .slip = 0.05, .resistance_N = 1}};
  file.floor_recordings = {{"table"}, {"carpet"}};
  std::vector<std::string> names{"left", "right"};
  if (kinematics == BaseKinematics::kTricycle) names = {"front"};
  if (kinematics == BaseKinematics::kOmni) names = {"w1", "w2", "w3"};
  if (kinematics == BaseKinematics::kMecanum) names = {"fl", "fr", "rl", "rr"};
  for (const std::string& name : names) {
    base.wheels.push_back({.name = name,
                           .radius_m = 0.05,
                           .angle_rad = 2 * static_cast<double>(base.wheels.size()),
                           .torque_scale = 3,
                           .inertia_kg_m2 = 4e-4,
                           .coulomb_Nm = 0.02,
                           .viscous_Nm_s_per_rad = 0.003});
    file.columns.wheels.push_back({.position = name, .speed = "", .load = "", .torque = name + "_torque"});
  }
  if (kinematics == BaseKinematics::kTricycle) {
    base.steering_offset_rad = -3;
    file.columns.steering = "steering";
  }
  file.columns.x = "x";
  file.columns.y = "y";
  file.columns.heading = "th";
  return file;
}

// A correction of all wheels and one of a single wheel may add up to less than no friction.
TEST_F(BaseFile, WhateverTheSearchFindsIsReadBack) {
  namespace robot_gap = identification::robot_gap;
  std::mt19937 random(1);
  for (const control::BaseKinematics kinematics :
       {control::BaseKinematics::kDifferential, control::BaseKinematics::kTricycle,
        control::BaseKinematics::kOmni, control::BaseKinematics::kMecanum}) {
    const runtime::BaseFile given = weighed(kinematics);
    std::vector<robot_gap::BaseRecording> recordings(2);
    for (int f = 0; f < 2; ++f) {
      recordings[static_cast<std::size_t>(f)].floor = f;
      recordings[static_cast<std::size_t>(f)].load =
          Eigen::MatrixXd::Ones(static_cast<Eigen::Index>(given.base.wheels.size()), 2);
    }
    const robot_gap::BaseCatalogue all = robot_gap::base_catalogue(given.base, recordings, true);
    for (int draw = 0; draw < 40; ++draw) {
      Eigen::VectorXd changes(static_cast<Eigen::Index>(all.terms.size()));
      for (std::size_t k = 0; k < all.terms.size(); ++k) {
        const auto& bounds = all.catalogue.terms[k].change;
        // The first: as small as can be.
        const double by = draw == 0 || random() % 2 == 0 ? bounds.lower : bounds.upper;
        changes[static_cast<Eigen::Index>(k)] = std::isfinite(by) ? by : 0.3 * all.catalogue.terms[k].given;
      }
      runtime::BaseFile found = given;
      found.base = robot_gap::changed(given.base, all, changes);
      const runtime::BaseFile again = read(runtime::base_file_text(found, {}, {}));
      ASSERT_EQ(again.base.wheels.size(), found.base.wheels.size());
      for (std::size_t w = 0; w < found.base.wheels.size(); ++w)
        EXPECT_EQ(again.base.wheels[w].coulomb_Nm, found.base.wheels[w].coulomb_Nm);
    }
  }
}

// A scale of 20 may become 4; one of 0.05 stays positive.
TEST(BaseTerms, BoundsOfATorqueScaleGoWithTheGivenOne) {
  namespace robot_gap = identification::robot_gap;
  for (const double scale : {20.0, 0.05}) {
    control::BaseDescription base = weighed(control::BaseKinematics::kDifferential).base;
    for (control::BaseDescription::Wheel& wheel : base.wheels) wheel.torque_scale = scale;
    const robot_gap::BaseCatalogue all = robot_gap::base_catalogue(base, {}, true);
    int found = 0;
    for (std::size_t k = 0; k < all.terms.size(); ++k) {
      if (all.catalogue.terms[k].name != "torque_scale") continue;
      ++found;
      EXPECT_NEAR(all.catalogue.terms[k].change.lower, -0.8 * scale, 1e-12);
      EXPECT_NEAR(all.terms[k].step, 1e-3 * scale, 1e-12);
    }
    EXPECT_EQ(found, 3);  // of both wheels together, and of each
  }
}

}  // namespace base_file_test
