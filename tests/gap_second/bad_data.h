/// @file
/// Damage to recordings between the drive and the file.
#pragma once
#include <random>
#include <string>
#include <vector>

#include "tests/gap_second/recording.h"

namespace gap_second {

struct BadData {
  std::string name;
  /// A refusal or a diagnosis with one of these words names the cause. Lower case.
  std::vector<std::string> words;
};

const std::vector<BadData>& kinds_of_bad_data();
/// Applied to every recording of a rig alike, as by one sensor and one converter.
/// @throws std::invalid_argument for an unknown name.
void spoil(const std::string& kind, Recording& recording, std::mt19937_64& random);

}  // namespace gap_second
