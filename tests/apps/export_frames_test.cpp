// The demonstrations in a recording, at a frame rate. The recordings are made here, by formula.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <map>
#include <numbers>
#include <string>
#include <vector>

#include "apps/youbotctl/export_frames.h"
#include "apps/youbotctl/export_statistics.h"
#include "control/teleoperation.h"
#include "runtime/configuration/toml_reader.h"
#include "runtime/mcap/convert.h"
#include "tests/support/temporary_directory.h"

namespace export_frames_test {

using control::TeleopPhase;
using youbotctl::Demonstrations;
using youbotctl::Episode;
using youbotctl::FrameOptions;

constexpr double kOperating = static_cast<double>(TeleopPhase::kOperating);

/// Value of a column at a time; zero where none is given, and a quaternion is the unit.
using Columns = std::map<std::string, std::function<double(double)>>;

class ExportFrames : public testing::Test {
 protected:
  /// Rows at these times.
  std::filesystem::path record(const std::vector<double>& times_s, const Columns& given) const {
    std::string text = "# youbot recording v1\n# experiment: teleoperation\ntime_s,phase";
    std::vector<std::string> names;
    for (const youbotctl::Feature& feature : youbotctl::teleoperation_features())
      for (const std::string& name : feature.columns) {
        names.push_back(name);
        text += "," + name;
      }
    names.insert(names.begin(), "phase");
    text += "\n";
    for (const double t_s : times_s) {
      text += std::to_string(t_s);
      for (const std::string& name : names) {
        const auto found = given.find(name);
        const double otherwise = name == "phase" ? kOperating : name.ends_with("_qw") ? 1.0 : 0.0;
        text += "," + std::to_string(found == given.end() ? otherwise : found->second(t_s));
      }
      text += "\n";
    }
    return folder_.write("teleoperation.csv", text);
  }
  /// 1 kHz.
  std::filesystem::path record(double duration_s, const Columns& given = {}) const {
    std::vector<double> times_s;
    for (int i = 0; i < std::lround(duration_s * 1000); ++i) times_s.push_back(i / 1000.0);
    return record(times_s, given);
  }
  static std::string refusal(const std::filesystem::path& recording, const FrameOptions& options = {}) {
    try {
      youbotctl::read_demonstrations(recording, options);
    } catch (const runtime::ConfigError& error) {
      return error.what();
    }
    return "none";
  }
  static bool says(const std::vector<std::string>& texts, const std::string& part) {
    return std::ranges::any_of(texts, [&](const auto& text) { return text.find(part) != std::string::npos; });
  }

  support::TemporaryDirectory folder_;
};

/// Of a column in an episode.
std::vector<double> series(const Episode& episode, const std::string& column) {
  const auto& features = youbotctl::teleoperation_features();
  std::vector<double> values;
  for (std::size_t f = 0; f < features.size(); ++f)
    for (std::size_t d = 0; d < features[f].columns.size(); ++d)
      if (features[f].columns[d] == column)
        for (std::size_t i = 0; i < episode.frames; ++i)
          values.push_back(double{episode.values[f][i * features[f].columns.size() + d]});
  return values;
}

TEST_F(ExportFrames, APoseIsThatOfTheNewestRowAtTheTimeOfTheFrame) {
  const auto time = [](double t_s) { return t_s; };
  const auto recording = record(1.0, {{"tip_x_m", time}, {"setpoint_x_m", time}});
  for (const int fps : {30, 50, 333, 1000}) {
    const Demonstrations read = youbotctl::read_demonstrations(recording, {.fps = fps});
    ASSERT_EQ(read.episodes.size(), 1U);
    EXPECT_TRUE(read.warnings.empty());
    const Episode& episode = read.episodes[0];
    EXPECT_EQ(episode.frames, static_cast<std::size_t>(std::floor(0.999 * fps + 1e-6)) + 1) << fps;
    for (const char* column : {"tip_x_m", "setpoint_x_m"}) {
      const std::vector<double> values = series(episode, column);
      for (std::size_t i = 0; i < values.size(); ++i) {
        const double row_s = std::floor(static_cast<double>(i) / fps * 1000 + 1e-6) / 1000;
        ASSERT_NEAR(values[i], row_s, 1e-6) << column << " at " << fps << ", frame " << i;
      }
    }
  }
}

TEST_F(ExportFrames, TheMeanOfAForceKeepsItsImpulseAndDampsWhatWouldAlias) {
  // A contact of 2 ms, which instants at 50 Hz would miss; and a ripple of 49 Hz, which instants would turn
  // into 1 Hz of its whole amplitude.
  const auto recording = record(
      4.0,
      {{"wrench_force_x_N", [](double t_s) { return t_s > 1.0025 && t_s < 1.0045 ? 30.0 : 0.0; }},
       {"wheel_1_torque_measured_Nm", [](double t_s) { return std::sin(2 * std::numbers::pi * 49 * t_s); }},
       {"arm_1_torque_measured_Nm", [](double t_s) { return std::sin(2 * std::numbers::pi * 100 * t_s); }}});
  const Demonstrations read = youbotctl::read_demonstrations(recording, {.fps = 50});
  const Episode& episode = read.episodes.at(0);
  double impulse_Ns = 0;
  for (const double force_N : series(episode, "wrench_force_x_N")) impulse_Ns += force_N / 50;
  EXPECT_NEAR(impulse_Ns, 30 * 0.002, 1e-6);

  // |sin(π f / fps) / (π f / fps)| of the mean, beside |1| of instants.
  const double x = std::numbers::pi * 49 / 50;
  const std::vector<double> aliased = series(episode, "wheel_1_torque_measured_Nm");
  EXPECT_NEAR(*std::max_element(aliased.begin() + 1, aliased.end()), std::sin(x) / x, 2e-3);
  // A multiple of the frame rate is gone.
  const std::vector<double> gone = series(episode, "arm_1_torque_measured_Nm");
  for (std::size_t i = 1; i < gone.size(); ++i) ASSERT_NEAR(gone[i], 0, 1e-6) << i;
}

TEST_F(ExportFrames, ARotationDoesNotChangeItsSign) {
  // About -y through 180°, as 3x3 matrices give it: one part of it is always positive.
  const auto half = [](double t_s) { return 1.2 + 0.8 * t_s; };
  const auto sign = [half](double t_s) { return std::cos(half(t_s)) < 0.4 ? -1.0 : 1.0; };
  const auto recording =
      record(1.0, {{"tip_qw", [=](double t_s) { return sign(t_s) * std::cos(half(t_s)); }},
                   {"tip_qy", [=](double t_s) { return -sign(t_s) * std::sin(half(t_s)); }}});
  const Demonstrations read = youbotctl::read_demonstrations(recording, {});
  const std::vector<double> w = series(read.episodes.at(0), "tip_qw");
  const std::vector<double> y = series(read.episodes.at(0), "tip_qy");
  EXPECT_GT(w.front(), 0);
  EXPECT_LT(w.back(), 0) << "continued beyond 180 degrees";
  for (std::size_t i = 1; i < w.size(); ++i)
    ASSERT_LT(std::hypot(w[i] - w[i - 1], y[i] - y[i - 1]), 0.05) << i;
}

TEST_F(ExportFrames, AnEpisodeIsTheOperationAndNothingElse) {
  const auto phase = [](double t_s) {
    return static_cast<double>(t_s < 0.5   ? TeleopPhase::kStiffening
                               : t_s < 1.0 ? TeleopPhase::kOperating
                               : t_s < 1.2 ? TeleopPhase::kLetGo
                               : t_s < 2.0 ? TeleopPhase::kOperating
                               : t_s < 2.3 ? TeleopPhase::kLetGo
                                           : TeleopPhase::kStopping);
  };
  const auto recording = record(3.0, {{"phase", phase}, {"tip_x_m", [](double t_s) { return t_s; }}});
  const Demonstrations read = youbotctl::read_demonstrations(recording, {.fps = 100});
  ASSERT_EQ(read.episodes.size(), 1U);
  EXPECT_DOUBLE_EQ(read.episodes[0].begin_s, 0.5);
  EXPECT_EQ(read.episodes[0].frames, 150U) << "from 0.5 s to 1.999 s, without the last letting go";
  EXPECT_NEAR(series(read.episodes[0], "tip_x_m").back(), 1.99, 1e-6);
  EXPECT_TRUE(says(read.warnings, "contains 0.2 s in which the hand had let go")) << read.warnings.size();

  const Demonstrations all = youbotctl::read_demonstrations(recording, {.fps = 100, .all_phases = true});
  ASSERT_EQ(all.episodes.size(), 1U);
  EXPECT_EQ(all.episodes[0].frames, 300U);
}

TEST_F(ExportFrames, AFaultEndsAnEpisodeAndIsReported) {
  const auto recording =
      record(2.0, {{"phase", [](double t_s) {
                      return static_cast<double>(t_s < 1.5 ? TeleopPhase::kOperating : TeleopPhase::kFaulted);
                    }}});
  const Demonstrations read = youbotctl::read_demonstrations(recording, {.fps = 10});
  ASSERT_EQ(read.episodes.size(), 1U);
  EXPECT_EQ(read.episodes[0].frames, 15U);
  EXPECT_TRUE(says(read.warnings, "a fault ended the operation at 1.500 s"));
}

TEST_F(ExportFrames, MissingRowsEndAnEpisodeAndAreReported) {
  std::vector<double> times_s;
  for (int i = 0; i < 2000; ++i)
    if (i < 800 || i > 1000) times_s.push_back(i / 1000.0);
  // Shorter than a frame: no harm.
  times_s.erase(times_s.begin() + 100, times_s.begin() + 150);
  const Demonstrations read = youbotctl::read_demonstrations(record(times_s, {}), {.fps = 10});
  ASSERT_EQ(read.episodes.size(), 2U);
  EXPECT_EQ(read.episodes[0].frames, 8U);
  EXPECT_DOUBLE_EQ(read.episodes[1].begin_s, 1.001);
  EXPECT_EQ(read.episodes[1].frames, 10U);
  EXPECT_TRUE(says(read.warnings, "1 gap longer than a frame between rows, the first after 0.799 s"));
}

TEST_F(ExportFrames, McapHasTheSameFramesAsCsv) {
  const auto csv = record(1.0, {{"tip_x_m", [](double t_s) { return std::sin(3 * t_s); }},
                                {"contact_force_x_N", [](double) { return std::nan(""); }}});
  runtime::mcap::convert(csv, folder_ / "teleoperation.mcap");
  const Episode a = youbotctl::read_demonstrations(csv, {}).episodes.at(0);
  const Episode b = youbotctl::read_demonstrations(folder_ / "teleoperation.mcap", {}).episodes.at(0);
  EXPECT_EQ(a.frames, b.frames);
  EXPECT_EQ(series(a, "tip_x_m"), series(b, "tip_x_m"));
  EXPECT_EQ(youbotctl::read_demonstrations(folder_.path(), {}).episodes.at(0).recording, csv);
  EXPECT_TRUE(std::isnan(series(b, "contact_force_x_N").at(0))) << "the robot is not simulated";
}

TEST_F(ExportFrames, WhatIsNoDemonstrationIsRefusedWithAReason) {
  EXPECT_NE(refusal(record(1.0), {.fps = 2000}).find("has 1000 rows per second, fewer than --fps 2000"),
            std::string::npos);
  EXPECT_NE(refusal(record(1.0, {{"phase", [](double t_s) { return t_s < 0.5 ? 1.0 : 2.0; }}}))
                .find("no row has the phase 'operating', only 'centring', 'unfolding'; --all-phases"),
            std::string::npos);
  EXPECT_NE(refusal(record(0.03)).find("operates for less than two frames at --fps 30"), std::string::npos);
  EXPECT_NE(refusal(record(0.0)).find("teleoperation.csv: has no rows"), std::string::npos);
  EXPECT_NE(refusal(record({0.0, 0.1, 0.1}, {}), {.fps = 10})
                .find("teleoperation.csv:6: time_s = 0.1 does not follow"),
            std::string::npos);
  EXPECT_NE(refusal(record(1.0, {{"phase", [](double) { return 77.0; }}})).find(":4: phase = 77 is none of"),
            std::string::npos);
  EXPECT_NE(refusal(record(1.0, {{"tip_x_m", [](double t_s) { return t_s < 0.5 ? 0.0 : std::nan(""); }}}))
                .find("teleoperation.csv:504: tip_x_m is not a number at 0.500 s"),
            std::string::npos)
      << "the header has three lines";
  const auto last =
      record(0.1, {{"wrench_force_x_N", [](double t_s) { return t_s < 0.0985 ? 0.0 : std::nan(""); }}});
  EXPECT_NE(refusal(last).find("teleoperation.csv:103: wrench_force_x_N is not a number at 0.099 s"),
            std::string::npos)
      << "in the last row";
  (void)runtime::mcap::convert(last, folder_ / "last.mcap");
  EXPECT_NE(
      refusal(folder_ / "last.mcap").find("last.mcap: row 100: wrench_force_x_N is not a number at 0.099 s"),
      std::string::npos);
  EXPECT_NE(refusal(record(1.0, {{"tip_qw", [](double) { return 0.0; }}}))
                .find("teleoperation.csv:4: tip_qw to tip_qz are not a rotation at 0.000 s: their norm is "
                      "0.0000, expected 1"),
            std::string::npos);
  EXPECT_NE(refusal(folder_.write("wheel.csv", "# youbot recording v1\ntime_s,position_rad\n0,1\n"))
                .find("wheel.csv: is no recording of a teleoperation: it has no column phase"),
            std::string::npos);
  EXPECT_NE(refusal(folder_ / "run").find("run"), std::string::npos);
  std::filesystem::create_directory(folder_ / "run");
  EXPECT_NE(refusal(folder_ / "run").find("run: contains no recording of a teleoperation"),
            std::string::npos);
  EXPECT_NE(refusal(folder_.write("empty.csv", "")).find("empty.csv"), std::string::npos);
  EXPECT_NE(refusal(folder_ / "missing.csv").find("missing.csv"), std::string::npos);
}

TEST(ExportStatistics, AreThoseOfTheValues) {
  std::vector<double> values;
  for (int i = 1; i <= 200; ++i) {
    values.push_back((i * 77) % 200 + 1);  // each of 1 to 200 once
    values.push_back(-3);
  }
  const std::map<std::string, std::vector<double>> found = [&] {
    const youbotctl::Statistics all = youbotctl::statistics(values, 2);
    return std::map<std::string, std::vector<double>>(all.begin(), all.end());
  }();
  const std::map<std::string, std::vector<double>> expected{
      {"min", {1, -3}},      {"max", {200, -3}},
      {"mean", {100.5, -3}}, {"std", {std::sqrt((200.0 * 200 - 1) / 12), 0}},
      {"count", {200}},      {"q01", {2, -3}},
      {"q10", {20, -3}},     {"q50", {100, -3}},
      {"q90", {180, -3}},    {"q99", {198, -3}}};
  ASSERT_EQ(found.size(), expected.size());
  for (const auto& [name, numbers] : expected) {
    ASSERT_EQ(found.at(name).size(), numbers.size()) << name;
    for (std::size_t d = 0; d < numbers.size(); ++d) EXPECT_NEAR(found.at(name)[d], numbers[d], 1e-9) << name;
  }
}

}  // namespace export_frames_test
