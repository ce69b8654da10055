// Typical laboratory recordings: uneven times, several rates, coarse sensors, gaps.
#include "identification/gap/signals.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>
#include <stdexcept>
#include <string>
#include <vector>

namespace signals_test {

using identification::gap::Band;
using identification::gap::choose_band;
using identification::gap::make_signals;
using identification::gap::Signals;
using identification::gap::Source;

const model::effects::DriveModel kBase{.name = "wheel", .inertia_kg_m2 = 0.01};

double sine(double t) { return std::sin(2 * t); }

std::vector<double> even_times(double period_s, double duration_s) {
  std::vector<double> times;
  for (int i = 0; i * period_s < duration_s; ++i) times.push_back(3 + i * period_s);
  return times;
}

/// Position sin(2t), torque 0.1·sin(2t) with noise.
Source source(const std::vector<double>& times, double noise_Nm = 1e-3) {
  std::mt19937_64 random(1);
  std::normal_distribution<double> normal(0, noise_Nm);
  Source made{.name = "a.csv", .recording = {}};
  made.recording.columns = {{"time_s", times}, {"torque_measured_Nm", {}}, {"position_rad", {}}};
  for (const double t : times) {
    made.recording.columns[1].values.push_back(0.1 * sine(t) + normal(random));
    made.recording.columns[2].values.push_back(sine(t));
  }
  return made;
}

/// Position, velocity and acceleration, at the distance from the ends that model comparisons use.
void expect_motion(const Signals& s, double share) {
  ASSERT_GT(s.size(), 40U);
  double position = 0;
  double velocity = 0;
  double acceleration = 0;
  const auto edge = static_cast<std::size_t>(1 / (s.band_Hz * s.period_s));
  for (std::size_t i = edge; i + edge < s.size(); ++i) {
    const double t = s.time_s[i];
    position = std::max(position, std::abs(s.position_rad[i] - std::sin(2 * t)));
    velocity = std::max(velocity, std::abs(s.velocity_rad_per_s[i] - 2 * std::cos(2 * t)));
    acceleration = std::max(acceleration, std::abs(s.acceleration_rad_per_s2[i] + 4 * std::sin(2 * t)));
  }
  EXPECT_LT(position, share);
  EXPECT_LT(velocity, 2 * share);
  EXPECT_LT(acceleration, 4 * share);
}

std::string refusal(const std::vector<Source>& sources) {
  try {
    choose_band(sources, kBase);
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "";
}

TEST(GapSignals, SamplesCountWhenTheirTimesSay) {
  // A poller that is slower while the drive is on, and shakes: 3.5 or 5.3 ms, ±10 %.
  std::mt19937_64 random(2);
  std::uniform_real_distribution<double> shake(0.9, 1.1);
  std::vector<double> times{3};
  while (times.back() < 15) {
    const bool on = std::fmod(times.back(), 4) < 2;
    times.push_back(times.back() + shake(random) * (on ? 5.3e-3 : 3.5e-3));
  }
  const Source uneven = source(times);
  const Band band = choose_band({uneven}, kBase);
  const Signals s = make_signals(uneven, band);
  expect_motion(s, 0.01);
  EXPECT_NEAR(s.running_s.back(), times.back() - 3, 0.1);
  for (std::size_t i = 1; i < s.size(); ++i) EXPECT_NEAR(s.time_s[i] - s.time_s[i - 1], s.period_s, 1e-9);
}

TEST(GapSignals, TimesThatWereWrittenLateDoNotCount) {
  Source late = source(even_times(4e-3, 12));
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> delay(0, 0.8 * 4e-3);
  for (double& time : late.recording.columns[0].values) time += delay(random);
  const Signals s = make_signals(late, choose_band({late}, kBase));
  double rough = 0;
  for (std::size_t i = 10; i + 10 < s.size(); ++i)
    rough = std::max(rough, std::abs(s.acceleration_rad_per_s2[i] + 4 * s.position_rad[i]));
  EXPECT_LT(rough, 0.1);  // of 4; where each time counts, it is more than that
}

TEST(GapSignals, EvenSamplesStayAsTheyAre) {
  const Source even = source(even_times(2e-3, 10));
  const Signals s = make_signals(even, choose_band({even}, kBase));
  EXPECT_NEAR(s.raw_period_s, 2e-3, 1e-9);
  EXPECT_NEAR(s.period_s, 2e-3, 1e-9);  // twenty samples or more a period of 25 Hz
  expect_motion(s, 0.002);
}

TEST(GapSignals, RecordingsOfSeveralRatesComeToTheLowest) {
  const Source fast = source(even_times(1e-3, 10));
  const Source slow = source(even_times(0.0307, 40));
  for (const auto& sources : {std::vector{fast, slow}, std::vector{slow, fast}}) {
    const Band band = choose_band(sources, kBase);
    EXPECT_NEAR(band.cutoff_Hz, 0.1 / 0.0307, 1e-6);
    const Signals one = make_signals(sources[0], band);
    const Signals two = make_signals(sources[1], band);
    EXPECT_NEAR(one.period_s, two.period_s, 1e-9);
    EXPECT_NEAR(one.raw_period_s, 0.0307, 1e-9);
    expect_motion(one, 0.03);
    expect_motion(two, 0.03);
  }
}

TEST(GapSignals, TheNoiseOfTheTorqueDoesNotDependOnTheRateItWasRecordedAt) {
  // The same density: √10 times as much at ten times the rate.
  const Source slow = source(even_times(1e-2, 60), 1e-3);
  const Source fast = source(even_times(1e-3, 60), std::sqrt(10.0) * 1e-3);
  const Band alone = choose_band({slow}, kBase);
  const Band both = choose_band({slow, fast, fast}, kBase);
  EXPECT_NEAR(both.torque_sigma_Nm, alone.torque_sigma_Nm, 0.1 * alone.torque_sigma_Nm);
}

TEST(GapSignals, VelocityAloneWillDo) {
  Source only = source(even_times(1e-2, 20));
  only.recording.columns[2].name = "velocity_rad_per_s";
  for (std::size_t i = 0; i < only.recording.rows(); ++i)
    only.recording.columns[2].values[i] = 2 * std::cos(2 * only.recording.columns[0].values[i]);
  const Signals s = make_signals(only, choose_band({only}, kBase));
  for (std::size_t i = 10; i + 10 < s.size(); ++i)
    EXPECT_NEAR(s.velocity_rad_per_s[i], 2 * std::cos(2 * s.time_s[i]), 0.02);
}

TEST(GapSignals, ACommandWithoutNoiseDoesNotNarrowTheBandToNothing) {
  // 4096 counts a turn, and a torque that is computed: nothing in it but the law.
  Source coarse = source(even_times(5e-3, 20), 0);
  coarse.recording.columns[1].name = "torque_command_Nm";
  for (double& position : coarse.recording.columns[2].values) {
    const double count = 2 * std::numbers::pi / 4096;
    position = std::round(position / count) * count;
  }
  EXPECT_GT(choose_band({coarse}, kBase).cutoff_Hz, 2.5);
}

TEST(GapSignals, RefusesWhatCannotBeUsedWithTheFileAndTheReason) {
  EXPECT_NE(refusal({source(even_times(1e-2, 0.5))}).find("a.csv: has 50 rows"), std::string::npos);

  Source still = source(even_times(1e-2, 20));
  for (double& position : still.recording.columns[2].values) position = 0.5;
  EXPECT_NE(refusal({still}).find("staircase"), std::string::npos);

  Source blind = source(even_times(1e-2, 20));
  blind.recording.columns[2].name = "angle_rad";
  EXPECT_NE(refusal({blind}).find("no position_rad"), std::string::npos);
  blind.recording.columns[2].name = "position_rad";
  blind.recording.columns[1].name = "force_N";
  EXPECT_NE(refusal({blind}).find("torque_measured_Nm"), std::string::npos);
}

TEST(GapSignals, LevelsOfATorqueAreNoResolutionOfItsSensor) {
  Source levels = source(even_times(1e-3, 40));
  std::vector<double>& torque = levels.recording.columns[1].values;
  std::mt19937_64 random(4);
  std::normal_distribution<double> noise(0, 1e-3);
  // Ten times a second to the other side.
  for (std::size_t i = 0; i < torque.size(); ++i) torque[i] = (i / 100) % 2 == 0 ? 0.8 : -0.8;
  EXPECT_EQ(choose_band({levels}, kBase).torque_sigma_Nm, 0);
  // A sensor in steps of 0.02 N·m: 0.02/√12.
  for (double& value : torque) value = 0.02 * std::round((value + 20 * noise(random)) / 0.02);
  EXPECT_GT(choose_band({levels}, kBase).torque_sigma_Nm, 0.005);
}

}  // namespace signals_test
