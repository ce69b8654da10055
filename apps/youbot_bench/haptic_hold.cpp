#include "apps/youbot_bench/haptic_hold.h"

#include <CLI/CLI.hpp>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <stdexcept>
#include <utility>
#include <vector>

#include "control/point_spring.h"
#include "control/port_energy.h"
#include "drivers/latency_histogram.h"
#include "hal/seconds.h"
#include "hal/setup_error.h"
#include "report/report.h"
#include "runtime/configuration/finite_range.h"
#include "runtime/configuration/shared_tables.h"
#include "runtime/configuration/toml_reader.h"
#include "runtime/log.h"
#include "runtime/open_haptic.h"
#include "runtime/program/build_info.h"
#include "runtime/program/exit_code.h"
#include "runtime/program/stop_on_signals.h"
#include "runtime/real_time.h"
#include "runtime/recording/made_paths.h"
#include "runtime/recording/output_directory.h"
#include "runtime/recording/record_rows.h"
#include "runtime/recording/recording.h"
#include "runtime/recording/started.h"
#include "runtime/robot_session.h"

namespace youbot_bench {
namespace {

using hal::milliseconds;
using hal::seconds;

using Eigen::Vector3d;
using std::chrono::nanoseconds;

constexpr std::chrono::milliseconds kHoldPeriod{1};
constexpr std::chrono::milliseconds kFadeOut{500};
constexpr std::chrono::seconds kReadyTimeout{60};  // for homing
constexpr const char* kRecording = "haptic.csv";
constexpr int kCyclesPerPoint = 10;  // of the report's plots

/// One cycle of it. Plain numbers, because it crosses threads.
struct HoldRecord {
  double time_s = 0.0;
  std::array<double, 3> p_HD_m{};
  std::array<double, 3> v_HD_H_m_per_s{};
  std::array<double, 3> f_D_H_N{};
  double age_s = 0.0;
  double energy_J = 0.0;
  double buttons = 0.0;
};
template <typename Column>
void visit(const HoldRecord& r, Column&& column) {
  const auto vector = [&column](const char* name, const std::array<const char*, 3>& ends,
                                const std::array<double, 3>& numbers, int decimals) {
    for (std::size_t i = 0; i < 3; ++i) column(name, ends[i], numbers[i], decimals);
  };
  column("time_s", "", r.time_s, 6);
  vector("position", {"_x_m", "_y_m", "_z_m"}, r.p_HD_m, 7);
  vector("velocity", {"_x_m_per_s", "_y_m_per_s", "_z_m_per_s"}, r.v_HD_H_m_per_s, 6);
  vector("force", {"_x_N", "_y_N", "_z_N"}, r.f_D_H_N, 5);
  column("age_s", "", r.age_s, 6);
  column("energy_J", "", r.energy_J, 8);
  column("buttons", "", r.buttons, 0);
}

std::array<double, 3> numbers(const Vector3d& v) { return {v.x(), v.y(), v.z()}; }

/// Pulls the loopback's handle aside in one direction after the other, holds it there and releases it.
class Operator {
 public:
  explicit Operator(sim::Hand& hand, const Vector3d& point_m) : hand_(hand), point_m_(point_m) {
    hand_.hold_at(point_m);
  }
  void act(nanoseconds now) noexcept {
    while (now >= next_) {
      constexpr double kAside_m = 0.03;
      const int turn = step_ / 3;
      Vector3d aside_m = Vector3d::Zero();
      aside_m[turn % 3] = turn % 2 == 0 ? kAside_m : -kAside_m;
      switch (step_ % 3) {
        case 0: hand_.move_to(point_m_ + aside_m, std::chrono::seconds(1)); break;
        case 1: hand_.let_go(); break;
        default: hand_.hold_at(point_m_); break;
      }
      next_ += std::chrono::seconds(2);
      ++step_;
    }
  }

 private:
  sim::Hand& hand_;
  Vector3d point_m_;
  nanoseconds next_ = std::chrono::milliseconds(1500);
  int step_ = 0;
};

std::vector<runtime::Recording<HoldRecord>::Table> open(const std::filesystem::path& directory,
                                                        const HapticHoldOptions& options,
                                                        const hal::HapticInfo& device,
                                                        runtime::MadePaths& made) {
  const std::filesystem::path path = directory / kRecording;
  std::vector<runtime::Recording<HoldRecord>::Table> tables;
  tables.push_back({std::make_unique<runtime::RecordingFile>(
      path,
      std::vector<runtime::RecordingFile::Comment>{
          {"rig", "haptic"},
          {"experiment", "haptic-hold"},
          {"device", device.name},
          {"sample_rate_Hz", "1000"},
          {"stiffness_N_per_m", std::to_string(options.stiffness_N_per_m)},
          {"damping_N_s_per_m", std::to_string(options.damping_N_s_per_m)},
          runtime::started_now(),
          {"software", runtime::build_version()}},
      runtime::columns_of(HoldRecord{}))});
  made.add(path);
  return tables;
}

/// haptic.csv, which is removed if it has no rows.
class HoldRecording {
 public:
  HoldRecording(const std::filesystem::path& directory, const HapticHoldOptions& options,
                const hal::HapticInfo& device)
      : recording_(open(directory, options, device, made_), [this](const HoldRecord&) { made_.keep(); }) {}

  /// Cycle, except in virtual time, where the loop must wait for the disk.
  void add(const HoldRecord& record, bool virtual_time) noexcept {
    if (virtual_time) recording_.wait_for_room();
    recording_.add(record);
  }
  void close() {
    recording_.close();
    for (const std::string& problem : recording_.problems()) spdlog::warn("recording: {}", problem);
  }

 private:
  runtime::MadePaths made_;
  runtime::Recording<HoldRecord> recording_;  // last: its thread uses the members above
};

struct Outcome {
  hal::HapticStatus fault;  ///< of the last exchange: the cause of the end, if any
  std::uint64_t samples = 0;
  std::uint64_t saturated = 0;
  drivers::LatencyHistogram age;
  double largest_force_N = 0.0;
  double farthest_m = 0.0;
  double largest_energy_J = 0.0;
  double energy_J = 0.0;
  nanoseconds duration{};
  bool interrupted = false;        ///< by `stop`, before its time was over
  std::vector<HoldRecord> points;  ///< for the plots
};

/// A line of the live display.
struct Line {
  double time_s = 0.0;
  double off_point_mm = 0.0;
  double force_N = 0.0;
  double rate_Hz = 0.0;
  double worst_age_ms = 0.0;
  double energy_mJ = 0.0;
  bool limited = false;
};

void print(const Line& line) {
  std::printf("%8.1f %14.2f %10.3f %10.0f %10.2f %12.3f%s\n", line.time_s, line.off_point_mm, line.force_N,
              line.rate_Hz, line.worst_age_ms, line.energy_mJ, line.limited ? "  limited" : "");
}

class Hold {
 public:
  Hold(const HapticHoldOptions& options, hal::HapticDevice& device, hal::Clock& clock)
      : options_(options), device_(device), clock_(clock) {
    outcome_.points.reserve(static_cast<std::size_t>(options.duration_s * 1000.0 / kCyclesPerPoint) + 64);
  }

  Outcome run(Operator* hand, HoldRecording* recording, const std::atomic<bool>& stop) {
    nanoseconds deadline = clock_.now();
    if (!wait_until_ready(deadline, stop)) return std::move(outcome_);
    const nanoseconds begin = deadline;
    nanoseconds end(static_cast<std::int64_t>(1e9 * options_.duration_s));
    for (std::uint64_t cycle = 0;; ++cycle) {
      deadline += kHoldPeriod;
      clock_.sleep_until(deadline);
      const nanoseconds elapsed = clock_.now() - begin;
      if (!outcome_.interrupted && stop.load(std::memory_order_relaxed)) {
        outcome_.interrupted = true;
        end = std::min(end, elapsed + kFadeOut);
      }
      if (elapsed >= end) break;
      if (hand != nullptr) hand->act(elapsed);
      step(std::clamp(seconds(end - elapsed) / seconds(kFadeOut), 0.0, 1.0));
      const HoldRecord record = this->record(elapsed);
      if (recording != nullptr) recording->add(record, options_.virtual_time);
      if (cycle % kCyclesPerPoint == 0 && outcome_.points.size() < outcome_.points.capacity())
        outcome_.points.push_back(record);
      if (!status_.ok()) break;
      if (elapsed >= reported_ + std::chrono::seconds(1)) report_progress(elapsed);
      const nanoseconds late = clock_.now() - deadline;
      deadline += late / kHoldPeriod * kHoldPeriod;
    }
    teller_.stop();
    outcome_.fault = status_;
    outcome_.duration = clock_.now() - begin;
    outcome_.energy_J = energy_.energy_J();
    return std::move(outcome_);
  }

 private:
  /// Without force, until there is a sample. False with the reason in the outcome.
  bool wait_until_ready(nanoseconds& deadline, const std::atomic<bool>& stop) {
    const nanoseconds begin = deadline;
    for (bool reported = options_.quiet; !has_sample_; clock_.sleep_until(deadline += kHoldPeriod)) {
      status_ = device_.exchange({}, sample_);
      has_sample_ = status_.ok() && status_.age != nanoseconds::max();
      const bool waits = has_sample_ || status_.ok() || status_.fault == hal::HapticFault::kNotReady;
      outcome_.interrupted = stop.load(std::memory_order_relaxed);
      if (waits && outcome_.interrupted) return false;
      if (!waits || deadline - begin > kReadyTimeout) {
        outcome_.fault = status_.ok() ? hal::HapticStatus{hal::HapticFault::kNotReady} : status_;
        return false;
      }
      if (reported || status_.fault != hal::HapticFault::kNotReady ||
          deadline - begin < std::chrono::milliseconds(200))
        continue;
      spdlog::info("{}: {}", device_.info().name, device_.describe(status_));
      reported = true;
    }
    return true;
  }

  void step(double gain) {
    const Vector3d point_m(options_.point_m.data());
    const control::PointSpring spring{gain * options_.stiffness_N_per_m, gain * options_.damping_N_s_per_m};
    const nanoseconds stamp = sample_.stamp;
    status_ =
        device_.exchange({true, spring.force_N(point_m, sample_.p_HD_m, sample_.v_HD_H_m_per_s)}, sample_);
    if (!status_.ok() || sample_.stamp == stamp) return;
    ++outcome_.samples;
    energy_.update(sample_.p_HD_m, status_.f_D_H_N);
    outcome_.age.add(status_.age);
    worst_age_ = std::max(worst_age_, status_.age);
    outcome_.saturated += status_.saturated ? 1U : 0U;
    outcome_.largest_force_N = std::max(outcome_.largest_force_N, status_.f_D_H_N.norm());
    outcome_.farthest_m = std::max(outcome_.farthest_m, (sample_.p_HD_m - point_m).norm());
    outcome_.largest_energy_J = std::max(outcome_.largest_energy_J, energy_.energy_J());
  }

  HoldRecord record(nanoseconds elapsed) const {
    return {.time_s = seconds(elapsed),
            .p_HD_m = numbers(sample_.p_HD_m),
            .v_HD_H_m_per_s = numbers(sample_.v_HD_H_m_per_s),
            .f_D_H_N = numbers(status_.f_D_H_N),
            .age_s = seconds(status_.age),
            .energy_J = energy_.energy_J(),
            .buttons = static_cast<double>(sample_.buttons)};
  }

  /// Once per second. A terminal may be slow, so another thread writes.
  void report_progress(nanoseconds elapsed) noexcept {
    const Vector3d point_m(options_.point_m.data());
    const Line line{
        .time_s = seconds(elapsed),
        .off_point_mm = 1e3 * (sample_.p_HD_m - point_m).norm(),
        .force_N = status_.f_D_H_N.norm(),
        .rate_Hz = static_cast<double>(outcome_.samples - reported_samples_) / seconds(elapsed - reported_),
        .worst_age_ms = milliseconds(std::exchange(worst_age_, {})),
        .energy_mJ = 1e3 * energy_.energy_J(),
        .limited = status_.saturated};
    reported_ = elapsed;
    reported_samples_ = outcome_.samples;
    if (options_.quiet) return;
    if (options_.virtual_time) teller_.wait_for_room();
    teller_.push(line);
  }

  const HapticHoldOptions& options_;
  hal::HapticDevice& device_;
  hal::Clock& clock_;
  control::PortEnergy energy_;
  hal::HapticSample sample_;
  hal::HapticStatus status_;
  bool has_sample_ = false;
  nanoseconds reported_{};
  nanoseconds worst_age_{};
  std::uint64_t reported_samples_ = 0;
  Outcome outcome_;
  runtime::Recorder<Line> teller_{64, print, [] { std::fflush(stdout); }};
};

void write_report(const std::filesystem::path& directory, const HapticHoldOptions& options,
                  const hal::HapticInfo& device, const Outcome& outcome) {
  report::Page page("Haptic device held at a point: " + device.name);
  page.text("A spring of " + std::to_string(static_cast<int>(options.stiffness_N_per_m)) +
            " N/m holds the handle at a point. Pulled away, it returns. Energy is what the motors delivered "
            "to the hand: at or below zero, the hand got back no more than it put in.");
  const std::vector<report::Column> columns{{"quantity"}, {"value"}, {"unit"}};
  page.table(columns,
             {{"largest force", outcome.largest_force_N, "N"},
              {"farthest from the point", 1e3 * outcome.farthest_m, "mm"},
              {"samples a second", static_cast<double>(outcome.samples) / seconds(outcome.duration), "Hz"},
              {"age of a sample, 99.9 %", milliseconds(outcome.age.quantile(0.999)), "ms"},
              {"most energy given to the hand", 1e3 * outcome.largest_energy_J, "mJ"},
              {"energy given to the hand in the end", 1e3 * outcome.energy_J, "mJ"}});
  std::vector<double> time_s;
  std::array<std::vector<double>, 3> place_mm;
  std::array<std::vector<double>, 3> force_N;
  std::vector<double> energy_mJ;
  std::vector<double> age_ms;
  for (const HoldRecord& point : outcome.points) {
    time_s.push_back(point.time_s);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      place_mm[axis].push_back(1e3 * (point.p_HD_m[axis] - options.point_m[axis]));
      force_N[axis].push_back(point.f_D_H_N[axis]);
    }
    energy_mJ.push_back(1e3 * point.energy_J);
    age_ms.push_back(1e3 * point.age_s);
  }
  const report::Axis time{.label = "time", .unit = "s", .link = "time"};
  const auto axes = [&time_s](const std::array<std::vector<double>, 3>& values) {
    return std::vector<report::Series>{{"x, towards the operator", time_s, values[0]},
                                       {"y, to the right", time_s, values[1]},
                                       {"z, up", time_s, values[2]}};
  };
  page.plot({.title = "Position of the handle",
             .x = time,
             .y = {"from the point", "mm"},
             .series = axes(place_mm)});
  page.plot({.title = "Force on the hand", .x = time, .y = {"force", "N"}, .series = axes(force_N)});
  page.plots({{.title = "Energy given to the hand",
               .x = time,
               .y = {"energy", "mJ"},
               .series = {{"energy", time_s, energy_mJ}}},
              {.title = "Age of the newest sample",
               .x = time,
               .y = {.label = "age", .unit = "ms", .from = 0},
               .series = {{"age", time_s, age_ms}}}});
  page.write(directory / "report.html");
}

void print_summary(const Outcome& outcome) {
  std::printf(
      "\nheld for %.1f s: largest force %.2f N, farthest from the point %.1f mm\n"
      "%.0f samples a second, age median %.2f ms, 99.9 %% within %.2f ms, %.2f ms at most\n"
      "energy given to the hand: %.2f mJ at most, %.2f mJ in the end\n",
      seconds(outcome.duration), outcome.largest_force_N, 1e3 * outcome.farthest_m,
      static_cast<double>(outcome.samples) / seconds(outcome.duration),
      milliseconds(outcome.age.quantile(0.5)), milliseconds(outcome.age.quantile(0.999)),
      milliseconds(outcome.age.worst()), 1e3 * outcome.largest_energy_J, 1e3 * outcome.energy_J);
  if (outcome.saturated > 0)
    std::printf("force limited in %llu of %llu samples\n", static_cast<unsigned long long>(outcome.saturated),
                static_cast<unsigned long long>(outcome.samples));
}

runtime::HapticOptions load_options(const HapticHoldOptions& options) {
  runtime::HapticOptions haptic;
  if (!options.config.empty()) {
    const std::filesystem::path path(options.config);
    runtime::TomlFile file = runtime::TomlFile::parse(path);
    runtime::TomlTable root = file.root();
    runtime::TomlTable table = root.table("haptic");
    runtime::read_haptic(table, path.parent_path(), haptic);
    runtime::leave_to_others(root, {"haptic"});
    file.finish();
  }
  if (!options.haptic.empty()) haptic.name = options.haptic;
  if (options.virtual_time && !runtime::is_simulated_haptic(haptic.name))
    throw std::invalid_argument("--virtual-time: " + haptic.name + " lives in real time");
  return haptic;
}

/// Whether this thread, and therefore the device's, may be real-time.
void prepare_real_time(const HapticHoldOptions& options, runtime::HapticOptions& haptic) {
  std::string all;
  runtime::RealTimeThread attempt;  // released at once
  for (const std::string& problem : attempt.enter({})) all += "\n  " + problem;
  if (all.empty()) return;
  if (!options.allow_non_real_time)
    throw hal::SetupError(
        "haptic-hold", "become real-time",
        "do what follows, or run with --allow-non-rt and a hand on the device's switch:" + all);
  spdlog::warn("not real-time:{}", all);
  haptic.thread.fifo_priority = 0;
}

}  // namespace

int haptic_hold(const HapticHoldOptions& options, const std::atomic<bool>& stop) {
  runtime::HapticOptions haptic = load_options(options);
  runtime::bear_pauses(haptic);
  runtime::MadePaths made;
  if (!options.out.empty()) {
    runtime::require_no_results(options.out, {kRecording, "report.html"});
    made.add(runtime::make_output_directory(options.out));
  }
  if (!options.virtual_time) prepare_real_time(options, haptic);
  const std::unique_ptr<hal::Clock> clock = runtime::make_clock(options.virtual_time);
  const runtime::OpenedHaptic opened = runtime::open_haptic(haptic, *clock, kHoldPeriod);
  std::unique_ptr<Operator> hand;
  if (opened.hand) hand = std::make_unique<Operator>(*opened.hand, Vector3d(options.point_m.data()));

  std::unique_ptr<HoldRecording> recording;
  Outcome outcome;
  {
    const runtime::HapticActivation activation(*opened.device);
    const hal::HapticInfo& info = opened.device->info();
    if (!options.quiet) {
      spdlog::info("{}: {}, {:g} N at most{}", runtime::build_version(), info.name, info.force_limit_N,
                   options.virtual_time ? ", virtual time" : "; Ctrl-C stops");
      for (const std::string& warning : info.warnings) spdlog::warn("{}: {}", info.name, warning);
      std::printf("%8s %14s %10s %10s %10s %12s\n", "time s", "off point mm", "force N", "rate Hz", "age ms",
                  "energy mJ");
    }
    if (!options.out.empty()) recording = std::make_unique<HoldRecording>(options.out, options, info);
    Hold hold(options, *opened.device, *clock);
    runtime::RealTimeThread real_time;
    if (!options.virtual_time) (void)real_time.enter({});  // a refusal was already logged
    outcome = hold.run(hand.get(), recording.get(), stop);
  }
  if (recording) recording->close();
  const bool measured = outcome.samples > 0;
  if (measured) made.keep();
  if (measured && !options.out.empty()) write_report(options.out, options, opened.device->info(), outcome);
  if (measured && !options.quiet) {
    print_summary(outcome);
    if (!options.out.empty()) std::printf("recorded in %s\n", options.out.c_str());
  }
  if (outcome.interrupted && outcome.fault.ok()) return runtime::kExitInterrupted;
  if (measured && outcome.fault.ok()) return runtime::kExitOk;
  spdlog::error("{}: stopped by a fault: {}", opened.device->info().name,
                opened.device->describe(outcome.fault));
  return runtime::kExitFault;
}

Subcommand add_haptic_hold(CLI::App& app) {
  const auto options = std::make_shared<HapticHoldOptions>();
  CLI::App* const command = app.add_subcommand(
      "haptic-hold", "hold the handle of a haptic device at a point by springs. THIS PUSHES ON A HAND");
  command->add_option(
      "--haptic", options->haptic,
      "loopback, force-dimension or omega.6, falcon, spacemouse; none: the file's, else loopback");
  command->add_option("--config", options->config, "TOML file with a [haptic] table");
  command->add_option("--stiffness", options->stiffness_N_per_m, "N/m")
      ->check(runtime::finite_range(0.0, kMaxHoldStiffness_N_per_m))
      ->capture_default_str();
  command->add_option("--damping", options->damping_N_s_per_m, "N·s/m")
      ->check(runtime::finite_range(0.0, kMaxHoldDamping_N_s_per_m))
      ->capture_default_str();
  command
      ->add_option("--point", options->point_m,
                   "x y z in m, from the device's origin: x towards the operator, y to the right, z up")
      ->check(runtime::finite_range(-0.2, 0.2))
      ->capture_default_str();
  command->add_option("--duration", options->duration_s, "seconds")
      ->check(runtime::finite_range(0.1, 3600.0))
      ->capture_default_str();
  command->add_option("--out", options->out, "directory for haptic.csv and report.html");
  command->add_flag("--virtual-time", options->virtual_time, "as fast as the machine allows (loopback)");
  command->add_flag("--allow-non-rt", options->allow_non_real_time,
                    "continue when the system refuses real-time scheduling or memory locking");
  command->add_flag("--quiet", options->quiet, "print problems only");
  return {command, [options] {
            runtime::stop_on_signals();
            return haptic_hold(*options, runtime::stop_requested);
          }};
}

}  // namespace youbot_bench
