#include "operation/run_trace.h"

#include <cmath>
#include <limits>
#include <utility>

namespace operation {
namespace {

constexpr double kGap = std::numeric_limits<double>::quiet_NaN();

double rounded(double value, int decimals) {
  const double scale = std::pow(10.0, decimals);
  return std::round(value * scale) / scale;
}

/// Appends a point. One between two equal ones is left out, and so is a second gap.
void append(report::Series& series, double x, double y) {
  const auto same = [](double a, double b) { return a == b || (std::isnan(a) && std::isnan(b)); };
  const std::size_t count = series.y.size();
  if (count >= 2 && same(series.y[count - 1], y) && same(series.y[count - 2], y)) {
    series.x.back() = x;
    return;
  }
  series.x.push_back(x);
  series.y.push_back(y);
}

}  // namespace

void TimeTrace::add(double time_s, std::span<const double> values) {
  if (samples_ == samples_per_stretch_ || stretches_ == 0) {
    if (stretches_ == kMaxStretches) halve();
    ++stretches_;
    extremes_.resize(stretches_ * channels_, {time_s, kGap, time_s, kGap, time_s});
    samples_ = 0;
  }
  ++samples_;
  Extremes* const last = &extremes_[(stretches_ - 1) * channels_];
  for (std::size_t i = 0; i < channels_; ++i) {
    const double value = values[i];
    if (!std::isfinite(value)) continue;
    // Negated, so that the first value is taken.
    if (!(value >= last[i].low)) {
      last[i].low = value;
      last[i].low_s = time_s;
    }
    if (!(value <= last[i].high)) {
      last[i].high = value;
      last[i].high_s = time_s;
    }
  }
}

/// Joins stretches in pairs.
void TimeTrace::halve() {
  for (std::size_t stretch = 0; stretch < kMaxStretches / 2; ++stretch)
    for (std::size_t i = 0; i < channels_; ++i) {
      Extremes joined = extremes_[2 * stretch * channels_ + i];
      const Extremes& second = extremes_[(2 * stretch + 1) * channels_ + i];
      if (!(second.low >= joined.low) && !std::isnan(second.low)) {
        joined.low = second.low;
        joined.low_s = second.low_s;
      }
      if (!(second.high <= joined.high) && !std::isnan(second.high)) {
        joined.high = second.high;
        joined.high_s = second.high_s;
      }
      extremes_[stretch * channels_ + i] = joined;
    }
  stretches_ = kMaxStretches / 2;
  extremes_.resize(stretches_ * channels_);
  samples_per_stretch_ *= 2;
}

report::Series TimeTrace::series(std::string name, std::size_t channel, int decimals, double factor,
                                 report::Style style) const {
  report::Series series{.name = std::move(name), .x = {}, .y = {}, .style = style};
  for (std::size_t stretch = 0; stretch < stretches_; ++stretch) {
    const Extremes& of = extremes_[stretch * channels_ + channel];
    if (std::isnan(of.low)) {
      append(series, rounded(of.begin_s, 4), kGap);
      continue;
    }
    const bool rises = of.low_s <= of.high_s;
    const std::pair first = rises ? std::pair(of.low_s, of.low) : std::pair(of.high_s, of.high);
    const std::pair second = rises ? std::pair(of.high_s, of.high) : std::pair(of.low_s, of.low);
    append(series, rounded(first.first, 4), rounded(factor * first.second, decimals));
    if (second.first > first.first)
      append(series, rounded(second.first, 4), rounded(factor * second.second, decimals));
  }
  return series;
}

void Track::add(const Eigen::Vector3d& p_m) {
  last_m_ = p_m;
  const auto is_gap = [](const Eigen::Vector3d& point_m) { return !point_m.allFinite(); };
  const bool after_gap = points_m_.empty() || is_gap(points_m_.back());
  if (is_gap(p_m)) {
    if (after_gap || gaps_ == kMaxGaps) return;
    ++gaps_;
    points_m_.emplace_back(Eigen::Vector3d::Constant(kGap));
    return;
  }
  if (!after_gap && (p_m - points_m_.back()).norm() < spacing_m_) return;
  points_m_.push_back(p_m);
  // With a wide enough spacing only gaps and the points after them are left, which are fewer.
  while (points_m_.size() >= kMaxPoints) {
    spacing_m_ *= 2;
    std::vector<Eigen::Vector3d> kept_m;
    for (const Eigen::Vector3d& point_m : points_m_)
      if (is_gap(point_m) || kept_m.empty() || is_gap(kept_m.back()) ||
          (point_m - kept_m.back()).norm() >= spacing_m_)
        kept_m.push_back(point_m);
    points_m_ = std::move(kept_m);
  }
}

report::Series Track::series(std::string name, Eigen::Index up, report::Style style) const {
  constexpr int kDecimals = 5;
  report::Series series{.name = std::move(name), .x = {}, .y = {}, .style = style};
  const auto add = [&](const Eigen::Vector3d& p_m) {
    series.x.push_back(rounded(p_m.x(), kDecimals));
    series.y.push_back(rounded(p_m[up], kDecimals));
  };
  for (const Eigen::Vector3d& p_m : points_m_) add(p_m);
  if (!points_m_.empty() && last_m_.allFinite()) add(last_m_);
  return series;
}

}  // namespace operation
