/// @file
/// What a report shows of a run, in bounded memory however long the run.
#pragma once
#include <Eigen/Core>
#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "report/report.h"

namespace operation {

/// Values over time: of each stretch of time the lowest and the highest value of a channel, at their times,
/// so that no peak is lost. One thread.
class TimeTrace {
 public:
  explicit TimeTrace(std::size_t channels) : channels_(channels) {}

  /// A value for each channel; non-finite ones are gaps.
  void add(double time_s, std::span<const double> values);
  /// One channel; `factor` for another unit, rounded to `decimals`.
  report::Series series(std::string name, std::size_t channel, int decimals, double factor = 1.0,
                        report::Style style = report::Style::kLine) const;

 private:
  static constexpr std::size_t kMaxStretches = 1000;
  struct Extremes {
    double begin_s;
    double low;  // NaN: no finite value
    double low_s;
    double high;
    double high_s;
  };
  void halve();

  std::size_t channels_;
  std::vector<Extremes> extremes_;  // of each stretch, each channel
  std::size_t stretches_ = 0;
  std::size_t samples_per_stretch_ = 1;
  std::size_t samples_ = 0;  // in the last stretch
};

/// A path: points a distance apart that grows with the length of the path. One thread.
class Track {
 public:
  /// A point that is not finite is a gap.
  void add(const Eigen::Vector3d& p_m);
  /// In the plane of x and the axis `up`: 1 y, 2 z.
  report::Series series(std::string name, Eigen::Index up, report::Style style) const;
  bool empty() const noexcept { return points_m_.empty(); }

 private:
  static constexpr std::size_t kMaxPoints = 3000;
  static constexpr std::size_t kMaxGaps = 500;  // later ones are joined

  std::vector<Eigen::Vector3d> points_m_;
  Eigen::Vector3d last_m_ = Eigen::Vector3d::Zero();
  std::size_t gaps_ = 0;
  double spacing_m_ = 0.5e-3;
};

}  // namespace operation
