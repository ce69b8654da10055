// Recordings as real loggers produce them: damage is detected before the analysis.
#include "identification/gap/diagnosis.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <random>
#include <stdexcept>
#include <string>
#include <vector>

#include "identification/gap/measured_gap.h"

namespace diagnosis_test {

using identification::gap::diagnose;
using identification::gap::Diagnosed;
using identification::gap::Source;

constexpr double kPeriod_s = 2e-3;
constexpr double kInertia_kg_m2 = 0.011;
constexpr double kCoulomb_Nm = 0.3;
constexpr double kViscous = 0.02;
constexpr double kTick_rad = 2 * std::numbers::pi / 16384;

model::effects::DriveModel base() {
  return {.name = "axis",
          .inertia_kg_m2 = kInertia_kg_m2,
          .effects = {model::effects::make_effect("coulomb", {{"torque_Nm", kCoulomb_Nm}}),
                      model::effects::make_effect("viscous", {{"coefficient_Nm_s_per_rad", kViscous}})}};
}

/// A swing with a rise in speed, both directions: torque by Newton and friction, with noise, and encoder
/// ticks.
Source healthy(double duration_s = 20) {
  std::mt19937_64 random(7);
  std::normal_distribution<double> noise(0, 2e-3);
  std::vector<double> time, position, velocity, torque;
  for (int i = 0; i * kPeriod_s < duration_s; ++i) {
    const double t = i * kPeriod_s;
    const double slow = 0.9, quick = 4.1;  // rad/s
    const double v = 5 * std::sin(slow * t) + 2 * std::sin(quick * t);
    const double a = 5 * slow * std::cos(slow * t) + 2 * quick * std::cos(quick * t);
    const double p = -5 / slow * std::cos(slow * t) - 2 / quick * std::cos(quick * t);
    time.push_back(t);
    position.push_back(kTick_rad * std::round(p / kTick_rad));
    velocity.push_back(v + 0.02 * noise(random));
    torque.push_back(kInertia_kg_m2 * a + std::copysign(kCoulomb_Nm, v) + kViscous * v + noise(random));
  }
  Source source{.name = "a.csv", .recording = {}};
  source.recording.columns = {{"time_s", time},
                              {"position_rad", position},
                              {"velocity_rad_per_s", velocity},
                              {"torque_measured_Nm", torque}};
  return source;
}

std::vector<double>& column(Source& source, const std::string& name) {
  return std::ranges::find(source.recording.columns, name, &identification::Recording::Column::name)->values;
}
void scale(Source& source, const std::string& name, double factor) {
  for (double& value : column(source, name)) value *= factor;
}
void remove(Source& source, const std::string& name) {
  std::erase_if(source.recording.columns, [&](const auto& c) { return c.name == name; });
}

/// All that was noticed, a line each.
std::string noticed(const Diagnosed& diagnosed) {
  std::string text;
  for (const auto& d : diagnosed.diagnosis)
    text += d.recording + ": " + d.column + " " + d.found + ": " + d.done + "\n";
  return text;
}
std::string refusal(const Source& source) {
  try {
    return "accepted, " + noticed(diagnose({source}, base()));
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
}
bool contains(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

TEST(Diagnosis, HealthyRecordingsStayAsTheyAre) {
  const Source source = healthy();
  const Diagnosed diagnosed = diagnose({source}, base());
  EXPECT_EQ(noticed(diagnosed), "");
  ASSERT_EQ(diagnosed.sources.size(), 1U);
  for (std::size_t c = 0; c < source.recording.columns.size(); ++c)
    EXPECT_EQ(diagnosed.sources[0].recording.columns[c].values, source.recording.columns[c].values);
}

TEST(Diagnosis, TimesSince1970CountFromTheFirstRow) {
  Source source = healthy();
  constexpr double kEpoch_s = 1.7e9;
  for (double& t : column(source, "time_s")) t += kEpoch_s;
  // A hole, so that the parts are named after their times.
  for (std::size_t i = 5000; i < 10000; ++i) column(source, "time_s")[i] += 3;
  remove(source, "velocity_rad_per_s");
  const Diagnosed diagnosed = diagnose({source}, base());
  EXPECT_TRUE(
      contains(noticed(diagnosed),
               "a.csv: time_s begins at 1700000000 s, like a clock that counts from another epoch, such "
               "as 1970: counted from the first row"))
      << noticed(diagnosed);
  ASSERT_EQ(diagnosed.sources.size(), 2U);
  EXPECT_EQ(diagnosed.sources[0].name, "a.csv, 0 s to 10 s");
  EXPECT_EQ(diagnosed.sources[1].name, "a.csv, 13 s to 23 s");
  EXPECT_EQ(diagnosed.sources[1].running_from_s, 0);
  const auto time_s = diagnosed.sources[1].recording.column("time_s");
  // Half of the last binary digit of 1.7e9 s is 0.12 µs.
  for (std::size_t i = 0; i < time_s.size(); ++i)
    ASSERT_NEAR(time_s[i], 13 + static_cast<double>(i) * kPeriod_s, 5e-7);
}

TEST(Diagnosis, TorqueSpikesAreInterpolatedAndCounted) {
  Source source = healthy();
  const Source clean = source;
  std::vector<double>& torque = column(source, "torque_measured_Nm");
  for (const std::size_t at : {100U, 101U, 2500U, 4000U, 4001U, 4002U}) torque[at] = at % 2 == 0 ? 8 : -9;
  Diagnosed diagnosed = diagnose({source}, base());
  EXPECT_TRUE(
      contains(noticed(diagnosed), "torque_measured_Nm 6 (0.06 %) of the values are spikes, up to 9 N·m"))
      << noticed(diagnosed);
  const auto mended = diagnosed.sources.at(0).recording.column("torque_measured_Nm");
  const auto truth = clean.recording.column("torque_measured_Nm");
  for (std::size_t i = 0; i < mended.size(); ++i) ASSERT_NEAR(mended[i], truth[i], 0.02) << i;
}

/// A drive whose speed follows set-points of two seconds each, by a proportional gain of 0.6 N·m·s/rad: at
/// each step the torque peaks, far beyond all others, and decays within some rows. Explicit steps of 0.2 ms.
Source stepping(double period_s, bool commanded) {
  constexpr double kStep_s = 2e-4;
  constexpr double kTurns[] = {0.5, -0.5, 1, -1, 2, -3, 4, -5, 8, -12};
  const auto steps = static_cast<int>(std::lround(period_s / kStep_s));
  std::mt19937_64 random(7);
  std::normal_distribution<double> noise(0, 2e-3);
  std::vector<double> time, position, torque, command;
  double q = 0;
  double v = 0;
  for (int i = 0; i * period_s < 40; ++i) {
    const double t = i * period_s;
    const double push = 0.6 * (kTurns[static_cast<std::size_t>(t / 2) % std::size(kTurns)] - v);
    time.push_back(t);
    position.push_back(kTick_rad * std::round(q / kTick_rad));
    torque.push_back(push + noise(random));
    command.push_back(push);
    for (int n = 0; n < steps; ++n) {
      const double driven = v + kStep_s * (push - kViscous * v) / kInertia_kg_m2;
      v = std::copysign(std::max(0.0, std::abs(driven) - kStep_s * kCoulomb_Nm / kInertia_kg_m2), driven);
      q += kStep_s * v;
    }
  }
  Source source{.name = "a.csv", .recording = {}};
  source.recording.columns = {{"time_s", time}, {"position_rad", position}, {"torque_measured_Nm", torque}};
  if (commanded) source.recording.columns.push_back({"torque_command_Nm", command});
  return source;
}

TEST(Diagnosis, ATorqueThatPeaksAtASetPointStepIsNoSpike) {
  for (const double period_s : {1e-3, 2e-3, 1e-2})
    for (const bool commanded : {false, true}) {
      SCOPED_TRACE(testing::Message() << period_s << " s, commanded: " << commanded);
      Source source = stepping(period_s, commanded);
      EXPECT_EQ(noticed(diagnose({source}, base())), "");
      // Glitches of a row are spikes beside it.
      std::vector<double>& torque = column(source, "torque_measured_Nm");
      const auto at = static_cast<std::size_t>(31.5 / period_s);
      torque[at] += 60;
      torque[at + 40] -= 60;
      const std::string found = noticed(diagnose({source}, base()));
      EXPECT_TRUE(contains(found, "torque_measured_Nm 2 (")) << found;
    }
}

TEST(Diagnosis, APushOfOneRowThatTheMotionAnswersIsNoSpike) {
  for (const bool answered : {true, false}) {
    SCOPED_TRACE(answered);
    Source source = healthy();
    std::vector<double>& torque = column(source, "torque_measured_Nm");
    std::vector<double>& position = column(source, "position_rad");
    const double push_Nm = 8;
    for (const std::size_t at : {1500U, 4500U, 7500U}) {
      torque[at] += push_Nm;
      const double speed = answered ? push_Nm * kPeriod_s / kInertia_kg_m2 : 0;
      for (std::size_t i = at + 1; i < position.size(); ++i)
        position[i] += speed * kPeriod_s * (static_cast<double>(i - at) - 0.5);
    }
    remove(source, "velocity_rad_per_s");
    const std::string found = noticed(diagnose({source}, base()));
    EXPECT_EQ(contains(found, "3 (0.03 %) of the values are spikes"), !answered) << found;
  }
}

/// A joint that accelerates evenly at 100 Hz: its speed follows no torque of one row.
TEST(Diagnosis, AGlitchDuringAnEvenAccelerationIsASpike) {
  constexpr double kAcceleration = 20;
  constexpr double kStep_s = 0.01;
  std::mt19937_64 random(7);
  std::normal_distribution<double> noise(0, 2e-3);
  Source source{.name = "a.csv", .recording = {}};
  std::vector<double> time, position, torque;
  for (int i = 0; i < 2000; ++i) {
    // A second up, a second down.
    const double t = kStep_s * i;
    const double within = std::fmod(t, 1.0);
    const bool up = static_cast<int>(t) % 2 == 0;
    const double v = kAcceleration * (up ? within : 1 - within);
    const double way = kAcceleration * (up ? 0.5 * within * within : within - 0.5 * within * within);
    time.push_back(t);
    position.push_back(kTick_rad * std::round((std::floor(t) * 0.5 * kAcceleration + way) / kTick_rad));
    torque.push_back((up ? 1 : -1) * kInertia_kg_m2 * kAcceleration + kCoulomb_Nm + kViscous * v +
                     noise(random));
  }
  for (const std::size_t at : {250U, 650U, 1250U}) torque[at] += 8;
  source.recording.columns = {{"time_s", time}, {"position_rad", position}, {"torque_measured_Nm", torque}};
  const std::string found = noticed(diagnose({source}, base()));
  EXPECT_TRUE(contains(found, "torque_measured_Nm 3 (")) << found;
}

/// A command that steps beside a spike has no peak of its own; one that peaks where nothing moves has.
TEST(Diagnosis, OnlyAPeakOfTheCommandConfirmsOneOfTheTorque) {
  for (const bool peaks : {false, true}) {
    SCOPED_TRACE(peaks);
    Source source = healthy();
    std::vector<double>& torque = column(source, "torque_measured_Nm");
    std::vector<double> command(torque.size(), 0.0);
    for (const std::size_t at : {2500U, 4500U}) {
      torque[at] += 8;
      if (peaks)
        command[at - 2] = 8;
      else
        for (std::size_t i = at; i < at + 500; ++i) command[i] = 8;
    }
    source.recording.columns.push_back({"torque_command_Nm", command});
    const std::string found = noticed(diagnose({source}, base()));
    EXPECT_EQ(contains(found, "torque_measured_Nm 2 (0.02 %) of the values are spikes"), !peaks) << found;
  }
}

TEST(Diagnosis, ATorqueThatSwitchesBetweenAFewValuesIsNotSaturated) {
  Source source = healthy();
  std::vector<double>& torque = column(source, "torque_measured_Nm");
  for (std::size_t i = 0; i < torque.size(); ++i) torque[i] = i % 500 < 20 ? 0 : i % 1000 < 500 ? 0.8 : -0.8;
  EXPECT_TRUE(refusal(source).starts_with("accepted")) << refusal(source);
  EXPECT_FALSE(contains(refusal(source), "saturated"));
}

TEST(Diagnosis, QuickMotionOfAJointThatMostlyRestsIsNoJump) {
  // Twelve moves in ten minutes at 50 Hz, each of 0.12 s.
  Source source{.name = "a.csv", .recording = {}};
  std::vector<double> time, position, torque;
  std::mt19937_64 random(7);
  std::normal_distribution<double> noise(0, 2e-3);
  constexpr double kMove_s = 0.12;
  for (int i = 0; i < 30000; ++i) {
    const double t = 0.02 * i;
    const double since = std::clamp((std::fmod(t, 50) - 20.005) / kMove_s, 0.0, 1.0);
    const double way = since * since * (3 - 2 * since);
    const bool back = static_cast<int>(t / 50) % 2 == 1;
    time.push_back(t);
    position.push_back(kTick_rad * std::round(2 * (back ? 1 - way : way) / kTick_rad));
    torque.push_back(noise(random));
  }
  source.recording.columns = {{"time_s", time}, {"position_rad", position}, {"torque_measured_Nm", torque}};
  EXPECT_TRUE(refusal(source).starts_with("accepted")) << refusal(source);
  EXPECT_FALSE(contains(refusal(source), "position_rad jumps")) << refusal(source);
  std::vector<double>& moved = column(source, "position_rad");
  for (std::size_t i = 15000; i < moved.size(); ++i) moved[i] += 1;
  EXPECT_TRUE(contains(refusal(source), "position_rad jumps 1 times")) << refusal(source);
  moved[15000] -= 0.4;  // spread over two rows by a resampler
  EXPECT_TRUE(contains(refusal(source), "position_rad jumps 2 times")) << refusal(source);
}

TEST(Diagnosis, AWrappedPositionIsUnwrapped) {
  Source source = healthy();
  const Source clean = source;
  for (double& p : column(source, "position_rad")) p = std::remainder(p, 2 * std::numbers::pi);
  const Diagnosed diagnosed = diagnose({source}, base());
  EXPECT_TRUE(contains(noticed(diagnosed), "times by 6.28 rad against the motion")) << noticed(diagnosed);
  ASSERT_EQ(diagnosed.sources.size(), 1U);
  const auto mended = diagnosed.sources[0].recording.column("position_rad");
  const auto truth = clean.recording.column("position_rad");
  for (std::size_t i = 0; i < mended.size(); ++i)
    ASSERT_NEAR(mended[i] - mended[0], truth[i] - truth[0], 1e-9) << i;
}

/// healthy() without its torque, but with the set-point by which a servo of 10 N·m/rad makes it.
Source followed() {
  Source source = healthy();
  std::vector<double> goal;
  for (std::size_t i = 0; i < source.recording.rows(); ++i)
    goal.push_back(column(source, "position_rad")[i] + column(source, "torque_measured_Nm")[i] / 10);
  remove(source, "torque_measured_Nm");
  remove(source, "velocity_rad_per_s");
  source.recording.columns.push_back({"position_command_rad", goal});
  return source;
}

TEST(Diagnosis, AWrappedPositionIsUnwrappedBeforeItsServoMakesATorque) {
  model::effects::DriveModel model = base();
  model.servo = model::ServoLaw{.output = model::ServoLaw::Output::kTorque, .position_gain = 10, .limit = 5};
  const double gap_Nm = identification::gap::MeasuredGap(model, {followed()}).gap_Nm(model);
  EXPECT_LT(gap_Nm, 0.01);
  for (const bool goal_wraps : {false, true}) {
    SCOPED_TRACE(goal_wraps);
    Source wrapped = followed();
    for (double& p : column(wrapped, "position_rad")) p = std::remainder(p, 2 * std::numbers::pi);
    if (goal_wraps)
      for (double& p : column(wrapped, "position_command_rad")) p = std::remainder(p, 2 * std::numbers::pi);
    const identification::gap::MeasuredGap measured(model, {wrapped});
    EXPECT_NEAR(measured.gap_Nm(model), gap_Nm, 1e-6);
    ASSERT_EQ(measured.diagnosis().size(), 1U);
    EXPECT_EQ(measured.diagnosis()[0].done, "unwrapped");
  }
}

TEST(Diagnosis, ASetPointInStepsOfLessThanATurnIsNotUnwrapped) {
  Source source = followed();
  std::vector<double>& position = column(source, "position_rad");
  std::vector<double>& goal = column(source, "position_command_rad");
  for (std::size_t i = 0; i < goal.size(); ++i) {
    const double phase = 0.01 * static_cast<double>(i);
    position[i] = std::remainder(2.5 - 2.5 * std::cos(phase), 2 * std::numbers::pi);
    goal[i] = std::sin(phase) < 0 ? 0 : 5;
  }
  const std::vector<double> before = goal;
  std::vector<Source> sources{source};
  std::vector<identification::gap::Diagnosis> diagnosis;
  identification::gap::unwrap_positions(sources, diagnosis);
  ASSERT_EQ(diagnosis.size(), 1U);
  const auto after = sources[0].recording.column("position_command_rad");
  EXPECT_TRUE(std::equal(before.begin(), before.end(), after.begin(), after.end()));
}

TEST(Diagnosis, AWrappedSetPointIsUnwrappedAtAnySpeed) {
  for (const double step_rad : {0.01, 0.3, 0.8})
    for (const std::size_t held : {std::size_t{1}, std::size_t{3}}) {
      SCOPED_TRACE(testing::Message() << step_rad << " rad from row to row, held for " << held);
      Source source = followed();
      std::vector<double>& position = column(source, "position_rad");
      std::vector<double>& goal = column(source, "position_command_rad");
      for (std::size_t i = 0; i < goal.size(); ++i) {
        position[i] = std::remainder(step_rad * static_cast<double>(i), 2 * std::numbers::pi);
        goal[i] = std::remainder(step_rad * static_cast<double>(i - i % held) + 0.1, 2 * std::numbers::pi);
      }
      std::vector<Source> sources{source};
      std::vector<identification::gap::Diagnosis> diagnosis;
      identification::gap::unwrap_positions(sources, diagnosis);
      const auto unwrapped = sources[0].recording.column("position_command_rad");
      for (std::size_t i = 0; i < unwrapped.size(); ++i)
        ASSERT_NEAR(unwrapped[i], step_rad * static_cast<double>(i - i % held) + 0.1, 1e-6) << i;
    }
}

TEST(Diagnosis, StepsOfAnotherEncoderThanTheModelsAreNamed) {
  for (const double factor : {2.0, 0.5, 6.35}) {
    model::effects::DriveModel model = base();
    model.encoder_ticks_per_rev = std::round(16384 * factor);
    const std::string text = noticed(diagnose({healthy()}, model));
    EXPECT_TRUE(contains(text,
                         "position_rad moves in steps of 0.000383 rad, 16384 to a turn, but "
                         "encoder_ticks_per_rev of the model's [sensor] is " +
                             std::to_string(std::lround(16384 * factor))))
        << text;
  }
  model::effects::DriveModel model = base();
  model.encoder_ticks_per_rev = 16384;
  EXPECT_EQ(noticed(diagnose({healthy()}, model)), "");
  // A position without steps shows no encoder.
  model.encoder_ticks_per_rev = 1000;
  Source smooth = healthy();
  std::mt19937_64 random(3);
  std::normal_distribution<double> noise(0, kTick_rad);
  for (double& p : column(smooth, "position_rad")) p += noise(random);
  EXPECT_EQ(noticed(diagnose({smooth}, model)), "");
}

TEST(Diagnosis, AnEncoderOnTheMotorsShaftIsCountedThroughItsTurns) {
  // At 7 rad/s the encoder behind a gear of 16 wraps every 28 rows, behind one of 60 every seventh.
  for (const double gear : {16.0, 60.0}) {
    Source source = healthy();
    const Source clean = source;
    const double turn_rad = 2 * std::numbers::pi / gear;
    for (double& p : column(source, "position_rad")) p -= turn_rad * std::floor(p / turn_rad);
    const Diagnosed diagnosed = diagnose({source}, base());
    EXPECT_TRUE(
        contains(noticed(diagnosed), "against the motion, like an encoder that counts within one turn"))
        << noticed(diagnosed);
    ASSERT_EQ(diagnosed.sources.size(), 1U);
    const auto mended = diagnosed.sources[0].recording.column("position_rad");
    const auto truth = clean.recording.column("position_rad");
    for (std::size_t i = 0; i < mended.size(); ++i)
      ASSERT_NEAR(mended[i] - mended[0], truth[i] - truth[0], 0.05) << i;
  }
}

/// Strokes of one direction, with the returns left out.
TEST(Diagnosis, AJumpOverAHoleInTimeIsNoTurn) {
  Source source = healthy();
  remove(source, "velocity_rad_per_s");
  std::vector<double>& time = column(source, "time_s");
  std::vector<double>& position = column(source, "position_rad");
  std::vector<double>& torque = column(source, "torque_measured_Nm");
  for (std::size_t i = 0; i < time.size(); ++i) {
    const std::size_t stroke = i / 2000;
    time[i] += static_cast<double>(stroke);
    position[i] = 5e-4 * static_cast<double>(i % 2000);
    torque[i] = kCoulomb_Nm + torque[i] * 0.01;
  }
  const std::string text = refusal(source);
  EXPECT_FALSE(contains(text, "within one turn")) << text;
}

TEST(Diagnosis, NeitherNoiseAtRestNorStraysAreTurns) {
  Source source = healthy();
  std::mt19937_64 random(3);
  std::normal_distribution<double> noise(0, 1e-3);
  remove(source, "velocity_rad_per_s");
  for (double& p : column(source, "position_rad")) p = 1 + noise(random);
  const std::string rest = refusal(source);
  EXPECT_TRUE(rest.starts_with("accepted") && !contains(rest, "within one turn")) << rest;

  Source strays = healthy();
  std::vector<double>& position = column(strays, "position_rad");
  for (double& p : position) p += 100;
  for (const std::size_t at : {1777U, 3777U, 5777U, 7777U}) position[at] = 0;
  const std::string text = noticed(diagnose({strays}, base()));
  EXPECT_FALSE(contains(text, "within one turn")) << text;
  EXPECT_TRUE(contains(text, "4 (0.04 %) of the values are off the way")) << text;
}

TEST(Diagnosis, AJumpOfPositionAndALongHoleDivideARecording) {
  Source source = healthy();
  std::vector<double>& position = column(source, "position_rad");
  for (std::size_t i = 3000; i < position.size(); ++i) position[i] += 0.7;
  std::vector<double>& time = column(source, "time_s");
  for (std::size_t i = 6000; i < time.size(); ++i) time[i] += 0.3;
  const Diagnosed diagnosed = diagnose({source}, base());
  ASSERT_EQ(diagnosed.sources.size(), 3U) << noticed(diagnosed);
  EXPECT_EQ(diagnosed.sources[0].recording.rows(), 3000U);
  EXPECT_EQ(diagnosed.sources[1].recording.rows(), 3000U);
  EXPECT_EQ(diagnosed.sources[2].running_from_s, 0.0) << "since when the drive runs stays known";
  EXPECT_TRUE(contains(noticed(diagnosed), "position_rad jumps 1 times, by up to 0.7 rad"))
      << noticed(diagnosed);
  EXPECT_TRUE(contains(noticed(diagnosed), "time_s 1 holes of up to 0.302 s")) << noticed(diagnosed);
}

TEST(Diagnosis, AStrayPositionIsInterpolated) {
  Source source = healthy();
  column(source, "position_rad")[777] += 3;
  const Diagnosed diagnosed = diagnose({source}, base());
  EXPECT_EQ(diagnosed.sources.size(), 1U);
  EXPECT_TRUE(contains(noticed(diagnosed), "1 (0.01 %) of the values are off the way")) << noticed(diagnosed);
  EXPECT_NEAR(diagnosed.sources[0].recording.column("position_rad")[777],
              healthy().recording.column("position_rad")[777], 1e-3);
}

TEST(Diagnosis, LateRowsAreNoReasonToRefuse) {
  Source source = healthy();
  std::mt19937_64 random(3);
  std::vector<std::size_t> rows;
  for (std::size_t i = 0; i < source.recording.rows(); ++i)
    if (random() % 75 != 0) rows.push_back(i);
  for (auto& c : source.recording.columns) {
    std::vector<double> kept;
    for (const std::size_t row : rows) kept.push_back(c.values[row]);
    c.values = kept;
  }
  const Diagnosed diagnosed = diagnose({source}, base());
  EXPECT_EQ(diagnosed.sources.size(), 1U);
  EXPECT_TRUE(contains(noticed(diagnosed), "of the rows come late")) << noticed(diagnosed);
}

TEST(Diagnosis, OfAHeldSensorOnlyFreshValuesCount) {
  for (const std::string name : {"position_rad", "torque_measured_Nm"}) {
    SCOPED_TRACE(name);
    Source source = healthy();
    std::vector<double>& values = column(source, name);
    for (std::size_t i = 0; i < values.size(); ++i) values[i] = values[i - i % 4];
    const Diagnosed diagnosed = diagnose({source}, base());
    EXPECT_TRUE(contains(noticed(diagnosed), name + " is held: a fresh value comes every 4 rows"))
        << noticed(diagnosed);
    ASSERT_EQ(diagnosed.sources.size(), 1U);
    EXPECT_NEAR(static_cast<double>(diagnosed.sources[0].recording.rows()), 2500, 15);
  }
}

TEST(Diagnosis, ATorqueThatStopsWhileTheJointMovesIsLeftOut) {
  Source source = healthy();
  std::vector<double>& torque = column(source, "torque_measured_Nm");
  std::fill(torque.begin() + 4000, torque.begin() + 5500, torque[4000]);  // 8 s to 11 s
  const Diagnosed diagnosed = diagnose({source}, base());
  EXPECT_TRUE(contains(noticed(diagnosed), "from 8 s to 11 s, while the joint turns; 1499 (15 %)"))
      << noticed(diagnosed);
  std::size_t rows = 0;
  for (const Source& part : diagnosed.sources) rows += part.recording.rows();
  EXPECT_EQ(rows, 10000 - 1499U);
}

/// Its torque changes from row to row by more than its noise, and the command contradicts it.
TEST(Diagnosis, AFastTorqueThatStopsIsLeftOutToo) {
  Source source = healthy();
  std::vector<double> torque;
  std::vector<double> command;
  for (const double t : column(source, "time_s")) {
    command.push_back(0.4 * std::sin(20 * t));
    torque.push_back(t > 8 && t < 9 ? 0.123 : command.back());
  }
  column(source, "torque_measured_Nm") = torque;
  source.recording.columns.push_back({"torque_command_Nm", command});
  const Diagnosed diagnosed = diagnose({source}, base());
  EXPECT_TRUE(
      contains(noticed(diagnosed), "torque_measured_Nm stays 0.123 from 8 s to 9 s, while its command"))
      << noticed(diagnosed);
}

/// A joint that a coarse sensor sees at rest is not a sensor that stopped.
TEST(Diagnosis, ATorqueThatRestsWithTheJointStays) {
  Source source = healthy();
  remove(source, "velocity_rad_per_s");
  std::vector<double>& torque = column(source, "torque_measured_Nm");
  std::vector<double>& position = column(source, "position_rad");
  std::fill(torque.begin() + 4000, torque.end(), torque[4000]);
  std::fill(position.begin() + 4000, position.end(), position[4000]);
  EXPECT_FALSE(contains(noticed(diagnose({source}, base())), "torque_measured_Nm stays"));
}

/// Without noise a torque may well stay while the joint turns: in a dead-band, or at a steady speed.
TEST(Diagnosis, ATorqueWithoutNoiseThatStaysDidNotStop) {
  Source source = healthy();
  std::vector<double>& torque = column(source, "torque_measured_Nm");
  for (std::size_t i = 0; i < torque.size(); ++i) {
    const double command = 0.3 * std::sin(1e-3 * static_cast<double>(i));
    torque[i] = std::abs(command) < 0.1 ? 0.0 : command;
  }
  EXPECT_FALSE(contains(noticed(diagnose({source}, base())), "torque_measured_Nm stays"));

  std::vector<double> command;
  for (std::size_t i = 0; i < torque.size(); ++i) {
    command.push_back(0.3 * std::sin(1e-3 * static_cast<double>(i)));
    torque[i] = std::abs(command[i]) < 0.2 ? 0.0 : command[i];
  }
  source.recording.columns.push_back({"torque_command_Nm", command});
  EXPECT_FALSE(contains(noticed(diagnose({source}, base())), "torque_measured_Nm stays"))
      << "a wide dead-band";
}

TEST(Diagnosis, ACoarseEncoderIsNotHeld) {
  Source source = healthy();
  for (double& p : column(source, "position_rad")) p = 0.01 * std::round(p / 0.01);
  EXPECT_FALSE(contains(noticed(diagnose({source}, base())), "is held"));
}

TEST(Diagnosis, ADeadColumnGoesWhenAnotherSaysTheSame) {
  Source source = healthy();
  source.recording.columns.push_back({"torque_command_Nm", column(source, "torque_measured_Nm")});
  for (double& torque : column(source, "torque_measured_Nm")) torque = 0;
  const Diagnosed diagnosed = diagnose({source}, base());
  EXPECT_TRUE(contains(noticed(diagnosed), "torque_measured_Nm is 0 in every row")) << noticed(diagnosed);
  EXPECT_FALSE(diagnosed.sources.at(0).recording.has("torque_measured_Nm"));

  for (double& torque : column(source, "torque_command_Nm")) torque = 0;
  EXPECT_TRUE(contains(refusal(source), "a.csv: torque_measured_Nm is 0 in every row")) << refusal(source);

  Source stuck = healthy();
  for (double& position : column(stuck, "position_rad")) position = 1;
  EXPECT_TRUE(contains(noticed(diagnose({stuck}, base())), "position_rad does not change")) << refusal(stuck);
}

TEST(Diagnosis, UnitsThatContradictTheOtherColumnAreRefusedWithTheRemedy) {
  Source degrees = healthy();
  scale(degrees, "position_rad", 180 / std::numbers::pi);
  EXPECT_TRUE(contains(refusal(degrees), "position_rad seems to be in degrees")) << refusal(degrees);
  Source rpm = healthy();
  scale(rpm, "velocity_rad_per_s", 30 / std::numbers::pi);
  EXPECT_TRUE(contains(refusal(rpm), "revolutions per minute")) << refusal(rpm);
  Source opposite = healthy();
  scale(opposite, "velocity_rad_per_s", -1);
  EXPECT_TRUE(contains(refusal(opposite), "wrong sign")) << refusal(opposite);
  Source gear = healthy();
  scale(gear, "velocity_rad_per_s", 26);
  EXPECT_TRUE(contains(refusal(gear), "accepted, a.csv: position_rad changes 0.0385 times as fast"))
      << refusal(gear);
  Source milliseconds = healthy();
  milliseconds.recording.sample_rate_Hz = 500;
  scale(milliseconds, "time_s", 1000);
  EXPECT_TRUE(contains(refusal(milliseconds), "time_s seems to be in milliseconds")) << refusal(milliseconds);
}

TEST(Diagnosis, UnitsShowInTheInertiaAndFrictionThatTheyImply) {
  Source degrees = healthy();
  remove(degrees, "velocity_rad_per_s");
  scale(degrees, "position_rad", 180 / std::numbers::pi);
  EXPECT_TRUE(contains(refusal(degrees), "the motion seems to be in degrees")) << refusal(degrees);
  Source milli = healthy();
  scale(milli, "torque_measured_Nm", 1000);
  EXPECT_TRUE(contains(refusal(milli), "torque_measured_Nm seems to be in mN·m")) << refusal(milli);
  Source reversed = healthy();
  scale(reversed, "torque_measured_Nm", -1);
  EXPECT_TRUE(contains(refusal(reversed), "torque_measured_Nm has the wrong sign")) << refusal(reversed);
  Source turns = healthy();
  remove(turns, "velocity_rad_per_s");
  scale(turns, "position_rad", 0.5 / std::numbers::pi);
  EXPECT_TRUE(contains(refusal(turns), "position_rad seems to be in turns")) << refusal(turns);
  Source rpm = healthy();
  remove(rpm, "position_rad");
  scale(rpm, "velocity_rad_per_s", 30 / std::numbers::pi);
  EXPECT_TRUE(contains(refusal(rpm), "revolutions per minute")) << refusal(rpm);
  Source motor = healthy();
  for (const char* moved : {"position_rad", "velocity_rad_per_s"}) scale(motor, moved, 50);
  scale(motor, "torque_measured_Nm", 1.0 / 50);
  EXPECT_TRUE(contains(refusal(motor), "on the motor's side of a gear of about 50")) << refusal(motor);
}

/// The motion of healthy(), of an arm that its weight pulls down harder than its inertia and friction resist.
Source arm() {
  Source source = healthy();
  std::vector<double>& torque = column(source, "torque_measured_Nm");
  for (std::size_t i = 0; i < torque.size(); ++i)
    torque[i] += 3 * std::sin(column(source, "position_rad")[i]);
  return source;
}

TEST(Diagnosis, AnArmsWeightHidesNeitherAWrongSignNorAUnit) {
  EXPECT_EQ(noticed(diagnose({arm()}, base())), "");
  Source reversed = arm();
  scale(reversed, "torque_measured_Nm", -1);
  EXPECT_TRUE(contains(refusal(reversed), "torque_measured_Nm has the wrong sign")) << refusal(reversed);
  Source milli = arm();
  scale(milli, "torque_measured_Nm", 1000);
  EXPECT_TRUE(contains(refusal(milli), "torque_measured_Nm seems to be in mN·m")) << refusal(milli);
}

TEST(Diagnosis, AModelThatIsWrongByAnyOtherFactorIsNoUnit) {
  for (const double factor : {0.1, 0.3, 3.0, 10.0, 100.0, 1000.0}) {
    SCOPED_TRACE(factor);
    model::effects::DriveModel wrong = base();
    wrong.inertia_kg_m2 *= factor;
    EXPECT_EQ(noticed(diagnose({healthy()}, wrong)), "");
  }
}

}  // namespace diagnosis_test
