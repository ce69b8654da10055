#include "tests/faults/recording_check.h"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <sstream>

namespace faults {
namespace {

/// A sensor's count and the decimals of the file.
constexpr double kResolution_rad = 2e-4;

std::vector<std::string> cells(const std::string& line) {
  std::vector<std::string> all;
  std::istringstream stream(line);
  for (std::string cell; std::getline(stream, cell, ',');) all.push_back(cell);
  return all;
}

}  // namespace

void TrueMotion::add(World& world) {
  Moment& moment = moments_.emplace_back();
  moment.at = world.now();
  for (std::size_t joint = 0; joint < world.joints(); ++joint)
    moment.position_rad[joint] = world.emulation().position_rad(joint);
}

std::size_t TrueMotion::index_of(nanoseconds time) const {
  const auto found = std::ranges::lower_bound(moments_, time, {}, &Moment::at);
  return static_cast<std::size_t>(found - moments_.begin());
}

bool TrueMotion::was_at(std::size_t joint, nanoseconds time, double from_start_rad, nanoseconds start) const {
  // Two periods before and after, and as much as it moves in between.
  constexpr std::size_t kPeriods = 2;
  const std::size_t begin = index_of(start);
  const std::size_t at = index_of(time);
  const std::size_t last = moments_.size() - 1;
  double least = 1e9;
  double most = -1e9;
  for (std::size_t i = at - std::min(at, kPeriods); i <= std::min(at + kPeriods, last); ++i)
    for (std::size_t s = begin - std::min(begin, kPeriods); s <= std::min(begin + kPeriods, last); ++s) {
      const double moved = moments_[i].position_rad[joint] - moments_[s].position_rad[joint];
      least = std::min(least, moved);
      most = std::max(most, moved);
    }
  return from_start_rad > least - kResolution_rad && from_start_rad < most + kResolution_rad;
}

std::vector<std::string> TrueMotion::compare(const std::filesystem::path& folder,
                                             bool samples_are_true) const {
  std::vector<std::string> problems;
  std::size_t found = 0;
  for (std::size_t run = 1; run <= first_cycles_.size(); ++run)
    for (const char* name : {"base.csv", "teleoperation.csv"}) {
      const std::filesystem::path file = folder / ("run-" + std::to_string(run)) / name;
      if (!std::filesystem::exists(file)) continue;
      ++found;
      compare_file(file, first_cycles_[run - 1], samples_are_true, problems);
    }
  if (samples_are_true && found != first_cycles_.size())
    problems.push_back(std::to_string(first_cycles_.size()) + " runs have " + std::to_string(found) +
                       " recordings");
  return problems;
}

void TrueMotion::compare_file(const std::filesystem::path& file, nanoseconds first_cycle,
                              bool samples_are_true, std::vector<std::string>& problems) const {
  const std::string name = file.parent_path().filename().string() + "/" + file.filename().string();
  std::ifstream stream(file);
  std::vector<std::string> header;
  std::vector<std::size_t> positions;
  std::vector<double> first_rad;
  double last_s = -1;
  std::size_t rows = 0;
  for (std::string line; std::getline(stream, line);) {
    if (line.starts_with('#')) continue;
    const std::vector<std::string> row = cells(line);
    if (header.empty()) {
      header = row;
      for (std::size_t i = 0; i < header.size(); ++i)
        // Homing gives the arm another zero in the midst of a run.
        if (header[i].starts_with("wheel") && header[i].ends_with("_position_rad")) positions.push_back(i);
      continue;
    }
    if (row.size() != header.size() || stream.eof()) {
      problems.push_back(name + ": row " + std::to_string(rows) + " is torn");
      return;
    }
    const double time_s = std::stod(row[0]);
    if (!(time_s > last_s)) problems.push_back(name + ": time stands still at " + row[0]);
    last_s = time_s;
    ++rows;
    if (!samples_are_true) continue;
    const auto time = first_cycle + nanoseconds(std::llround(1e9 * time_s));
    for (std::size_t joint = 0; joint < positions.size(); ++joint) {
      const double position_rad = std::stod(row[positions[joint]]);
      if (first_rad.size() == joint) first_rad.push_back(position_rad);
      if (!was_at(joint, time, position_rad - first_rad[joint], first_cycle)) {
        problems.push_back(name + ": at " + row[0] + " s joint " + std::to_string(joint + 1) +
                           " was not at " + row[positions[joint]]);
        return;
      }
    }
  }
  if (samples_are_true && rows == 0 && first_cycle.count() >= 0) problems.push_back(name + ": no rows");
}

}  // namespace faults
