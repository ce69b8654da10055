/// @file
/// What of a robot's troubles is worth a line in the log.
#pragma once
#include <cstddef>
#include <map>
#include <set>
#include <string>
#include <vector>

namespace youbotd {

/// Looked at in every beat. A device that lost a few frames is back before anybody could check anything, and
/// one that fails to come back takes the same turns again and again: so a trouble is told once it has lasted,
/// and each of its texts once until the device works again.
class TroubleLog {
 public:
  static constexpr int kPatience = 4;  ///< beats
  /// Texts logged for one device until it works again: a text with a time in it is a new one each time.
  static constexpr std::size_t kMostTexts = 10;

  struct News {
    std::vector<std::string> trouble;      ///< lines of the robot's
    std::vector<std::string> works_again;  ///< devices that were told of
  };
  /// `trouble`: hal::Robot::trouble(), each line "device: what is wrong".
  News update(const std::vector<std::string>& trouble);

 private:
  struct Device {
    int beats = 0;
    std::set<std::string> told;
  };
  std::map<std::string, Device> devices_;  // that are in trouble
};

}  // namespace youbotd
