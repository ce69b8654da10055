/// @file
/// Adds an effect of relevant size to a drive, and returns its documented parameters.
#pragma once
#include <map>
#include <random>
#include <string>
#include <vector>

#include "tests/gap_second/drive.h"
#include "tests/gap_second/experiment.h"

namespace gap_second {

/// A drive on its rig with all its true data.
struct Subject {
  DriveTruth truth;
  Rig rig;
  bool geared = true;
  bool unsigned_current = false;
  double seconds = 20.0;  ///< of each recording
  /// True values by "effect.parameter", of parameters whose meaning the documents define.
  std::map<std::string, double> parameters;
};

/// A small gearless motor, a geared joint or a large axis, with Coulomb and viscous friction and nothing
/// else.
Subject draw_subject(std::mt19937_64& random);

/// Names of apps/FILE_FORMATS.md.
const std::vector<std::string>& known_effects();
bool belongs_to(const std::string& effect, const Subject& subject);  ///< no backlash without a gear
bool go_together(const std::string& one, const std::string& other);  ///< and can be distinguished
/// @throws std::invalid_argument for an unknown name.
void hide_effect(const std::string& effect, Subject& subject, std::mt19937_64& random);

/// Restores the drive without the effect; no change if it does not have it.
void take_away(const std::string& effect, Subject& subject);

/// Causes outside any library of effects; the right answer is "unexplained".
const std::vector<std::string>& unknown_causes();
void hide_unknown_cause(const std::string& cause, Subject& subject, std::mt19937_64& random);

}  // namespace gap_second
