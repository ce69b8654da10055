// The command youbot-gap: reads a model and recordings, writes a better model, a page and numbers, reports
// errors.
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <numbers>
#include <random>
#include <sstream>
#include <string>
#include <vector>

#include "runtime/configuration/drive_model_file.h"
#include "runtime/mcap/convert.h"
#include "tests/support/built_paths.h"
#include "tests/support/run_command.h"
#include "tests/support/temporary_directory.h"

namespace youbot_gap_command_test {

namespace fs = std::filesystem;
using nlohmann::json;

constexpr const char* kCoulombOnly =
    "format = \"youbot-drive-model/1\"\nname = \"wheel-1\"\ninertia_kg_m2 = 0.0112\n"
    "[sensor]\nencoder_ticks_per_rev = 104000\ntorque_noise_Nm = 0.0015\n"
    "[[effect]]\ntype = \"coulomb\"\ntorque_Nm = 0.045\n";

/// A wheel with Coulomb and viscous friction, by an independent method: small explicit steps, and rest where
/// the torque cannot overcome the friction. Driven by three sines that reverse it repeatedly.
std::string recording(unsigned seed, const std::string& rig = "wheel-1", double duration_s = 16) {
  constexpr double kInertia_kg_m2 = 0.0112;
  constexpr double kPeriod_s = 0.004;
  constexpr int kSteps = 100;  // a period
  constexpr double kTick_rad = 2 * std::numbers::pi / 104000;
  std::mt19937 random(seed);
  std::normal_distribution<double> noise_Nm(0, 0.0015);
  std::uniform_real_distribution<double> phase(0, 2 * std::numbers::pi);
  const double phases[] = {phase(random), phase(random), phase(random)};
  std::ostringstream text;
  text.precision(10);
  text << "# youbot recording v1\n# rig: " << rig << "\n# experiment: multisine\n# sample_rate_Hz: 250\n"
       << "time_s,torque_command_Nm,torque_measured_Nm,position_rad\n";
  double torque_Nm = 0;
  double position_rad = 0;
  double velocity_rad_per_s = 0;
  for (int sample = 0; sample * kPeriod_s < duration_s; ++sample) {
    const double t = kPeriod_s * sample;
    // Measured is what acted until now.
    const double measured_Nm = torque_Nm + noise_Nm(random);
    torque_Nm = 0.09 * std::sin(2 * t + phases[0]) + 0.06 * std::sin(5.3 * t + phases[1]) +
                0.04 * std::sin(11.9 * t + phases[2]);
    text << t << ',' << torque_Nm << ',' << measured_Nm << ','
         << std::round(position_rad / kTick_rad) * kTick_rad << '\n';
    for (int step = 0; step < kSteps; ++step) {
      const double direction = velocity_rad_per_s != 0 ? velocity_rad_per_s : torque_Nm;
      const double friction_Nm = std::copysign(0.045, direction) + 0.0125 * velocity_rad_per_s;
      const double next =
          velocity_rad_per_s + kPeriod_s / kSteps * (torque_Nm - friction_Nm) / kInertia_kg_m2;
      // Friction brings it to rest; it never turns it round.
      const bool stops = std::abs(torque_Nm) < 0.045 && next * direction <= 0;
      velocity_rad_per_s = stops ? 0 : next;
      position_rad += kPeriod_s / kSteps * velocity_rad_per_s;
    }
  }
  return text.str();
}

class GapCommand : public testing::Test {
 protected:
  std::string write(const std::string& name, const std::string& text) const {
    return directory_.write(name, text).string();
  }
  std::string path(const std::string& name) const { return (directory_ / name).string(); }
  /// Both streams into output_; the exit code.
  int run(const std::string& arguments) {
    const support::CommandResult result =
        support::run_command(support::program("youbot-gap") + " " + arguments);
    output_ = result.output;
    return result.exit_code;
  }
  /// With the base model and an output directory.
  int explain(const std::string& arguments) {
    return run("--model " + base_ + " --out " + path("out") + " " + arguments);
  }
  std::string text_of(const std::string& name) const {
    std::ifstream file(directory_ / name);
    std::ostringstream text;
    text << file.rdbuf();
    return text.str();
  }
  bool said(const std::string& part) const { return output_.find(part) != std::string::npos; }

  support::TemporaryDirectory directory_;
  std::string base_ = write("base.toml", kCoulombOnly);
  std::string output_;
};

void expect_number(const json& value, const std::string& what) {
  ASSERT_TRUE(value.is_number()) << what << ": " << value;
  EXPECT_TRUE(std::isfinite(value.get<double>())) << what;
}

void expect_where(const json& where) {
  EXPECT_TRUE(where.at("coordinate").is_string());
  expect_number(where.at("from"), "from");
  expect_number(where.at("to"), "to");
  EXPECT_LE(where.at("from"), where.at("to"));
}

/// Everything that the contract names, in the types it names.
void expect_contract(const json& gap) {
  EXPECT_EQ(gap.at("format"), "youbot-gap/1");
  const std::vector<std::string> verdicts{"explained", "partly explained", "ambiguous", "unexplained",
                                          "no gap"};
  EXPECT_NE(std::ranges::find(verdicts, gap.at("verdict").get<std::string>()), verdicts.end());
  expect_number(gap.at("noise_floor_Nm"), "noise_floor_Nm");
  ASSERT_TRUE(gap.at("held_out").is_array());
  EXPECT_FALSE(gap.at("held_out").empty());
  EXPECT_EQ(gap.at("gap").at("metric"), "rms torque residual, held-out");
  EXPECT_EQ(gap.at("gap").at("unit"), "Nm");
  expect_number(gap.at("gap").at("before"), "before");
  expect_number(gap.at("gap").at("after"), "after");
  for (const json& effect : gap.at("effects")) {
    EXPECT_NO_THROW(model::effects::effect_description(effect.at("type").get<std::string>()));
    expect_where(effect.at("where"));
    expect_number(effect.at("evidence").at("held_out_gain"), "held_out_gain");
    EXPECT_NE(effect.at("evidence").at("blocks_improved").get<std::string>().find('/'), std::string::npos);
    expect_number(effect.at("evidence").at("p_value"), "p_value");
    expect_number(effect.at("gap_before"), "gap_before");
    expect_number(effect.at("gap_after"), "gap_after");
    EXPECT_TRUE(effect.at("equivalent").is_array());
    EXPECT_TRUE(effect.at("deciding_experiment").is_string());
    EXPECT_EQ(effect.contains("wins"), !effect.at("equivalent").empty());
    if (effect.contains("wins")) {
      int sum = effect.at("wins").at(effect.at("type").get<std::string>()).get<int>();
      for (const json& rival : effect.at("equivalent"))
        sum += effect.at("wins").at(rival.get<std::string>()).get<int>();
      EXPECT_EQ(sum, effect.at("wins").at("draws").get<int>());
    }
    for (const auto& [name, parameter] : effect.at("parameters").items()) {
      expect_number(parameter.at("value"), name);
      ASSERT_EQ(parameter.at("ci95").size(), 2U) << name;
      expect_number(parameter.at("ci95").at(0), name);
      expect_number(parameter.at("ci95").at(1), name);
      EXPECT_LE(parameter.at("ci95").at(0), parameter.at("value")) << name;
      EXPECT_LE(parameter.at("value"), parameter.at("ci95").at(1)) << name;
    }
  }
  ASSERT_TRUE(gap.at("rejected").is_array());
  for (const json& rejected : gap.at("rejected")) {
    EXPECT_TRUE(rejected.at("type").is_string());
    expect_number(rejected.at("gap_after"), "gap_after");
    // Without a reason one that leaves less of the gap than the result does would look forgotten.
    const std::string reason = rejected.at("reason");
    EXPECT_FALSE(reason.empty());
    if (rejected.at("gap_after") < 0.98 * gap.at("gap").at("searched").get<double>()) {
      EXPECT_EQ(reason.find("takes away less than 2 %"), reason.npos) << rejected;
    }
  }
  ASSERT_TRUE(gap.at("unexplained").is_array());
  for (const json& unexplained : gap.at("unexplained")) {
    expect_where(unexplained.at("where"));
    expect_number(unexplained.at("share"), "share");
  }
}

TEST_F(GapCommand, NamesTheMissingEffectInModelReportNumbersAndWords) {
  for (const char* name : {"data/b.csv", "data/a.csv", "data/c.csv", "held.csv"})
    write(name, recording(static_cast<unsigned char>(name[5])));
  write("data/readme.txt", "no recording");
  ASSERT_EQ(explain("--data " + path("data") + " --held-out " + path("held.csv")), 0) << output_;

  const json gap = json::parse(text_of("out/gap.json"));
  expect_contract(gap);
  EXPECT_EQ(gap.at("held_out"), json({"held.csv"}));
  EXPECT_EQ(gap.at("data"), json({"a.csv", "b.csv", "c.csv"})) << "in the order of their names";
  ASSERT_GE(gap.at("effects").size(), 1U) << gap;
  EXPECT_EQ(gap.at("effects").at(0).at("type"), "viscous") << gap;
  EXPECT_LT(gap.at("gap").at("after"), 0.3 * gap.at("gap").at("before").get<double>());

  const model::effects::DriveModel model = runtime::read_drive_model(directory_ / "out" / "model.toml");
  EXPECT_EQ(model.name, "wheel-1");
  ASSERT_GE(model.effects.size(), 2U);
  EXPECT_NEAR(model::effects::parameter_of(model.effects.at(1), "coefficient_Nm_s_per_rad"), 0.0125, 0.0006);
  const std::string text = text_of("out/model.toml");
  EXPECT_NE(text.find("# added by youbot-gap: takes away "), std::string::npos) << text;
  EXPECT_NE(text.find("# was 0.045; 95 %: "), std::string::npos) << text;
  EXPECT_NE(text.find("coefficient_Nm_s_per_rad = 0.01"), std::string::npos) << text;

  const std::string page = text_of("out/report.html");
  EXPECT_NE(page.find("<h1>Gap of wheel-1: viscous"), std::string::npos);
  for (const char* part : {"Effects found", "Effects tried and rejected", "Left over against velocity",
                           "Velocity in held.csv", "Friction against velocity"})
    EXPECT_NE(page.find(part), std::string::npos) << part;

  EXPECT_TRUE(output_.find("wheel-1: " + gap.at("verdict").get<std::string>() + "\n") != std::string::npos)
      << output_;
  EXPECT_TRUE(said(" N·m on held-out data, noise floor ")) << output_;
  EXPECT_TRUE(said(": coefficient 0.01")) << output_;
  EXPECT_TRUE(said("next: ")) << output_;
  // The first line comes at once, later ones with time.
  EXPECT_TRUE(said("youbot-gap: reading recording 1 of 4\n"))
      << "progress in lines where there is no terminal: " << output_;
  EXPECT_FALSE(said("\r")) << output_;
  for (const auto& entry : fs::directory_iterator(directory_ / "out"))
    EXPECT_NE(entry.path().extension(), ".tmp") << entry;
}

TEST_F(GapCommand, SaysNothingWhenQuietAndTakesItsOwnModelForTheNextRun) {
  const std::string data = write("a.csv", recording(1)) + " " + write("b.csv", recording(2));
  ASSERT_EQ(explain("--quiet --seed 7 --data " + data), 0) << output_;
  EXPECT_EQ(output_, "");
  const json first = json::parse(text_of("out/gap.json"));
  expect_contract(first);
  EXPECT_EQ(first.at("seed"), 7);
  EXPECT_NE(first.at("held_out").dump().find("a.csv"), std::string::npos) << "it says what it set aside";

  const std::string improved = "--model " + path("out/model.toml") + " --data " + data;
  ASSERT_EQ(run(improved + " --out " + path("again")), 0) << output_;
  const json again = json::parse(text_of("again/gap.json"));
  expect_contract(again);
  EXPECT_NEAR(again.at("gap").at("before"), first.at("gap").at("after"),
              0.1 * first.at("gap").at("after").get<double>())
      << "what was left is what is there to explain";

  EXPECT_EQ(run(improved + " --out " + path("out")), 2);
  EXPECT_TRUE(said("out/model.toml is there already and is not replaced")) << output_;
  EXPECT_EQ(json::parse(text_of("out/gap.json")), first);
}

TEST_F(GapCommand, RefusesMistakesOfTheCommandLine) {
  const std::string data = write("data/a.csv", recording(1, "wheel-1", 0.5));
  EXPECT_EQ(run(""), 2);
  EXPECT_TRUE(said("--model")) << output_;
  EXPECT_EQ(explain(""), 2);
  EXPECT_TRUE(said("--data")) << output_;
  EXPECT_EQ(explain("--data " + data + " " + data), 2);
  EXPECT_TRUE(said(data + " is given twice")) << output_;
  EXPECT_EQ(explain("--data " + path("data") + " --held-out " + path("data/../data/a.csv")), 2);
  EXPECT_TRUE(said("a.csv is also in --data")) << output_;
  const std::string copy = path("data/a.mcap");
  (void)runtime::mcap::convert(data, copy);
  EXPECT_EQ(explain("--data " + data + " " + copy), 2);
  EXPECT_TRUE(said(data + " and " + copy + " are one recording")) << output_;
  EXPECT_EQ(explain("--data " + data + " --held-out " + copy), 2);
  EXPECT_TRUE(said("a.mcap is also in --data, as " + data)) << output_;
  fs::remove(copy);
  EXPECT_EQ(explain("--data " + path("missing.csv")), 2);
  EXPECT_TRUE(said("missing.csv: cannot be opened")) << output_;
  fs::create_directories(directory_ / "empty");
  EXPECT_EQ(explain("--data " + path("empty")), 2);
  EXPECT_TRUE(said("there is no .csv, .mcap or .json in " + path("empty"))) << output_;
  EXPECT_EQ(run("--model " + base_ + " --data " + data + " --out " + base_), 3);
  EXPECT_TRUE(said("base.toml: cannot be the directory for the results")) << output_;
  EXPECT_EQ(explain("--seed -1 --data " + data), 2);
  EXPECT_TRUE(said("--seed")) << output_;
  ASSERT_EQ(mkfifo(path("pipe.csv").c_str(), 0600), 0);
  EXPECT_EQ(explain("--data " + path("pipe.csv")), 2);
  EXPECT_TRUE(said("pipe.csv: is not a regular file")) << output_;
  EXPECT_FALSE(fs::exists(directory_ / "out" / "gap.json"));
  EXPECT_EQ(run("--data " + data + " export urdf " + base_ + " --out " + path("exported")), 2);
  EXPECT_TRUE(said("stands before 'export'")) << output_;
  EXPECT_EQ(run("--help"), 0);
  EXPECT_TRUE(said("Exit codes: 0 ")) << output_;
}

TEST_F(GapCommand, ReportsAllMistakesInModelAndRecordingsWithTheirLines) {
  base_ = write("broken.toml",
                "format = \"youbot-drive-model/1\"\ninertia_kg_m2 = 0.0112\ncolour = 3\n"
                "[[effect]]\ntype = \"sugar\"\n");
  const std::string one = write("1.csv", "# youbot recording v1\ntime_s,position_deg\n0,1\n1,nan\n");
  const std::string two = write("2.csv", "# youbot recording v1\ntime_s,position_rad\n0,1\n0,2\n");
  EXPECT_EQ(explain("--data " + one + " --held-out " + two), 2);
  EXPECT_TRUE(said("broken.toml:3: ")) << output_;
  EXPECT_TRUE(said("broken.toml:5: ")) << output_;
  EXPECT_TRUE(said("there are coulomb, viscous, stribeck")) << output_;
  EXPECT_TRUE(said("1.csv:2: column 'position_deg' must be position_rad")) << output_;
  EXPECT_TRUE(said("1.csv:4: ")) << output_;
  EXPECT_TRUE(said("2.csv:4: time_s repeats")) << output_;
  EXPECT_FALSE(fs::exists(directory_ / "out"));
}

TEST_F(GapCommand, RefusesRowsTooFarApartToWorkOnWithTheirLine) {
  std::ostringstream slow;
  slow << "# youbot recording v1\n# sample_rate_Hz: 1000\ntime_s,torque_command_Nm,position_rad\n";
  for (int i = 0; i < 2000; ++i) slow << 1000 * i << ",0.1," << std::sin(0.1 * i) << '\n';
  EXPECT_EQ(explain("--data " + write("slow.csv", slow.str())), 2);
  EXPECT_TRUE(said("slow.csv:5: time_s is 1000 s after the row before")) << output_;
  EXPECT_FALSE(fs::exists(directory_ / "out"));
}

TEST_F(GapCommand, RefusesRecordingsOfSeveralRigs) {
  const std::string one = write("1.csv", recording(1, "wheel-1", 0.5));
  const std::string two = write("2.csv", recording(2, "wheel-2", 0.5));
  EXPECT_EQ(explain("--data " + one + " --held-out " + two), 2);
  EXPECT_TRUE(said("2.csv: is of rig 'wheel-2', but " + one + " is of rig 'wheel-1'")) << output_;
}

TEST_F(GapCommand, SaysWhichExperimentIsMissing) {
  std::ostringstream still;
  still
      << "# youbot recording v1\n# rig: wheel-1\ntime_s,torque_command_Nm,torque_measured_Nm,position_rad\n";
  for (int i = 0; i < 20000; ++i) still << i * 1e-3 << ",0.001," << 0.001 + 1e-4 * (i % 7) << ",0\n";
  EXPECT_EQ(explain("--data " + write("still.csv", still.str())), 2) << output_;
  EXPECT_TRUE(said("staircase") || said("multisine")) << output_;
  EXPECT_TRUE(said(path("still.csv") + ": no recording moves")) << output_;
  EXPECT_EQ(explain("--data " + write("short.csv", recording(1, "wheel-1", 0.05))), 2) << output_;
  EXPECT_TRUE(said(path("short.csv") + ": has 13 rows")) << output_;
  std::ostringstream blind;
  blind << "# youbot recording v1\ntime_s,position_rad\n";
  for (int i = 0; i < 20000; ++i) blind << i * 1e-3 << ',' << std::sin(1e-3 * i) << '\n';
  EXPECT_EQ(explain("--data " + write("blind.csv", blind.str())), 2) << output_;
  EXPECT_TRUE(said("torque_")) << output_;
  EXPECT_FALSE(fs::exists(directory_ / "out" / "gap.json"));
}

}  // namespace youbot_gap_command_test
