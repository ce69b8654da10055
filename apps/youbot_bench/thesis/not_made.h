/// @file
/// The figures and tables of the thesis that are not on the page, and why.
#pragma once
#include <array>

#include "apps/youbot_bench/thesis/figure.h"

namespace youbot_bench::thesis {

inline constexpr auto kNotMade = std::to_array<NotMade>({
    {"Figure 1", "the omega.6", "a photograph"},
    {"Figure 2", "frame of the base and numbers of the wheels",
     "a photograph; control/link_map.h has the signs"},
    {"Figure 5", "an asperity that deforms and breaks",
     "a drawing of the cause; the laws of figures 4 and 13 have its effect"},
    {"Figure 16", "the robot on its side with a spirit level", "a photograph"},
    {"Figures 21 and 22", "block diagrams for the fit of the LuGre law",
     "drawings; what they compute is in figure 23's fit"},
    {"Figure 26", "bond graph of a motor",
     "a drawing; sim/motor.h has the motor, and no number of it is printed"},
    {"Figure 27", "block diagram of the compensation",
     "a drawing; control/friction_compensator.h, used for figure 28"},
    {"Figure 30", "the compensation in the control model of the base",
     "a drawing; control/base_drive.h, used for section 2.7.2"},
    {"Figure 31", "the ideal haptic teleoperator",
     "a drawing; section 3.2.3 measures how far ours is from it"},
    {"Figure 32", "two-port models", "a drawing; section 3.2.3 measures the two-port"},
    {"Figure 33", "springs between hand, set-point and robot", "a drawing; control/cartesian_stiffness.h"},
    {"Figure 34", "the two ways to run master and slave", "a drawing; docs/two-stations.md"},
    {"Figure 38", "components and connections", "a drawing; docs/architecture.md"},
    {"Chapter 5", "tables of the costs", "no measurement"},
});

}  // namespace youbot_bench::thesis
