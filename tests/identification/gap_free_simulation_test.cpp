/// A model driven by the torque only, starting at the measured state.
#include "identification/gap/free_simulation.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numeric>
#include <vector>

#include "sim/model_drive.h"

namespace identification::gap {
namespace gap_free_simulation_test {

// A joint that slides slowly has its bristle bent all the way, by 2 mrad. A window that begins during sliding
// and had to bend it first would gain 50 mrad/s too much.
TEST(FreeSimulation, BeginsWithTheBristleAsBentAsTheRecordingLeftIt) {
  constexpr double kPeriod_s = 1e-3;
  model::effects::DriveModel model{.name = "bench", .inertia_kg_m2 = 0.011};
  model.effects = {
      model::effects::make_effect("coulomb", {{"torque_Nm", 0.045}}),
      model::effects::make_effect("viscous", {{"coefficient_Nm_s_per_rad", 0.0125}}),
      model::effects::make_effect(
          "presliding", {{"stiffness_Nm_per_rad", 20}, {"damping_Nm_s_per_rad", 0.2}, {"exponent", 0.1}})};
  sim::ModelDrive drive(model, kPeriod_s, 20);
  Source source{.name = "slow.csv", .recording = {}};
  std::vector<double> time, torque, position;
  for (int i = 0; i < 12000; ++i) {
    const double t = i * kPeriod_s;
    time.push_back(t);
    position.push_back(drive.position_rad());
    // A speed of 0.1 rad/s, by a controller.
    torque.push_back(0.3 * (0.1 + 0.05 * std::sin(3 * t) - drive.velocity_rad_per_s()) + 0.046);
    drive.step(torque.back());
  }
  source.recording.columns = {{"time_s", time}, {"torque_measured_Nm", torque}, {"position_rad", position}};
  const std::vector<Source> sources{source};
  const std::vector<Signals> signals{make_signals(sources.front(), choose_band(sources, model))};
  const Rows rows(signals);
  std::vector<Eigen::Index> all(static_cast<std::size_t>(rows.count()));
  std::iota(all.begin(), all.end(), 0);
  const std::vector<Window> windows = windows_of(rows, all);
  ASSERT_GT(windows.size(), 5U);
  const std::vector<double> squares = squared_errors(model, rows, windows);
  for (std::size_t i = 1; i < windows.size(); ++i)  // the first begins at rest
    EXPECT_LT(std::sqrt(squares[i] / static_cast<double>(windows[i].length)), 5e-3) << "rad/s, window " << i;
}

}  // namespace gap_free_simulation_test
}  // namespace identification::gap
