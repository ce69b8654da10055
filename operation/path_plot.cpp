#include "operation/path_plot.h"

#include <cmath>
#include <limits>
#include <utility>

namespace operation {
namespace {

/// Nothing is added for a box without limits.
void add_limits(report::Plot& plot, const std::string& name, const Eigen::AlignedBox2d& box_m) {
  constexpr double kOverhang_m = 0.1;
  constexpr double kPenUp = std::numeric_limits<double>::quiet_NaN();
  Eigen::AlignedBox2d ends_m(Eigen::Vector2d::Zero());
  for (const report::Series& path : plot.series)
    for (std::size_t i = 0; i < path.x.size(); ++i)
      if (const Eigen::Vector2d p_m(path.x[i], path.y[i]); p_m.allFinite()) ends_m.extend(p_m);
  Eigen::Vector2d from_m = box_m.min();
  Eigen::Vector2d to_m = box_m.max();
  for (Eigen::Index i = 0; i < 2; ++i) {
    if (!std::isfinite(from_m[i])) from_m[i] = ends_m.min()[i] - kOverhang_m;
    if (!std::isfinite(to_m[i])) to_m[i] = ends_m.max()[i] + kOverhang_m;
  }
  report::Series limits{.name = name, .x = {}, .y = {}, .style = report::Style::kDashed};
  const auto line = [&limits](double x1_m, double y1_m, double x2_m, double y2_m) {
    if (!std::isfinite(x1_m + y1_m + x2_m + y2_m)) return;
    limits.x.insert(limits.x.end(), {x1_m, x2_m, x2_m});
    limits.y.insert(limits.y.end(), {y1_m, y2_m, kPenUp});
  };
  for (const Eigen::Vector2d& limit_m : {box_m.min(), box_m.max()}) {
    line(limit_m.x(), from_m.y(), limit_m.x(), to_m.y());
    line(from_m.x(), limit_m.y(), to_m.x(), limit_m.y());
  }
  if (!limits.x.empty()) plot.series.push_back(std::move(limits));
}

}  // namespace

report::Plot path_plot(const std::string& title, Eigen::Index up, std::vector<report::Series> paths) {
  return {.title = title,
          .x = {"x", "m"},
          .y = {up == 1 ? "y" : "z", "m"},
          .series = std::move(paths),
          .equal_axes = true};
}

void add_base_limits(report::Plot& plot, const control::Workspace& workspace) {
  add_limits(plot, "workspace of the base's centre", workspace.base_W_m);
}

void add_end_effector_limits(report::Plot& plot, Eigen::Index up, const control::Workspace& workspace) {
  const auto in_plane = [up](const Eigen::Vector3d& p_m) { return Eigen::Vector2d(p_m.x(), p_m[up]); };
  add_limits(plot, "workspace of the end effector",
             {in_plane(workspace.tip_W_m.min()), in_plane(workspace.tip_W_m.max())});
}

}  // namespace operation
