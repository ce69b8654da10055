/// A model driven by the torque only, starting at the measured state.
#include "identification/gap/free_simulation.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numeric>
#include <vector>

#include "sim/model_drive.h"

namespace identification::gap {
namespace gap_free_simulation_test {

constexpr double kPeriod_s = 1e-3;

model::effects::DriveModel bench(double inertia_kg_m2, double coulomb_Nm) {
  model::effects::DriveModel model{.name = "bench", .inertia_kg_m2 = inertia_kg_m2};
  model.effects = {
      model::effects::make_effect("coulomb", {{"torque_Nm", coulomb_Nm}}),
      model::effects::make_effect("viscous", {{"coefficient_Nm_s_per_rad", 0.0125}}),
      model::effects::make_effect(
          "presliding", {{"stiffness_Nm_per_rad", 20}, {"damping_Nm_s_per_rad", 0.2}, {"exponent", 0.1}})};
  return model;
}

/// A recording of a slow motion, and all windows in it.
struct Slow {
  Slow() : signals(recorded()), rows(signals), windows(windows_of(rows, all())) {}

  static std::vector<Signals> recorded() {
    const model::effects::DriveModel model = bench(0.011, 0.045);
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
    return {make_signals(sources.front(), choose_band(sources, model))};
  }
  std::vector<Eigen::Index> all() const {
    std::vector<Eigen::Index> rows_of_all(static_cast<std::size_t>(rows.count()));
    std::iota(rows_of_all.begin(), rows_of_all.end(), 0);
    return rows_of_all;
  }

  std::vector<Signals> signals;
  Rows rows;
  std::vector<Window> windows;
};

// A joint that slides slowly has its bristle bent all the way, by 2 mrad. A window that begins during sliding
// and had to bend it first would gain 50 mrad/s too much.
TEST(FreeSimulation, BeginsWithTheBristleAsBentAsTheRecordingLeftIt) {
  const Slow slow;
  ASSERT_GT(slow.windows.size(), 5U);
  const SimulatedMotion motion = simulated_motion(bench(0.011, 0.045), slow.rows, slow.windows);
  EXPECT_TRUE(motion.follows);
  for (std::size_t i = 1; i < slow.windows.size(); ++i)  // the first begins at rest
    EXPECT_LT(std::sqrt(motion.squares[i] / static_cast<double>(slow.windows[i].length)), 5e-3)
        << "rad/s, window " << i;
}

// An inertia of a thousandth and a friction that is a tenth too small: it reaches the speed at which the
// viscous friction takes the missing 4.5 mN.m, 0.36 rad/s, within milliseconds, where the joint turns with
// 0.1 rad/s.
TEST(FreeSimulation, ThatRunsAwayDoesNotFollow) {
  const Slow slow;
  const SimulatedMotion motion = simulated_motion(bench(0.011e-3, 0.9 * 0.045), slow.rows, slow.windows);
  EXPECT_FALSE(motion.follows);
}

}  // namespace gap_free_simulation_test
}  // namespace identification::gap
