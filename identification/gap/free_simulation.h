/// @file
/// A model driven by the torque alone, in short windows that begin in the measured state.
#pragma once
#include <cstddef>
#include <optional>
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

/// One model on one recording. A window begins with what the recording before it implies: where behind a gap
/// or a spring the load was, how fast it moved against the motor, and how far the friction contact had given.
/// A bristle that has to bend first is slack, like a gap.
class FreeSimulation {
 public:
  /// `signals` have to live as long.
  FreeSimulation(const model::effects::DriveModel& model, const Signals& signals);
  /// Velocity at each sample of a window [rad/s]. A torque that was measured has passed the actuator already.
  std::vector<double> velocity(const Window& window) const;

 private:
  model::effects::DriveModel model_;
  const Signals& signals_;
  std::optional<LoadSide> load_;
  std::vector<double> deflection_rad_;  // of the friction contact; empty where the model has no presliding
};
/// Its squared error over a window, summed over the samples.
double squared_error(const std::vector<double>& simulated_rad_per_s, const Signals& signals,
                     const Window& window);
/// The same of each window; infinite where the simulation is.
std::vector<double> squared_errors(const model::effects::DriveModel& model, const Rows& rows,
                                   const std::vector<Window>& windows);

}  // namespace identification::gap
