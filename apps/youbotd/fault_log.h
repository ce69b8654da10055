/// @file
/// Selects which faults of a robot are logged.
#pragma once
#include <cstddef>
#include <map>
#include <set>
#include <string>
#include <vector>

namespace youbotd {

/// Called in every beat. A device that lost a few frames is back before a person could check anything, and
/// one that fails to come back repeats the same states: so a fault is logged once it has lasted, and each of
/// its texts once until the device works again.
class FaultLog {
 public:
  static constexpr int kPatience = 4;  ///< beats
  /// Texts logged for one device until it works again: a text that contains a time is new each time.
  static constexpr std::size_t kMaxTexts = 10;

  struct News {
    std::vector<std::string> faults;       ///< current faults of the robot to log
    std::vector<std::string> works_again;  ///< devices logged before
  };
  /// `faults`: hal::Robot::device_faults(), each line "device: what is wrong".
  News update(const std::vector<std::string>& faults);

 private:
  struct Device {
    int beats = 0;
    std::set<std::string> logged;
  };
  std::map<std::string, Device> devices_;  // those with a fault
};

}  // namespace youbotd
