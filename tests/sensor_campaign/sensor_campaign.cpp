/// @file
/// The proof of the sensor checks: what they see, how soon, and that they do not err. In virtual time, judged
/// by the simulated plant.
///
///     sensor_campaign --detect
///     sensor_campaign --soak --hours 10 --seed 1
#include <gtest/gtest.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <stdexcept>
#include <string>
#include <vector>

#include "runtime/program/run_app.h"
#include "tests/sensor_campaign/detection.h"
#include "tests/sensor_campaign/sensor_faults.h"
#include "tests/sensor_campaign/soak.h"

namespace sensor_campaign {
namespace {

void print(const std::string& fault, const std::string& place, Motion motion, const Detection& d) {
  std::printf("%-21s %-8s %-10s %3d %4d %5d %5d %5d %6d %4d %6.0f %6.0f %7.3f %6.3f %7.3f %6.3f\n",
              fault.c_str(), place.c_str(), name_of(motion).c_str(), d.runs, d.seen, d.named, d.misnamed,
              d.ended, d.beyond, d.late, 1000 * d.longest_s, 1000 * d.longest_apparent_s, d.travel.m,
              d.travel.rad, d.astray.m, d.astray.rad);
}

void run_detection(const Conditions& conditions, const std::string& only) {
  std::vector<SensorFault> faults = factors();
  for (const SensorFault& fault : other_faults()) faults.push_back(fault);
  if (!only.empty()) std::erase_if(faults, [&](const SensorFault& fault) { return fault.name != only; });
  if (faults.empty()) throw std::invalid_argument("no fault \"" + only + "\"");
  const std::vector<DetectionCase> cases = detection_cases(faults);
  const std::vector<Detection> results = detect(cases, conditions);
  std::printf(
      "Detection, seed %u. other: another joint is named; ended: by something else than the sensor checks. "
      "Time and travel: of those seen,\n"
      "from the first lie on. Astray: of all, from where the robot is then when no sensor lies; beyond: "
      "runs\n"
      "that came further astray than 0.1 m or 0.2 rad. From wrong: from when a reading was wrong by more "
      "than\n"
      "a working sensor may be; late: runs in which that lasted for more than 60 ms, seen or not.\n\n"
      "%-21s %-8s %-10s %3s %4s %5s %5s %5s %6s %4s %6s %6s %7s %6s %7s %6s\n",
      conditions.seed, "fault", "place", "motion", "n", "seen", "named", "other", "ended", "beyond", "late",
      "ms", "wrong", "m", "rad", "astr.m", "rad");
  for (std::size_t i = 0; i < cases.size(); ++i)
    print(cases[i].fault.name, joint_name(cases[i].joint), cases[i].motion, results[i]);
  std::printf("\nIn all places\n");
  for (const SensorFault& fault : faults)
    for (const std::size_t first : {std::size_t{0}, kWheels})
      for (const Motion motion : motions_of(first)) {
        Detection sum;
        for (std::size_t i = 0; i < cases.size(); ++i)
          if (cases[i].fault.name == fault.name && cases[i].motion == motion) sum.add(results[i]);
        if (sum.runs == 0) continue;
        print(fault.name, first == 0 ? "wheels" : "arm", motion, sum);
      }
}

control::ChecksOff without(const std::vector<std::string>& names) {
  const auto& known = control::kPlausibilityCheckNames;
  control::ChecksOff off;
  for (const std::string& name : names)
    off.add(static_cast<control::PlausibilityCheck>(std::ranges::find(known, name) - known.begin()));
  return off;
}

/// True: without false alarm.
bool run_soak(double hours, std::uint32_t seed, const std::string& only, bool busy,
              const control::ChecksOff& off) {
  SoakResult sum;
  sum.scenario = "all";
  std::printf("Soak, seed %u\n\n%-36s %7s %6s %12s %10s\n", seed, "scenario", "hours", "runs", "false alarms",
              "other ends");
  const auto print_row = [](const SoakResult& row) {
    std::printf("%-36s %7.2f %6d %12d %10d\n", row.scenario.c_str(), row.hours, row.runs, row.false_alarms,
                row.other_ends);
  };
  for (const SoakResult& row : soak(hours, seed, only, busy, off)) {
    print_row(row);
    for (const std::string& alarm : row.alarms) std::printf("    %s\n", alarm.c_str());
    sum.hours += row.hours;
    sum.runs += row.runs;
    sum.false_alarms += row.false_alarms;
    sum.other_ends += row.other_ends;
  }
  print_row(sum);
  return sum.false_alarms == 0;
}

}  // namespace
}  // namespace sensor_campaign

int main(int argc, char** argv) {
  CLI::App app{"Shows what the checks of the sensors see, and that they do not err", "sensor_campaign"};
  bool detect = false;
  bool soak = false;
  bool busy = false;
  int late_ms = 0;
  double hours = 10.0;
  std::uint32_t seed = 1;
  std::string only;
  std::vector<std::string> off;
  app.add_flag("--detect", detect, "every fault of a sensor, at every joint, in every motion");
  app.add_flag("--soak", soak, "hours with true sensors; exit code 1 after a false alarm");
  app.add_option("--late", late_ms, "of the detection: each answer comes up to so many ms late")
      ->check(CLI::Range(0, 19));
  app.add_flag("--busy", busy, "the soak's bus is held up by a busy machine at both ends");
  app.add_option("--hours", hours, "of the soak, in virtual time")->check(CLI::Range(0.001, 10'000.0));
  app.add_option("--seed", seed, "equal seeds give equal results");
  app.add_option("--only", only, "the fault, or the soak's scenario, of this name");
  app.add_option("--off", off, "without this check; hall_agreement: as where no Hall sensors are read")
      ->check(CLI::IsMember(std::vector<std::string>(control::kPlausibilityCheckNames.begin(),
                                                     control::kPlausibilityCheckNames.end())));
  return runtime::run_app(app, argc, argv, [&] {
    if (!detect && !soak) throw CLI::RequiredError("--detect or --soak");
    if (detect)
      sensor_campaign::run_detection(
          {seed, std::chrono::milliseconds(late_ms), sensor_campaign::without(off)}, only);
    const bool quiet =
        !soak || sensor_campaign::run_soak(hours, seed, only, busy, sensor_campaign::without(off));
    // Violations of a robot's invariant checks were printed when they were found.
    const bool safe = !testing::UnitTest::GetInstance()->ad_hoc_test_result().Failed();
    return quiet && safe ? 0 : 1;
  });
}
