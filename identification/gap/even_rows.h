/// @file
/// The columns of a recording at even steps in time, as filters and derivatives need them.
#pragma once
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "identification/gap/gap.h"

namespace identification::gap {

/// Measurements are curved; a command jumps.
enum class Between : std::uint8_t { kLine, kCurve };

/// Values at `count` times, `period_s` apart, from the first of ascending `time_s` on: on a line between
/// neighbours, or cubic with the slopes of parabolas through three samples: motion has no corners, and after
/// two derivatives they would be visible. The end values are held.
std::vector<double> interpolated(std::span<const double> time_s, std::span<const double> values,
                                 double period_s, std::size_t count, Between between);

/// As many rows as the recording has, at its mean rate. A sample counts at its time; if the motion is
/// smoother at even steps, and the times follow these closely, sampling is even and only the times were
/// written late.
class EvenRows {
 public:
  /// `source` has a row or more.
  explicit EvenRows(const Source& source);

  double period_s() const noexcept { return period_s_; }
  /// At which the rows were sampled.
  const std::vector<double>& sampled_at_s() const noexcept { return sampled_at_s_; }
  /// The even row next to a sample.
  std::size_t next_to(std::size_t sample) const;
  /// A column of the recording at even steps; unchanged if its rows are even.
  std::vector<double> of(std::span<const double> values, Between between) const;

 private:
  double period_s_;
  std::vector<double> sampled_at_s_;
  bool even_;
};

}  // namespace identification::gap
