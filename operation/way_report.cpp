#include "operation/way_report.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "operation/cycle_record.h"

namespace operation {
namespace {

constexpr std::size_t kMaxPoints = 20'000;
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

/// Limits of a box in the plane of x and another axis, each a line with a gap after it. A line without limits
/// on all sides ends where the paths end.
class Walls {
 public:
  Walls(std::string name, double overhang_m)
      : series_{.name = std::move(name), .x = {}, .y = {}, .style = report::Style::kDashed},
        overhang_m_(overhang_m) {}

  void add(const Eigen::Vector2d& lower_m, const Eigen::Vector2d& upper_m,
           const Eigen::Vector2d& ways_lower_m, const Eigen::Vector2d& ways_upper_m) {
    Eigen::Vector2d from_m = lower_m;
    Eigen::Vector2d to_m = upper_m;
    for (Eigen::Index i = 0; i < 2; ++i) {
      if (!std::isfinite(from_m[i])) from_m[i] = ways_lower_m[i] - overhang_m_;
      if (!std::isfinite(to_m[i])) to_m[i] = ways_upper_m[i] + overhang_m_;
    }
    for (const double x_m : {lower_m.x(), upper_m.x()}) line({x_m, from_m.y()}, {x_m, to_m.y()});
    for (const double y_m : {lower_m.y(), upper_m.y()}) line({from_m.x(), y_m}, {to_m.x(), y_m});
  }
  const report::Series& series() const noexcept { return series_; }

 private:
  void line(const Eigen::Vector2d& from_m, const Eigen::Vector2d& to_m) {
    if (!from_m.allFinite() || !to_m.allFinite()) return;
    for (const auto& [x_m, y_m] :
         {std::pair{from_m.x(), from_m.y()}, std::pair{to_m.x(), to_m.y()}, std::pair{to_m.x(), kNaN}}) {
      series_.x.push_back(x_m);
      series_.y.push_back(y_m);
    }
  }

  report::Series series_;
  double overhang_m_;
};

}  // namespace

WayReport::WayReport(std::vector<Way> ways, bool from_the_side, const control::Workspace& workspace)
    : ways_(std::move(ways)),
      from_the_side_(from_the_side),
      workspace_(workspace),
      points_W_m_(ways_.size()) {}

void WayReport::add(const std::vector<Eigen::Vector3d>& places_W_m, std::uint8_t limited) {
  for (std::size_t bit = 0; bit < limited_cycles_.size(); ++bit) limited_cycles_[bit] += limited >> bit & 1U;
  if (cycles_++ % every_ != 0) return;
  for (std::size_t i = 0; i < ways_.size(); ++i) points_W_m_[i].push_back(places_W_m.at(i));
  if (points_W_m_.front().size() < kMaxPoints) return;
  // Drops every second one.
  for (std::vector<Eigen::Vector3d>& points_m : points_W_m_) {
    for (std::size_t i = 0; i < points_m.size() / 2; ++i) points_m[i] = points_m[2 * i];
    points_m.resize(points_m.size() / 2);
  }
  every_ *= 2;
}

report::Plot WayReport::plot(const std::string& title, Eigen::Index up) const {
  constexpr double kOverhang_m = 0.1;
  report::Plot plot{.title = title, .x = {"x", "m"}, .y = {up == 1 ? "y" : "z", "m"}, .series = {}};
  Eigen::Vector2d lower_m = Eigen::Vector2d::Zero();
  Eigen::Vector2d upper_m = Eigen::Vector2d::Zero();
  for (std::size_t i = 0; i < ways_.size(); ++i) {
    report::Series series{.name = ways_[i].name, .x = {}, .y = {}, .style = ways_[i].style};
    for (const Eigen::Vector3d& place_W_m : points_W_m_[i]) {
      const Eigen::Vector2d at_m(place_W_m.x(), place_W_m[up]);
      series.x.push_back(at_m.x());
      series.y.push_back(at_m.y());
      if (!at_m.allFinite()) continue;
      lower_m = lower_m.cwiseMin(at_m);
      upper_m = upper_m.cwiseMax(at_m);
    }
    plot.series.push_back(std::move(series));
  }
  Walls base("walls for the base's centre", kOverhang_m);
  if (up == 1) base.add(workspace_.base_W_m.min(), workspace_.base_W_m.max(), lower_m, upper_m);
  Walls tip("walls for the end effector", kOverhang_m);
  const auto in_plane = [up](const Eigen::Vector3d& corner_m) {
    return Eigen::Vector2d(corner_m.x(), corner_m[up]);
  };
  if (from_the_side_)
    tip.add(in_plane(workspace_.tip_W_m.min()), in_plane(workspace_.tip_W_m.max()), lower_m, upper_m);
  for (const Walls* walls : {&base, &tip})
    if (!walls->series().x.empty()) plot.series.push_back(walls->series());
  return plot;
}

void WayReport::write(const std::filesystem::path& path) const {
  report::Page page("Ways of " + ways_.back().name + " in the frame of the start");
  std::vector<report::Plot> plots{plot("From above", 1)};
  if (from_the_side_) plots.push_back(plot("From the right side", 2));
  page.plots(plots);
  const std::vector<std::pair<std::uint8_t, std::string>> kinds{
      {limiter::kEffort, "a force, moment or torque"},
      {limiter::kTorqueRate, "the change of a torque"},
      {limiter::kWorkspace, "a set-point, by a wall of the workspace"},
      {limiter::kSetpoint, "speed, acceleration or jerk of a set-point"}};
  std::vector<report::Row> rows;
  for (std::size_t bit = 0; bit < limited_cycles_.size(); ++bit)
    for (const auto& [mask, words] : kinds)
      if (mask == 1U << bit) rows.push_back({words, static_cast<double>(limited_cycles_[bit])});
  rows.push_back({std::string("all cycles"), static_cast<double>(cycles_)});
  page.table({{"what was limited"}, {"cycles"}}, rows);
  page.write(path);
}

}  // namespace operation
