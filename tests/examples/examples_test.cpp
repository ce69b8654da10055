// Each example works as its leading comment states, on simulated devices.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <fstream>
#include <iomanip>
#include <numbers>
#include <random>
#include <string>

#include "runtime/configuration/drive_model_file.h"
#include "runtime/recording/recording_reader.h"
#include "tests/support/built_paths.h"
#include "tests/support/run_command.h"
#include "tests/support/temporary_directory.h"

namespace examples_test {

using support::CommandResult;

CommandResult example(const std::string& command) {
  return support::run_command(support::program_dir() + "/examples/" + command);
}

/// The number behind the last occurrence of `text`.
double number_after(const std::string& output, const std::string& text) {
  const std::size_t at = output.rfind(text);
  double number = NAN;
  if (at != std::string::npos) std::sscanf(output.c_str() + at + text.size(), "%lf", &number);
  return number;
}

TEST(Examples, TheStateOfAnyRobotIsReadAndNothingMoves) {
  for (const char* robot : {"loopback", "wire"}) {
    const CommandResult read = example(std::string("read_state ") + robot);
    EXPECT_EQ(read.exit_code, 0) << read.output;
    EXPECT_TRUE(read.said("1.9 s  wheel-1 0.0000 rad")) << read.output;
    EXPECT_TRUE(read.said("wheel-4")) << read.output;
  }
  const CommandResult unknown = example("read_state toaster");
  EXPECT_EQ(unknown.exit_code, 1);
  EXPECT_TRUE(unknown.said("read_state: ")) << unknown.output;
}

TEST(Examples, AWheelThatFrictionHoldsTurnsWithCompensation) {
  const CommandResult push = example("wheel_torque");
  EXPECT_EQ(push.exit_code, 0) << push.output;
  EXPECT_LT(number_after(push.output, "without compensation: wheel-1 turned"), 0.02) << push.output;
  EXPECT_GT(number_after(push.output, "with compensation: wheel-1 turned"), 1) << push.output;
}

TEST(Examples, TheBaseDrivesTheArcOfItsVelocity) {
  const CommandResult drive = example("base_velocity");
  EXPECT_EQ(drive.exit_code, 0) << drive.output;
  // 3.5 s at full speed, with the ramps: a circle of 0.5 m radius, by 0.7 rad.
  EXPECT_NEAR(number_after(drive.output, "yaw"), 0.7, 0.03) << drive.output;
  EXPECT_NEAR(number_after(drive.output, "x"), 0.5 * std::sin(0.7), 0.02) << drive.output;
  EXPECT_NEAR(number_after(drive.output, "  y "), 0.5 * (1 - std::cos(0.7)), 0.02) << drive.output;
}

TEST(Examples, TheSpringGivesWayByForceOverStiffness) {
  const CommandResult spring = example("haptic_spring");
  EXPECT_EQ(spring.exit_code, 0) << spring.output;
  const std::string last = spring.output.substr(spring.output.rfind("4.5 s"));
  EXPECT_NEAR(number_after(last, "s  "), 5, 0.1)
      << "mm: 2 N over 100 N/m and the hand's 300 N/m" << spring.output;
  EXPECT_NEAR(number_after(last, "away"), 0.5, 0.01) << "N" << spring.output;
}

TEST(Examples, TheControllerFollowsAndItsRecordingIsComplete) {
  const support::TemporaryDirectory directory;
  const std::string file = (directory / "sine.csv").string();
  const CommandResult control = example("own_controller loopback " + file);
  EXPECT_EQ(control.exit_code, 0) << control.output;
  EXPECT_LT(number_after(control.output, "furthest from the sine:"), 0.2) << control.output;
  const runtime::ReadRecording read = runtime::read_recording(file);
  EXPECT_TRUE(read.warnings.empty());
  EXPECT_EQ(read.recording.columns.front().values.size(), 4000U);
}

TEST(Examples, TheModelIsThatOfTheWheel) {
  const support::TemporaryDirectory directory;
  const std::string file = (directory / "model.toml").string();
  const CommandResult identify = example("identify_model loopback " + file);
  EXPECT_EQ(identify.exit_code, 0) << identify.output;
  EXPECT_TRUE(identify.said("coulomb torque_Nm: ")) << identify.output;
  EXPECT_LT(number_after(identify.output, "error"), 15)
      << "a Stribeck curve is not the measured one, but near";
  EXPECT_EQ(runtime::read_drive_model(file).name, "wheel-1");
}

/// A drive with a cable that pulls it back to 0.7 rad with 0.02 N·m/rad, and the model of one without. Its
/// Coulomb friction stops it within a step or takes its whole torque; 20 µs steps.
void write_cabled_drive(const support::TemporaryDirectory& directory) {
  std::ofstream(directory / "base.toml")
      << "format = \"youbot-drive-model/1\"\nname = \"cabled\"\n"
         "inertia_kg_m2 = 0.0112\n"
         "[[effect]]\ntype = \"coulomb\"\ntorque_Nm = 0.045\n"
         "[[effect]]\ntype = \"viscous\"\ncoefficient_Nm_s_per_rad = 0.0125\n";
  constexpr double kStep_s = 20e-6;
  constexpr int kStepsOfRow = 100;
  std::mt19937_64 random(5);
  std::normal_distribution<double> noise(0, 0.002);
  for (const double phase : {0.0, 1.0}) {
    std::ofstream file(directory / ("run-" + std::to_string(static_cast<int>(phase)) + ".csv"));
    file << "time_s,torque_command_Nm,torque_measured_Nm,position_rad\n" << std::setprecision(9);
    double position = 0.7;
    double velocity = 0;
    for (int i = 0; i < 20 * 50000; ++i) {
      const double t = i * kStep_s;
      const double torque =
          0.11 * std::sin(0.9 * t + phase) + 0.06 * std::sin(2.9 * t + 2 * phase) + 0.03 * std::sin(9.1 * t);
      if (i % kStepsOfRow == 0)
        file << t << ',' << torque << ',' << torque + noise(random) << ','
             << std::round(position * 106496 / (2 * std::numbers::pi)) * 2 * std::numbers::pi / 106496
             << '\n';
      velocity += kStep_s / 0.0112 * (torque - 0.0125 * velocity - 0.02 * (position - 0.7));
      const double stopped = kStep_s / 0.0112 * 0.045;
      velocity = std::abs(velocity) <= stopped ? 0 : velocity - std::copysign(stopped, velocity);
      position += kStep_s * velocity;
    }
  }
}

TEST(Examples, AnEffectOfOnesOwnIsNamed) {
  const support::TemporaryDirectory directory;
  write_cabled_drive(directory);
  const std::string data =
      " " + directory.path().string() + "/base.toml " + directory.path().string() + "/run-*.csv";
  const CommandResult search = example("custom_effect" + data);
  EXPECT_EQ(search.exit_code, 0) << search.output;
  EXPECT_TRUE(search.said("explained: gap")) << search.output;
  EXPECT_NEAR(number_after(search.output, "+ cable: stiffness_Nm_per_rad"), 0.02, 0.001) << search.output;
  EXPECT_NEAR(number_after(search.output, "rest_position_rad ="), 0.7, 0.1) << search.output;
}

TEST(Examples, TheMissingEffectOfAMeasuredDriveIsNamed) {
  const support::TemporaryDirectory directory;
  const CommandResult convert =
      support::run_command(support::program("convert_recordings") + " " + support::source_dir() +
                           "/tests/data " + directory.path().string());
  ASSERT_EQ(convert.exit_code, 0) << convert.output;
  const std::string drive = (directory / "screw-drive-1").string();
  const CommandResult search =
      example("find_missing_effect " + drive + "/base.toml " + drive + "/data/*.csv");
  EXPECT_EQ(search.exit_code, 0) << search.output;
  EXPECT_TRUE(search.said("+ stribeck: static_torque_Nm 0.003")) << "as published" << search.output;
  EXPECT_LT(number_after(search.output, " -> "), 0.5 * number_after(search.output, "gap ")) << search.output;
}

}  // namespace examples_test
