/// @file
/// A model driven by the torque alone, in short windows that begin in the measured state.
#pragma once
#include <cstddef>
#include <vector>

#include "identification/gap/prediction.h"

namespace identification::gap {

/// A second of one recording.
struct Window {
  std::size_t recording;
  std::size_t first;  ///< sample
  std::size_t length;
};
/// One begins at each row of `use` that no earlier one covers; of many, some, spread evenly.
std::vector<Window> windows_of(const Rows& rows, const std::vector<Eigen::Index>& use);

/// Velocity at each sample of a window [rad/s]. A torque that was measured has passed the actuator already.
std::vector<double> simulated_velocity(const model::effects::DriveModel& model, const Signals& signals,
                                       const Window& window);
/// Its squared error over a window, summed over the samples.
double squared_error(const std::vector<double>& simulated_rad_per_s, const Signals& signals,
                     const Window& window);

}  // namespace identification::gap
