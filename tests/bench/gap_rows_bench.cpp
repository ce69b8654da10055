// gap_rows_bench: rows per second and peak memory of youbot-gap, from files to result, on recordings at 1 kHz
// of a drive that lacks a Stribeck curve and a ripple. The search uses four fifths of the rows; the rest is
// held out. A slow machine causes no failure.
#include <fcntl.h>
#include <spawn.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <charconv>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "tests/bench/figures.h"
#include "tests/gap/hidden_experiment.h"
#include "tests/support/built_paths.h"
#include "tests/support/temporary_directory.h"

namespace {

namespace fs = std::filesystem;
using gap_test::Experiment;

struct Options {
  std::vector<double> rows{1e5, 1e6};
  std::vector<std::size_t> files{1};
  bool velocity = false;
  fs::path program = support::program("youbot-gap");
  fs::path keep{};
};

gap_test::Drive hidden_drive() {
  gap_test::Drive drive;
  drive.effects.stribeck_Nm = 0.03;
  drive.effects.cogging_Nm = 0.012;
  return drive;
}

/// Coulomb and viscous friction as they are; what else there is is hidden.
void write_model(const fs::path& path, const gap_test::Drive& drive) {
  std::ofstream file(path);
  file << "format = \"youbot-drive-model/1\"\nname = \"hidden\"\ninertia_kg_m2 = "
       << drive.plant.inertia_kg_m2
       << "\n[sensor]\nencoder_ticks_per_rev = " << drive.sensors.encoder_ticks_per_rev
       << "\n[[effect]]\ntype = \"coulomb\"\ntorque_Nm = " << drive.plant.coulomb_Nm
       << "\n[[effect]]\ntype = \"viscous\"\ncoefficient_Nm_s_per_rad = " << drive.plant.viscous_Nm_s_per_rad
       << '\n';
}

class CsvFile {
 public:
  explicit CsvFile(const fs::path& path, bool velocity) : file_(path, std::ios::binary), velocity_(velocity) {
    file_ << "# youbot recording v1\n# rig: hidden\n# experiment: mixed\n# sample_rate_Hz: 1000\n"
             "time_s,torque_command_Nm,torque_measured_Nm,position_rad"
          << (velocity ? ",velocity_rad_per_s\n" : "\n");
  }
  void add(const gap_test::Row& row) {
    char* at = number(line_.data(), row.time_s, 3, ',');
    at = number(at, row.command_Nm, 6, ',');
    at = number(at, row.measured_Nm, 6, ',');
    at = number(at, row.position_rad, 7, velocity_ ? ',' : '\n');
    if (velocity_) {
      // As a drive's firmware makes it of its encoder.
      const double raw =
          began_ ? (row.position_rad - last_position_rad_) / gap_test::HiddenPlant::kSample_s : 0;
      velocity_rad_per_s_ += 0.2 * (raw - velocity_rad_per_s_);
      last_position_rad_ = row.position_rad;
      began_ = true;
      at = number(at, velocity_rad_per_s_, 6, '\n');
    }
    file_.write(line_.data(), at - line_.data());
  }
  void close() {
    file_.close();
    if (!file_) throw std::runtime_error("a recording cannot be written");
  }

 private:
  char* number(char* at, double value, int digits, char after) {
    at = std::to_chars(at, line_.data() + line_.size() - 1, value, std::chars_format::fixed, digits).ptr;
    *at = after;
    return at + 1;
  }
  std::ofstream file_;
  bool velocity_;
  std::array<char, 256> line_{};
  bool began_ = false;
  double last_position_rad_ = 0;
  double velocity_rad_per_s_ = 0;
};

/// One experiment after another, for so many rows.
void write_recording(const fs::path& path, const gap_test::Drive& drive, std::size_t rows, std::uint64_t seed,
                     bool velocity) {
  constexpr double kLongest_s = 25;
  constexpr std::array kExperiments{Experiment::kStaircase, Experiment::kMultisine, Experiment::kTorqueRamp,
                                    Experiment::kReversals, Experiment::kRandomSteps};
  const double duration_s = static_cast<double>(rows) * gap_test::HiddenPlant::kSample_s;
  const auto count = static_cast<std::size_t>(std::ceil(duration_s / kLongest_s));
  std::vector<gap_test::Run> runs;
  for (std::size_t i = 0; i < count; ++i)
    runs.push_back({.experiment = kExperiments[(seed + i) % kExperiments.size()],
                    .duration_s = duration_s / static_cast<double>(count),
                    .seed = seed * 1000 + i});
  CsvFile file(path, velocity);
  gap_test::simulate(drive, runs, [&](const gap_test::Row& row) { file.add(row); });
  file.close();
}

void write_recordings(const fs::path& directory, const gap_test::Drive& drive, std::size_t rows,
                      std::size_t files, std::uint64_t seed, bool velocity) {
  fs::create_directories(directory);
  for (std::size_t i = 0; i < files; ++i)
    write_recording(directory / ("run-" + std::to_string(i) + ".csv"), drive, rows / files, seed + i,
                    velocity);
}

struct Measured {
  double seconds;
  double processor_s;
  double memory_MB;
  nlohmann::json result;
};
Measured measure(const fs::path& program, const fs::path& directory) {
  fs::remove_all(directory / "out");
  std::vector<std::string> words{program,  "--quiet",          "--model",    directory / "model.toml",
                                 "--data", directory / "data", "--held-out", directory / "held-out",
                                 "--out",  directory / "out"};
  std::vector<char*> argv;
  for (std::string& word : words) argv.push_back(word.data());
  argv.push_back(nullptr);
  const auto begin = std::chrono::steady_clock::now();
  pid_t pid = 0;
  if (posix_spawn(&pid, argv[0], nullptr, nullptr, argv.data(), environ) != 0)
    throw std::runtime_error(words[0] + " cannot be started");
  int status = 0;
  rusage usage{};
  if (wait4(pid, &status, 0, &usage) != pid || !WIFEXITED(status) || WEXITSTATUS(status) != 0)
    throw std::runtime_error(words[0] + " failed");
  const std::chrono::duration<double> took = std::chrono::steady_clock::now() - begin;
  std::ifstream json(directory / "out" / "gap.json");
  const auto seconds = [](const timeval& time) {
    return static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_usec);
  };
  return {took.count(), seconds(usage.ru_utime) + seconds(usage.ru_stime),
          static_cast<double>(usage.ru_maxrss) / 1e3, nlohmann::json::parse(json)};
}

void take_case(const Options& options, double rows, std::size_t files) {
  const support::TemporaryDirectory scratch;
  const fs::path directory = options.keep.empty() ? scratch.path() : options.keep;
  const gap_test::Drive drive = hidden_drive();
  const auto held_out = static_cast<std::size_t>(0.2 * rows);
  const std::size_t held_out_files = std::max<std::size_t>(1, files / 5);
  write_model(directory / "model.toml", drive);
  write_recordings(directory / "data", drive, static_cast<std::size_t>(rows) - held_out,
                   std::max<std::size_t>(1, files - held_out_files), 1, options.velocity);
  write_recordings(directory / "held-out", drive, held_out, held_out_files, 1'000'000, options.velocity);
  const Measured measured = measure(options.program, directory);
  std::string named;
  for (const auto& effect : measured.result.at("effects"))
    (named += ' ') += effect.at("type").get<std::string>();
  std::printf(
      "%9.0f rows in %4zu files: %6.1f s, processor %6.1f s, %8.0f rows/s, %5.0f MB; gap %.5f to %.5f N·m, "
      "noise %.5f;%s\n",
      rows, files + (files == 1), measured.seconds, measured.processor_s, rows / measured.seconds,
      measured.memory_MB, measured.result.at("gap").at("before").get<double>(),
      measured.result.at("gap").at("after").get<double>(), measured.result.at("noise_floor_Nm").get<double>(),
      named.c_str());
  std::fflush(stdout);
  bench::add_figure(
      "youbot-gap: " + bench::number_text(rows / 1e6) + " million rows",
      bench::number_text(measured.seconds) + " s, " + bench::number_text(measured.memory_MB) + " MB",
      "gap_rows_bench, " + std::to_string(files + (files == 1)) + " files, two hidden effects, once");
}

}  // namespace

int main(int argc, char** argv) {
  try {
    Options options;
    CLI::App app("Rows per second and peak memory of youbot-gap.");
    app.add_option("--rows", options.rows, "rows of each case");
    app.add_option("--files", options.files, "files that they come in, each number with each number of rows");
    app.add_flag("--velocity", options.velocity, "with a column of it");
    app.add_option("--program", options.program, "to measure");
    app.add_option("--keep", options.keep, "an existing directory for the files, which stay");
    CLI11_PARSE(app, argc, argv);
    for (const double rows : options.rows)
      for (const std::size_t files : options.files) take_case(options, rows, files);
    return 0;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "gap_rows_bench: %s\n", error.what());
    return 1;
  }
}
