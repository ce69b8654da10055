/// @file
/// The workspace in a recording's header.
#pragma once
#include <spdlog/fmt/fmt.h>

#include <cmath>
#include <vector>

#include "control/workspace.h"
#include "runtime/recording/recording_file.h"

namespace operation {

/// "workspace_base_x_m: -1 3" and so on; nothing for an axis without limits.
inline void add_workspace(const control::Workspace& workspace,
                          std::vector<runtime::RecordingFile::Comment>& comments) {
  const auto add = [&comments](const char* key, double lower_m, double upper_m) {
    if (std::isfinite(lower_m) || std::isfinite(upper_m))
      comments.push_back({key, fmt::format("{:g} {:g}", lower_m, upper_m)});
  };
  const Eigen::AlignedBox2d& base = workspace.base_W_m;
  const Eigen::AlignedBox3d& tip = workspace.tip_W_m;
  add("workspace_base_x_m", base.min().x(), base.max().x());
  add("workspace_base_y_m", base.min().y(), base.max().y());
  add("workspace_tip_x_m", tip.min().x(), tip.max().x());
  add("workspace_tip_y_m", tip.min().y(), tip.max().y());
  add("workspace_tip_z_m", tip.min().z(), tip.max().z());
}

}  // namespace operation
