/// @file
/// A model driven by the torque only, in short windows that start in the measured state.
#pragma once
#include <cstddef>
#include <numeric>
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
/// One starts at each row of `use` not covered by an earlier one; if there are many, an evenly spread subset.
std::vector<Window> windows_of(const Rows& rows, const std::vector<Eigen::Index>& use);

/// One model on one recording. The initial state of a window follows from the preceding recording: position
/// and velocity of the load behind a gap or a spring relative to the motor, and deflection of the friction
/// contact. A bristle that has to bend first is slack, like a gap.
class FreeSimulation {
 public:
  /// `signals` must outlive the simulation.
  FreeSimulation(const model::effects::DriveModel& model, const Signals& signals);
  /// Velocity at each sample of a window [rad/s]. A measured torque has already passed the actuator.
  std::vector<double> velocity(const Window& window) const;

 private:
  model::effects::DriveModel model_;
  const Signals& signals_;
  std::optional<LoadSide> load_;
  std::vector<double> deflection_rad_;  // of the friction contact; empty if the model has no presliding
};
/// Its squared error over a window, summed over the samples.
double squared_error(const std::vector<double>& simulated_rad_per_s, const Signals& signals,
                     const Window& window);

/// A model on all windows.
struct SimulatedMotion {
  std::vector<double> squares;  ///< squared error of each window; infinite if the simulation is
  bool follows = false;         ///< most of the squared motion is simulated
  double total() const { return std::accumulate(squares.begin(), squares.end(), 0.0); }
};
SimulatedMotion simulated_motion(const model::effects::DriveModel& model, const Rows& rows,
                                 const std::vector<Window>& windows);

}  // namespace identification::gap
