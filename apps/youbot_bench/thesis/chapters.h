/// @file
/// The parts of the thesis, each with the figures that are made of it.
#pragma once
#include <string_view>
#include <vector>

#include "apps/youbot_bench/thesis/figure.h"
#include "apps/youbot_bench/thesis/workshop.h"

namespace youbot_bench::thesis {

// Each throws Stopped when the program is asked to end.
std::vector<Figure> specifications(const Workshop& workshop);  ///< chapter 1: tables 1 and 2
std::vector<Figure> theory(const Workshop& workshop);          ///< 2.2 and 2.3: the friction laws
std::vector<Figure> steady_state(const Workshop& workshop);    ///< 2.5.1 and 2.6: friction over velocity
std::vector<Figure> presliding(const Workshop& workshop);      ///< 2.5.2: below break-away
std::vector<Figure> compensation(const Workshop& workshop);    ///< 2.7: friction compensation
std::vector<Figure> haptic_mapping(const Workshop& workshop);  ///< 3.4.2 and 3.4.3: smoothing and workspace
std::vector<Figure> teleoperation(const Workshop& workshop);   ///< 3.2, 3.4.4 and 3.4.5

struct Chapter {
  std::string_view name;  ///< for the command line
  std::vector<Figure> (*make)(const Workshop&);
  int stages;  ///< Workshop::begin() is called this many times
};

}  // namespace youbot_bench::thesis
