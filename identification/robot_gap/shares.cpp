#include "identification/robot_gap/shares.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <map>
#include <string>
#include <utility>

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

struct LaidOut {
  std::string unit;
  std::size_t bins = 0;
  std::vector<Cell> cells;
};

/// `of`: with the names alone.
void add_bins(std::vector<Share>& shares, const Share& of, const std::vector<Cell>& cells, double total,
              double rows, std::size_t bins) {
  if (cells.empty() || !(total > 0)) return;
  const auto [least, most] = std::ranges::minmax(cells, {}, &Cell::value);
  const double width = (most.value - least.value) / static_cast<double>(bins);
  if (!(width > 0)) return;
  std::vector<Share> own(bins, of);
  for (std::size_t b = 0; b < bins; ++b) {
    own[b].from = least.value + static_cast<double>(b) * width;
    own[b].to = least.value + static_cast<double>(b + 1) * width;
  }
  for (const Cell& cell : cells) {
    const auto bin = std::min(bins - 1, static_cast<std::size_t>((cell.value - least.value) / width));
    own[bin].before += cell.before / total;
    own[bin].after += cell.after / total;
    own[bin].rows += 1 / rows;
  }
  shares.insert(shares.end(), own.begin(), own.end());
}

}  // namespace

std::vector<Share> shares_of(const Eigen::VectorXd& before, const Eigen::VectorXd& after, const View& view) {
  const RowPlan& plan = view.plan();
  const std::vector<Channel>& channels = view.subject.channels();
  const std::vector<std::string>& motions = view.subject.motions(view.part);
  const auto rows = static_cast<double>(plan.rows.size());
  std::vector<Share> by_channel(channels.size());
  std::vector<std::vector<Cell>> time(motions.size());
  /// By channel and name.
  std::map<std::pair<Eigen::Index, std::string>, LaidOut> laid_out;
  double total = 0;
  for (std::size_t i = 0; i < plan.rows.size(); ++i) {
    const RowPlan::Row& row = plan.rows[i];
    const auto at = static_cast<Eigen::Index>(i);
    const double floor = view.subject.noise_floor()[row.channel];
    Cell cell{0, before[at] * before[at] / (floor * floor), after[at] * after[at] / (floor * floor)};
    total += cell.before;
    Share& own = by_channel[static_cast<std::size_t>(row.channel)];
    own.before += cell.before;
    own.after += cell.after;
    own.rows += 1 / rows;
    for (const Coordinate& one : view.subject.coordinates(view.part, i)) {
      cell.value = one.value;
      LaidOut& own_range = laid_out[{one.channel, std::string(one.name)}];
      own_range.unit = one.unit;
      own_range.bins = one.bins;
      own_range.cells.push_back(cell);
    }
    cell.value = view.subject.time_s(view.part, i);
    time[row.motion].push_back(cell);
  }
  std::vector<Share> shares;
  if (!(total > 0)) return shares;
  for (std::size_t c = 0; c < channels.size(); ++c) {
    by_channel[c].coordinate = "channel";
    by_channel[c].channel = channels[c].name;
    by_channel[c].before /= total;
    by_channel[c].after /= total;
    shares.push_back(by_channel[c]);
  }
  for (const auto& [key, value] : laid_out)
    add_bins(shares,
             {.coordinate = key.second,
              .unit = value.unit,
              .channel = key.first < 0 ? "" : channels[static_cast<std::size_t>(key.first)].name,
              .recording = ""},
             value.cells, total, rows, value.bins);
  for (std::size_t m = 0; m < motions.size(); ++m)
    add_bins(shares, {.coordinate = "time", .unit = "s", .channel = "", .recording = motions[m]}, time[m],
             total, rows, kBins);
  return shares;
}

std::vector<RobotTrace> traces_of(const Eigen::VectorXd& measured, const Eigen::VectorXd& before,
                                  const Eigen::VectorXd& after, const View& view) {
  std::vector<RobotTrace> traces;
  const std::vector<Channel>& channels = view.subject.channels();
  const std::vector<std::string>& recordings = view.subject.motions(view.part);
  const std::size_t motions = std::min(kTracedMotions, recordings.size());
  for (std::size_t m = 0; m < motions; ++m)
    for (const Channel& channel : channels)
      traces.push_back({recordings[m], channel.name, channel.unit, {}, {}, {}, {}});
  for (std::size_t i = 0; i < view.plan().rows.size(); ++i) {
    const RowPlan::Row& row = view.plan().rows[i];
    if (row.motion >= motions) continue;
    RobotTrace& trace = traces[row.motion * channels.size() + static_cast<std::size_t>(row.channel)];
    if (trace.time_s.size() >= kTraceRows) continue;
    const auto at = static_cast<Eigen::Index>(i);
    trace.time_s.push_back(view.subject.time_s(view.part, i));
    trace.measured.push_back(measured[at]);
    trace.before.push_back(measured[at] - before[at]);
    trace.after.push_back(measured[at] - after[at]);
  }
  std::erase_if(traces, [](const RobotTrace& trace) { return trace.time_s.empty(); });
  return traces;
}

}  // namespace identification::robot_gap
