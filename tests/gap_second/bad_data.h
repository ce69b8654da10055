/// @file
/// What goes wrong with recordings between the drive and the file.
#pragma once
#include <random>
#include <string>
#include <vector>

#include "tests/gap_second/recording.h"

namespace gap_second {

struct BadData {
  std::string name;
  /// A refusal or a diagnosis that has one of these words names the cause. Lower case.
  std::vector<std::string> words;
};

const std::vector<BadData>& kinds_of_bad_data();
/// Of every recording of a rig in the same way, as one sensor and one converter make them.
/// @throws std::invalid_argument for a name that it does not know.
void spoil(const std::string& kind, Recording& recording, std::mt19937_64& random);

}  // namespace gap_second
