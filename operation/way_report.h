/// @file
/// The page with a recording: the paths of base and end effector, and the workspace limits.
#pragma once
#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "control/workspace.h"
#include "report/report.h"

namespace operation {

/// Keeps a bounded number of points, however long the run. One thread.
class WayReport {
 public:
  struct Way {
    std::string name;
    report::Style style = report::Style::kLine;
  };

  /// With `from_the_side` there is a second plot, of x and z.
  WayReport(std::vector<Way> ways, bool from_the_side, const control::Workspace& workspace);

  /// One cycle: position of each path in W, in their order, NaN if unknown; `limited` as in the record.
  void add(const std::vector<Eigen::Vector3d>& places_W_m, std::uint8_t limited);
  /// @throws hal::SetupError naming path and cause.
  void write(const std::filesystem::path& path) const;

 private:
  report::Plot plot(const std::string& title, Eigen::Index up) const;

  std::vector<Way> ways_;
  bool from_the_side_;
  control::Workspace workspace_;
  std::vector<std::vector<Eigen::Vector3d>> points_W_m_;  // of each path
  std::size_t every_ = 1;                                 // cycles per point
  std::uint64_t cycles_ = 0;
  std::array<std::uint64_t, 8> limited_cycles_{};  // of each bit
};

}  // namespace operation
