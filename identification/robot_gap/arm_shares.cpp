#include "identification/robot_gap/arm_shares.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace identification::robot_gap {
namespace {

constexpr std::size_t kBins = 6;
/// Rows of a plotted stretch, and recordings that are plotted.
constexpr std::size_t kTraceRows = 600;
constexpr std::size_t kTracedMotions = 4;

/// One row with the quantities over which the disagreement is laid out.
struct Cell {
  double value = 0;
  double before = 0;
  double after = 0;
};

void add_bins(std::vector<Share>& shares, const std::string& coordinate, const std::string& joint,
              const std::string& recording, const std::vector<Cell>& cells, double total, double rows,
              std::size_t bins) {
  if (cells.empty() || !(total > 0)) return;
  const auto [least, most] = std::ranges::minmax(cells, {}, &Cell::value);
  const double width = (most.value - least.value) / static_cast<double>(bins);
  if (!(width > 0)) return;
  std::vector<Share> own(bins);
  for (std::size_t b = 0; b < bins; ++b)
    own[b] = {coordinate, joint, recording, least.value + static_cast<double>(b) * width,
              least.value + static_cast<double>(b + 1) * width};
  for (const Cell& cell : cells) {
    const auto bin = std::min(bins - 1, static_cast<std::size_t>((cell.value - least.value) / width));
    own[bin].before += cell.before / total;
    own[bin].after += cell.after / total;
    own[bin].rows += 1 / rows;
  }
  shares.insert(shares.end(), own.begin(), own.end());
}

}  // namespace

std::vector<Share> shares_of(const Eigen::VectorXd& before_Nm, const Eigen::VectorXd& after_Nm,
                             const Eigen::VectorXd& predicted_Nm, const ArmData& data,
                             const control::ArmDescription& arm) {
  std::vector<Share> shares;
  const double total = before_Nm.squaredNorm();
  const auto rows = static_cast<double>(data.plan.rows.size());
  if (!(total > 0)) return shares;
  const auto joints = static_cast<std::size_t>(data.sigma_Nm.size());
  std::vector<Share> by_joint(joints);
  std::vector<std::vector<Cell>> speed(joints);
  std::vector<std::vector<Cell>> direction(joints);
  std::vector<std::vector<Cell>> pose(joints);
  std::vector<std::vector<Cell>> load(joints);
  std::vector<std::vector<Cell>> time(data.motions.size());
  for (std::size_t i = 0; i < data.plan.rows.size(); ++i) {
    const RowPlan::Row& row = data.plan.rows[i];
    const ArmMotion& motion = data.motions[row.motion];
    const auto at = static_cast<Eigen::Index>(i);
    const auto sample = static_cast<Eigen::Index>(row.at * motion.step);
    const auto j = static_cast<std::size_t>(row.joint);
    const double before = before_Nm[at] * before_Nm[at];
    const double after = after_Nm[at] * after_Nm[at];
    const double v = motion.velocity_rad_per_s(row.joint, sample);
    by_joint[j].before += before / total;
    by_joint[j].after += after / total;
    by_joint[j].rows += 1 / rows;
    speed[j].push_back({std::abs(v), before, after});
    direction[j].push_back({v > 0 ? 1.0 : -1.0, before, after});
    pose[j].push_back({motion.position_rad(row.joint, sample), before, after});
    load[j].push_back({predicted_Nm[at], before, after});
    time[row.motion].push_back(
        {motion.start_s + static_cast<double>(row.at) * motion.row_s(), before, after});
  }
  for (std::size_t j = 0; j < joints; ++j) {
    const std::string& name = arm.arm.links[j].joint;
    by_joint[j].coordinate = "joint";
    by_joint[j].joint = name;
    shares.push_back(by_joint[j]);
  }
  for (std::size_t j = 0; j < joints; ++j) {
    const std::string& name = arm.arm.links[j].joint;
    add_bins(shares, "speed", name, "", speed[j], total, rows, kBins);
    add_bins(shares, "direction", name, "", direction[j], total, rows, 2);
    add_bins(shares, "pose", name, "", pose[j], total, rows, kBins);
    add_bins(shares, "load", name, "", load[j], total, rows, kBins);
  }
  for (std::size_t m = 0; m < data.motions.size(); ++m)
    add_bins(shares, "time", "", data.motions[m].name, time[m], total, rows, kBins);
  return shares;
}

std::vector<RobotTrace> traces_of(const Eigen::VectorXd& measured_Nm, const Eigen::VectorXd& before_Nm,
                                  const Eigen::VectorXd& after_Nm, const ArmData& data,
                                  const control::ArmDescription& arm) {
  std::vector<RobotTrace> traces;
  const auto joints = static_cast<std::size_t>(data.sigma_Nm.size());
  const std::size_t motions = std::min(kTracedMotions, data.motions.size());
  for (std::size_t m = 0; m < motions; ++m)
    for (std::size_t j = 0; j < joints; ++j)
      traces.push_back({data.motions[m].name, arm.arm.links[j].joint, {}, {}, {}, {}});
  for (std::size_t i = 0; i < data.plan.rows.size(); ++i) {
    const RowPlan::Row& row = data.plan.rows[i];
    if (row.motion >= motions) continue;
    RobotTrace& trace = traces[row.motion * joints + static_cast<std::size_t>(row.joint)];
    if (trace.time_s.size() >= kTraceRows) continue;
    const ArmMotion& motion = data.motions[row.motion];
    const auto at = static_cast<Eigen::Index>(i);
    trace.time_s.push_back(motion.start_s + static_cast<double>(row.at) * motion.row_s());
    trace.measured_Nm.push_back(measured_Nm[at]);
    trace.before_Nm.push_back(measured_Nm[at] - before_Nm[at]);
    trace.after_Nm.push_back(measured_Nm[at] - after_Nm[at]);
  }
  std::erase_if(traces, [](const RobotTrace& trace) { return trace.time_s.empty(); });
  return traces;
}

}  // namespace identification::robot_gap
