// Published tables through their column maps, against the conversions in tests/gap/real, which share no code
// with them.
#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <string>

#include "runtime/recording/column_map.h"
#include "runtime/recording/recording_reader.h"
#include "tests/gap/real/converted_drive.h"
#include "tests/support/built_paths.h"

namespace imported_data_test {

using real_recordings::ConvertedDrive;
using real_recordings::ConvertedRecording;

const std::filesystem::path kData = support::source_dir() + "/tests/data";

/// Every converted column is in the imported table, row by row; times up to a common start.
void expect_same(const ConvertedRecording& converted, const std::string& map, const std::string& table) {
  const auto columns = std::make_shared<runtime::ColumnMap>(runtime::read_column_map(kData / map));
  const runtime::ReadRecording imported = runtime::read_recording(kData / table, {.columns = columns});
  EXPECT_EQ(imported.recording.rig, converted.recording.rig);
  EXPECT_EQ(imported.recording.columns.size(), converted.recording.columns.size());
  for (const auto& [name, values] : converted.recording.columns) {
    const auto found = imported.recording.column(name);
    ASSERT_EQ(found.size(), values.size()) << table << " " << name;
    const double start = name == "time_s" ? values.front() : 0;
    for (std::size_t i = 0; i < values.size(); ++i)
      ASSERT_NEAR(found[i], values[i] - start, 1e-9 * std::max(1.0, std::abs(values[i])))
          << table << " " << name << i;
  }
}

const ConvertedRecording& named(const std::vector<ConvertedRecording>& all, const std::string& file) {
  return *std::ranges::find(all, file, &ConvertedRecording::file);
}

TEST(ImportedData, AWheelBehindAGearWithCurrentsOfTheMotor) {
  const ConvertedDrive drive = real_recordings::omni_wheel(kData / "robotino_wheel", 1);
  for (const ConvertedRecording& one : drive.data)
    expect_same(one, "robotino_wheel/columns.toml", "robotino_wheel/" + one.file);
}

TEST(ImportedData, AMotorWithCountsAndCurrents) {
  const ConvertedDrive drive = real_recordings::outrunner(kData / "odrive_cogging");
  for (const ConvertedRecording& one : drive.data)
    expect_same(one, "odrive_cogging/columns.toml", "odrive_cogging/" + one.file);
}

TEST(ImportedData, AServoWhoseFirmwareMakesTheTorque) {
  const ConvertedDrive drive = real_recordings::pendulum_servo(kData / "bam_xl330");
  ASSERT_EQ(drive.held_out.size(), 3U);
  for (const ConvertedRecording& one : drive.held_out)
    expect_same(one, "bam_xl330/columns_kp200.toml", "bam_xl330/xl330_" + one.file);
}

TEST(ImportedData, OneRunOfATableWithMany) {
  const ConvertedDrive drive = real_recordings::screw_drive(kData / "tro2021_screw_drives", 1);
  expect_same(named(drive.data, "forward_100rpm.csv"), "tro2021_screw_drives/columns_100rpm.toml",
              "tro2021_screw_drives/drive1_steady_state.csv");
}

}  // namespace imported_data_test
