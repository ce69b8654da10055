/// The report's views of a residual, and its statements on what the data cannot show.
#include "identification/gap/views.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

#include "identification/gap/blind_spots.h"

namespace identification::gap {
namespace gap_views_test {

constexpr double kPi = std::numbers::pi;

/// One way at changing speed, `seconds` long, beginning at 12.345 s, with a torque of 0.01 N·m at 4 Hz.
Source one_way(double seconds) {
  Source source{.name = "coast.csv", .recording = {}};
  std::vector<double> time, torque, position;
  for (int i = 0; i < static_cast<int>(seconds * 500); ++i) {
    const double t = i / 500.0;
    time.push_back(12.345 + t);
    position.push_back(2 * t + 0.2 * std::sin(2 * t));
    torque.push_back(0.05 + 0.01 * std::sqrt(2.0) * std::sin(2 * kPi * 4 * t));
  }
  source.recording.columns = {{"time_s", time}, {"torque_measured_Nm", torque}, {"position_rad", position}};
  return source;
}

// Longer than any one transform of 8192 rows: squared and added, the bands are the squared rms, and the tone
// is where it is.
TEST(Views, TheSpectrumOfTheResidualHoldsAllOfItsPower) {
  const Source source = one_way(400);
  FittedModel model{.model = {.name = "bench", .inertia_kg_m2 = 1e-6}, .given_inertia_kg_m2 = 1e-6};
  model.model.effects = {model::effects::make_effect("coulomb", {{"torque_Nm", 0.05}})};
  const Band band = choose_band({source}, model.model);
  const std::vector<Signals> signals = {make_signals(source, band)};
  const Rows rows(signals);
  std::vector<Eigen::Index> late;  // as when the end is held out
  for (Eigen::Index i = rows.count() / 2; i < rows.count(); ++i) late.push_back(i);
  const std::vector<ResidualMap> maps = residual_maps(model, model, rows, late);
  const auto map = std::ranges::find(maps, "frequency_Hz", &ResidualMap::coordinate);
  ASSERT_NE(map, maps.end());
  double square = 0;
  for (const double rms : map->before_Nm) square += rms * rms;
  EXPECT_NEAR(std::sqrt(square), 0.01, 3e-4);
  const auto most = std::ranges::max_element(map->before_Nm) - map->before_Nm.begin();
  EXPECT_NEAR(map->at[static_cast<std::size_t>(most)], 4, 0.5);
}

bool says(const std::vector<BlindSpot>& spots, const std::string& word) {
  return std::ranges::any_of(spots,
                             [&](const BlindSpot& spot) { return spot.text.find(word) != spot.text.npos; });
}

TEST(BlindSpots, OneWayOnlyShowsNeitherOffsetNorReversals) {
  const Source source = one_way(20);
  const Band band = choose_band({source}, {.name = "bench"});
  const std::vector<BlindSpot> notes = blind_spots(std::vector<Signals>{make_signals(source, band)}, false);
  EXPECT_TRUE(says(notes, "one way only"));
  EXPECT_TRUE(says(notes, "hardly ever reverses"));
  EXPECT_TRUE(says(notes, "hardly ever slow"));
  EXPECT_TRUE(says(notes, "no torque command"));
  EXPECT_FALSE(says(notes, "thermal drift"));
  EXPECT_FALSE(says(notes, "less than a radian"));
  EXPECT_FALSE(says(notes, "higher rate"));
}

// A torque of 2 Hz shows at 100 samples a second, and at 10 it does not.
TEST(BlindSpots, TooFewSamplesForTheTorqueAreSaid) {
  for (const double rate_Hz : {100.0, 10.0}) {
    Source source = one_way(20);
    const std::vector<double> time_s = source.recording.columns[0].values;
    source.recording.columns.push_back({"torque_command_Nm", {}});
    for (const double t : time_s)
      source.recording.columns.back().values.push_back(0.1 * std::sin(2 * std::numbers::pi * 2 * t));
    const auto every = static_cast<std::size_t>(std::llround(1 / (rate_Hz * (time_s[1] - time_s[0]))));
    for (auto& column : source.recording.columns) {
      std::vector<double> kept;
      for (std::size_t i = 0; i < column.values.size(); i += every) kept.push_back(column.values[i]);
      column.values = kept;
    }
    const Band band = choose_band({source}, {.name = "bench"});
    const std::vector<BlindSpot> notes = blind_spots(std::vector<Signals>{make_signals(source, band)}, false);
    EXPECT_EQ(says(notes, "higher rate"), rate_Hz == 10) << rate_Hz;
  }
}

}  // namespace gap_views_test
}  // namespace identification::gap
