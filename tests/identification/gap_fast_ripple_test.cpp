// A ripple of the torque above the analysed band: it is found in the raw rows, and a tone in time is not one.
#include "identification/gap/fast_ripple.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <numbers>
#include <random>
#include <vector>

namespace identification::gap {
namespace gap_fast_ripple_test {

constexpr double kRate_Hz = 2000;

/// 20 s at 6 to 10 rad/s with `ripple(position, time)` in the measured torque and 2 mN·m of noise.
std::vector<Signals> turning(const std::function<double(double, double)>& ripple_Nm) {
  std::mt19937_64 random(7);
  std::normal_distribution<double> noise(0, 2e-3);
  Source source{.name = "turning.csv", .recording = {}};
  std::vector<double> time, torque, position;
  double at_rad = 0.3;
  for (int i = 0; i < 40'000; ++i) {
    const double t = i / kRate_Hz;
    time.push_back(t);
    position.push_back(at_rad);
    torque.push_back(0.1 + 0.02 * std::cos(0.7 * t) + ripple_Nm(at_rad, t) + noise(random));
    at_rad += (8 + 2 * std::sin(0.7 * t)) / kRate_Hz;
  }
  source.recording.columns = {{"time_s", time}, {"torque_measured_Nm", torque}, {"position_rad", position}};
  const model::effects::DriveModel base{.name = "bench", .inertia_kg_m2 = 0.01};
  return {make_signals(source, choose_band({source}, base))};
}

TEST(FastRipple, OfTheMotorIsFoundAboveTheBand) {
  const auto found =
      fast_ripple(turning([](double position, double) { return 3e-3 * std::sin(156 * position + 1); }));
  ASSERT_TRUE(found.has_value());
  EXPECT_NEAR(found->periods_per_rev, 156, 0.07);
  EXPECT_NEAR(found->amplitude_Nm, 3e-3, 3e-4);
}

TEST(FastRipple, OfTheCommandIsSaidToBeTheLoops) {
  std::vector<Signals> signals =
      turning([](double position, double) { return 3e-3 * std::sin(156 * position + 1); });
  EXPECT_NE(fast_ripple_note(signals, {}).find("or of its current sensor"), std::string::npos);
  signals[0].raw_command_Nm = signals[0].raw_torque_Nm;
  EXPECT_NE(fast_ripple_note(signals, {}).find("its command does so too"), std::string::npos);
  const model::effects::DriveModel cogs{.name = "bench",
                                        .inertia_kg_m2 = 0.01,
                                        .effects = {model::effects::make_effect(
                                            "cogging", {{"amplitude_Nm", 3e-3}, {"periods_per_rev", 156}})}};
  EXPECT_EQ(fast_ripple_note(signals, cogs), "") << "it is found";
}

TEST(FastRipple, IsNeitherNoiseNorAToneInTimeNorWithinTheBand) {
  const auto none = [](double, double) { return 0.0; };
  const auto hum = [](double, double t) { return 0.01 * std::sin(2 * std::numbers::pi * 150 * t); };
  const auto slow = [](double position, double) { return 3e-3 * std::sin(7 * position); };
  EXPECT_FALSE(fast_ripple(turning(none)).has_value());
  EXPECT_FALSE(fast_ripple(turning(hum)).has_value());
  EXPECT_FALSE(fast_ripple(turning(slow)).has_value());
}

TEST(FastRipple, TheBandPassesWhatIsSlowEnough) {
  const std::vector<Signals> signals = turning([](double, double) { return 0.0; });
  const double shown = most_periods_shown(signals);
  EXPECT_LT(shown * 6, 2 * std::numbers::pi * signals.front().band_Hz * 1.1);
  EXPECT_GT(shown * 7, 2 * std::numbers::pi * signals.front().band_Hz);
}

}  // namespace gap_fast_ripple_test
}  // namespace identification::gap
