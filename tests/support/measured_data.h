/// @file
/// Real measurements under tests/data; their README.md files document the sources.
#pragma once
#include <cmath>
#include <fstream>
#include <map>
#include <stdexcept>
#include <string>
#include <vector>

#include "identification/fit/static_map.h"
#include "tests/support/built_paths.h"

namespace test_support {

/// Rows of a plain CSV file with one row of names, as text fields.
inline std::vector<std::vector<std::string>> csv_rows(const std::string& path) {
  std::ifstream file(path);
  if (!file) throw std::runtime_error(path + ": cannot be read");
  std::vector<std::vector<std::string>> rows;
  std::string line;
  std::getline(file, line);
  while (std::getline(file, line)) {
    rows.emplace_back();
    std::size_t from = 0;
    for (std::size_t comma = 0; comma != std::string::npos; from = comma + 1) {
      comma = line.find(',', from);
      rows.back().push_back(line.substr(from, comma == std::string::npos ? comma : comma - from));
    }
  }
  return rows;
}

/// The mean of each run of a screw drive, as in the paper in its README. The interval is from ten stretches
/// of the run, because its samples are not independent.
inline identification::fit::StaticMap screw_drive_map(int drive) {
  struct Run {
    std::vector<double> velocity;
    std::vector<double> torque;
  };
  std::map<double, Run> runs;
  for (const auto& row : csv_rows(support::source_dir() + "/tests/data/tro2021_screw_drives/drive" +
                                  std::to_string(drive) + "_steady_state.csv")) {
    Run& run = runs[std::stod(row[0])];
    run.velocity.push_back(std::stod(row[2]));
    run.torque.push_back(std::stod(row[3]));
  }
  const auto mean = [](const std::vector<double>& values, std::size_t from, std::size_t to) {
    double sum = 0;
    for (std::size_t i = from; i < to; ++i) sum += values[i];
    return sum / static_cast<double>(to - from);
  };
  identification::fit::StaticMap map{"tro2021-drive-" + std::to_string(drive), {}};
  for (const auto& [label, run] : runs) {
    constexpr std::size_t kStretches = 10;
    const std::size_t n = run.torque.size();
    const double whole = mean(run.torque, 0, n);
    double square = 0;
    for (std::size_t s = 0; s < kStretches; ++s) {
      const double part = mean(run.torque, s * n / kStretches, (s + 1) * n / kStretches) - whole;
      square += part * part;
    }
    constexpr double kStudent = 2.262;  // 9 degrees of freedom, 95 %
    const double ci95 = kStudent * std::sqrt(square / (kStretches * (kStretches - 1.0)));
    map.points.push_back({mean(run.velocity, 0, n), whole, ci95});
  }
  return map;
}

}  // namespace test_support
