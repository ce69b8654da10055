// The n-th failure (practice of SQLite): every system call of a program fails at its n-th call, n = 1, 2, 3 …
// until the program passes without a failure. These programs run in virtual time, without a bus.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "tests/nth_failure/failures.h"
#include "tests/nth_failure/results.h"
#include "tests/support/built_paths.h"
#include "tests/support/process.h"
#include "tests/support/temporary_directory.h"

namespace nth_failure {
namespace {

namespace fs = std::filesystem;
using support::CommandResult;

struct Program {
  std::vector<std::string> words;
  int exit_code = 0;                   ///< without a failure
  fs::path begins_with{};              ///< a folder whose copy it finds as its results
  std::vector<std::string> varying{};  ///< columns of its recordings that no two runs have alike
  std::size_t short_run = 30;          ///< failures of a test run that is not the long one
  bool refusal_leaves_nothing = true;  ///< no files after the exit codes 2 and 3
};

class NthFailure : public testing::Test {
 protected:
  CommandResult run(const Program& program, const std::optional<Failure>& failure) {
    for (const char* left : {"out", "tmp", "counts"}) fs::remove_all(folder / left);
    fs::create_directory(folder / "tmp");
    if (!program.begins_with.empty())
      fs::copy(program.begins_with, folder / "out", fs::copy_options::recursive);
    const CommandResult result =
        support::Process(with_failure(folder / "counts", failure, program.words)).finish();
    counts = read_counts(folder / "counts");
    return result;
  }

  void survives_all(const Program& program) {
    const CommandResult expected = run(program, {});
    ASSERT_EQ(expected.exit_code, program.exit_code) << expected.output;
    const Results results = Results::of(folder / "out");
    std::map<int, int> ends;
    std::set<std::string> calls;
    int runs = 0;
    for (const Failure& failure : some_of(failures_of(counts, 3), program.short_run)) {
      const CommandResult result = run(program, failure);
      ++runs;
      ++ends[result.exit_code];
      calls.insert(failure.call);
      report(failure, result, judge(program, failure, result, results));
    }
    std::string text = std::to_string(runs) + " failures of " + std::to_string(calls.size()) + " calls;";
    for (const auto& [code, times] : ends)
      text += " exit code " + std::to_string(code) + ": " + std::to_string(times) + ",";
    text.back() = '\n';
    std::fputs(text.c_str(), stdout);
  }

  std::vector<std::string> judge(const Program& program, const Failure& failure, const CommandResult& result,
                                 const Results& expected) {
    std::vector<std::string> flaws = flaws_of_end(failure, result, program.exit_code);
    const bool complains = result.said("error:") || result.said("warning:");
    const bool failed = result.exit_code != program.exit_code;
    const Results found = Results::of(folder / "out");
    // Nothing can be taken away then.
    if (failure.call == "unlink" || failure.call == "remove" || failure.call == "rmdir") return flaws;
    const bool refused = failed && result.exit_code != 4;
    if (refused && program.refusal_leaves_nothing && !found.files.empty())
      flaws.push_back("did not begin and left " + found.files.begin()->first);
    for (const std::string& flaw :
         nth_failure::flaws(found, expected, !failed && !complains, program.varying))
      flaws.push_back(flaw);
    return flaws;
  }

  support::TemporaryDirectory folder;
  support::CallCounts counts{};
};

std::vector<std::string> reversals(const fs::path& out) {
  return {support::program("youbot-bench"),
          "reversals",
          "--joint",
          "wheel-1",
          "--period",
          "0.2",
          "--periods",
          "1",
          "--highest",
          "4",
          "--lowest",
          "3",
          "--out",
          out};
}

const std::string kShortPath =
    "[path]\nrest_s = 0.02\nspeed_m_per_s = 0.2\nacceleration_m_per_s2 = 1.0\n[[path.leg]]\nforward_m = "
    "0.01\n";

TEST_F(NthFailure, YoubotdDrivesAPathAndRecordsIt) {
  survives_all({.words = {support::program("youbotd"), "--config", folder.write("path.toml", kShortPath),
                          "--virtual-time", "--record-csv", folder / "out"},
                .varying = {"wake_up_us", "step_us"}});
}

TEST_F(NthFailure, YoubotdComparesTwoRuns) {
  survives_all({.words = {support::program("youbotd"), "--config", folder.write("path.toml", kShortPath),
                          "--virtual-time", "--demo", "--record-csv", folder / "out"},
                .varying = {"wake_up_us", "step_us"},
                .refusal_leaves_nothing = false});  // the first run stays
}

TEST_F(NthFailure, YoubotdIsStoppedByAFaultAndReportsIt) {
  // The mass feedforward is four times too large, and nothing holds the base back.
  survives_all(
      {.words = {support::program("youbotd"), "--config",
                 folder.write(
                     "fast.toml",
                     "[controller]\nstiffness_N_per_m = 0\ndamping_N_s_per_m = 0\n"
                     "feedforward_mass_kg = 200\n[limits]\nforce_N = 50\n"
                     "wheel_speed_rad_per_s = 2.3\n[path]\nrest_s = 0.02\nturn_speed_rad_per_s = 0.01\n"
                     "acceleration_m_per_s2 = 0.2\n"
                     "[[path.leg]]\nforward_m = 1\n"),
                 "--virtual-time", "--record-csv", folder / "out"},
       .exit_code = 4,
       .varying = {"wake_up_us", "step_us"}});
}

TEST_F(NthFailure, YoubotdFollowsAHandAndRecordsIt) {
  survives_all(
      {.words = {support::program("youbotd"), "--config", support::source_dir() + "/apps/youbotd/teleop.toml",
                 "--virtual-time", "--duration", "0.05", "--record-csv", folder / "out"},
       .varying = {"wake_up_us", "step_us"}});
}

TEST_F(NthFailure, YoubotBenchMeasuresAndReports) {
  survives_all({.words = reversals(folder / "out"), .refusal_leaves_nothing = false});
}

TEST_F(NthFailure, YoubotBenchResumes) {
  // A campaign that is complete: all that was written is read and reported again.
  ASSERT_EQ(support::Process(reversals(folder / "measured")).finish().exit_code, 0);
  survives_all({.words = {support::program("youbot-bench"), "reversals", "--resume", folder / "out"},
                .begins_with = folder / "measured",
                .refusal_leaves_nothing = false});
}

TEST_F(NthFailure, YoubotBenchIdentifies) {
  std::string map =
      "# youbot recording v1\n# rig: wheel-1\n# experiment: steady-state-map\n# sample_rate_Hz: 1\n"
      "time_s,velocity_rad_per_s,torque_measured_Nm,torque_ci95_Nm,velocity_command_rad_per_s\n";
  for (int i = 0; i < 20; ++i) {
    const double speed = i < 10 ? i - 10 : i - 9;
    const std::string text = std::to_string(speed);
    map += std::to_string(i) + "," + text + "," + std::to_string(0.02 * speed + (speed < 0 ? -0.05 : 0.05)) +
           ",0.001," + text + "\n";
  }
  survives_all({.words = {support::program("youbot-bench"), "identify", "--map", folder.write("map.csv", map),
                          "--out", folder / "out"},
                .refusal_leaves_nothing = false});
}

/// A drive that rubs more than its model: five seconds to and fro.
std::string drive_that_rubs(double phase) {
  std::string text =
      "# youbot recording v1\n# rig: wheel-1\n# experiment: chirp\n# sample_rate_Hz: 200\n"
      "time_s,torque_measured_Nm,position_rad\n";
  for (int i = 0; i < 1000; ++i) {
    const double time_s = i / 200.0;
    const double angle = 6 * time_s + phase;
    const double velocity_rad_per_s = 3 * std::sin(angle);
    const double torque_Nm =
        0.0112 * 18 * std::cos(angle) + std::copysign(0.25, velocity_rad_per_s) + 0.0125 * velocity_rad_per_s;
    text += std::to_string(time_s) + "," + std::to_string(torque_Nm) + "," +
            std::to_string(-0.5 * std::cos(angle)) + "\n";
  }
  return text;
}

TEST_F(NthFailure, YoubotGapExplains) {
  const fs::path model =
      folder.write("model.toml",
                   "format = \"youbot-drive-model/1\"\nname = \"wheel-1\"\ninertia_kg_m2 = 0.0112\n[sensor]\n"
                   "encoder_ticks_per_rev = 104000\n[[effect]]\ntype = \"coulomb\"\ntorque_Nm = 0.2\n");
  survives_all({.words = {support::program("youbot-gap"), "--quiet", "--model", model, "--data",
                          folder.write("a.csv", drive_that_rubs(0)), "--held-out",
                          folder.write("b.csv", drive_that_rubs(0.7)), "--out", folder / "out"},
                .short_run = 8,
                .refusal_leaves_nothing = false});  // the model stays when its report cannot be written
}

}  // namespace
}  // namespace nth_failure
