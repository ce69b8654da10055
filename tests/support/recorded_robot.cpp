#include "tests/support/recorded_robot.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <stdexcept>
#include <utility>

#include "tests/support/robot_watch.h"

namespace support {
namespace {

using Mode = FollowedDrive::Mode;

/// Drive by drive and row by row.
class DriveRecord {
 public:
  explicit DriveRecord(const Recording& record) : record_(record) {
    for (int i = 1; i <= 4; ++i) add("wheel_", i);
    for (const char* arm : {"arm_", "arm2_"})
      for (int i = 1; i <= 5; ++i) add(arm, i);
    if (columns_.empty()) throw std::runtime_error("a robot's record has drives");
    limits_ = robot_limits(record.has("wheel_1_mode"), record.has("arm2_1_mode")  ? 2
                                                       : record.has("arm_1_mode") ? 1
                                                                                  : 0);
  }

  std::size_t rows() const { return record_.rows(); }
  const std::vector<DriveLimits>& limits() const { return limits_; }
  nanoseconds time(std::size_t row) const { return nanoseconds(std::llround(1e9 * record_["time_s"][row])); }
  std::vector<FollowedDrive> drives(std::size_t row) const {
    std::vector<FollowedDrive> drives;
    for (const Columns& columns : columns_)
      drives.push_back({.mode = mode_of(static_cast<int>((*columns.mode)[row]), columns.wheel),
                        .target = (*columns.target)[row],
                        .homed = is_homed((*columns.encoder_rad)[row], (*columns.position_rad)[row])});
    return drives;
  }

 private:
  struct Columns {
    bool wheel;
    const std::vector<double>* mode;
    const std::vector<double>* target;
    const std::vector<double>* position_rad;
    const std::vector<double>* encoder_rad;
  };
  void add(const std::string& kind, int number) {
    const std::string joint = kind + std::to_string(number);
    if (!record_.has(joint + "_mode")) return;
    columns_.push_back({kind == "wheel_", &record_[joint + "_mode"], &record_[joint + "_target"],
                        &record_[joint + "_position_rad"], &record_[joint + "_encoder_rad"]});
  }
  /// As its header says.
  static Mode mode_of(int number, bool wheel) {
    switch (number) {
      case -1: return Mode::kOpen;
      case 0: return Mode::kStopped;
      case 1: return wheel ? Mode::kHeld : Mode::kPosition;
      case 2: return Mode::kVelocity;
      case 5: return Mode::kPwm;
      case 6: return Mode::kCurrent;
      default: throw std::runtime_error("mode " + std::to_string(number));
    }
  }

  const Recording& record_;
  std::vector<DriveLimits> limits_;
  std::vector<Columns> columns_;
};

bool commanded(const std::vector<FollowedDrive>& drives) {
  return std::ranges::any_of(drives, [](const FollowedDrive& drive) { return drive.mode > Mode::kPosition; });
}

}  // namespace

std::vector<std::string> violations_of_record(const Recording& recording, int enables,
                                              std::size_t still_rows) {
  constexpr int kRest = 2;  // rows between two runs, minimum
  const DriveRecord record(recording);
  if (record.rows() < still_rows) throw std::runtime_error("the robot's record is too short");
  RobotWatch watch(record.limits());
  int resting = kRest;
  for (std::size_t row = 0; row < record.rows(); ++row) {
    const std::vector<FollowedDrive> drives = record.drives(row);
    const bool works = commanded(drives);
    if (works && resting >= kRest) {
      if (--enables < 0) watch.violate("the robot starts to move once more than it was enabled");
      watch.permit();
    }
    resting = works ? 0 : resting + 1;
    watch.look(record.time(row), drives);
    if (works && row + still_rows >= record.rows()) watch.violate("the robot is commanded at its end");
  }
  return watch.violations();
}

}  // namespace support
