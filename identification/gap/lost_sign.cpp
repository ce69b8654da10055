#include "identification/gap/lost_sign.h"

#include <Eigen/Core>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <numeric>
#include <span>
#include <utility>

#include "identification/gap/even_rows.h"
#include "identification/gap/excerpts.h"
#include "identification/gap/fitted_model.h"
#include "identification/gap/sign_test.h"
#include "identification/gap/signals.h"
#include "identification/gap/zero_phase.h"

namespace identification::gap {
namespace {

constexpr int kSignBlocks = 32;
/// Share of a column's values beyond its nominal minimum and maximum: a few are always wrong.
constexpr double kTail = 0.005;
/// Noise around zero may dip below it by this share of the maximum,
constexpr double kDip = 0.05;
/// and from this share on a motion has both directions.
constexpr double kBothWays = 0.1;
constexpr double kShapeSmooth_Hz = 10;

struct Range {
  double low;
  double high;
};
Range range_of(std::span<const double> column) {
  std::vector<double> values(column.begin(), column.end());
  const auto at = [&](double share) {
    const auto place =
        values.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
    std::ranges::nth_element(values, place);
    return *place;
  };
  return {.low = at(kTail), .high = at(1 - kTail)};
}

bool goes_both_ways(const Recording& recording) {
  for (const char* name : {"torque_command_Nm", "velocity_rad_per_s"}) {
    if (!recording.has(name)) continue;
    const Range range = range_of(recording.column(name));
    if (range.high > 0 && range.low < -kBothWays * range.high) return true;
  }
  if (!recording.has("position_rad")) return false;
  const auto position = recording.column("position_rad");
  double up = 0;
  double down = 0;
  for (std::size_t i = 1; i < position.size(); ++i)
    (position[i] > position[i - 1] ? up : down) += std::abs(position[i] - position[i - 1]);
  return up > kBothWays * down && down > kBothWays * up;
}

bool may_be_magnitude(const std::vector<Source>& sources) {
  double lowest = 0;
  double highest = 0;
  bool both_ways = false;
  for (const Source& source : sources) {
    if (!source.recording.has("torque_measured_Nm")) return false;
    const Range range = range_of(source.recording.column("torque_measured_Nm"));
    lowest = std::min(lowest, range.low);
    highest = std::max(highest, range.high);
    both_ways = both_ways || goes_both_ways(source.recording);
  }
  return both_ways && highest > 0 && lowest >= -kDip * highest;
}

/// The signal that gives the torque its sign.
std::vector<double> direction(const Source& source) {
  const Recording& recording = source.recording;
  for (const char* name : {"torque_command_Nm", "position_rad", "velocity_rad_per_s"}) {
    if (!recording.has(name)) continue;
    const auto column = recording.column(name);
    if (name != std::string_view("position_rad")) return {column.begin(), column.end()};
    const EvenRows rows(source);
    const double period_s = rows.period_s();
    const std::vector<double> velocity = derivative(
        zero_phase(rows.of(column, Between::kCurve), period_s, std::min(kShapeSmooth_Hz, 0.1 / period_s)),
        period_s);
    std::vector<double> at_rows;
    for (std::size_t i = 0; i < velocity.size(); ++i) at_rows.push_back(velocity[rows.next_to(i)]);
    return at_rows;
  }
  return std::vector<double>(recording.rows(), 1.0);
}

std::vector<Source> with_sign(std::vector<Source> sources) {
  for (Source& source : sources) {
    const std::vector<double> sign = direction(source);
    source.signed_by_motion = !source.recording.has("torque_command_Nm");
    for (Recording::Column& column : source.recording.columns)
      if (column.name == "torque_measured_Nm")
        for (std::size_t i = 0; i < sign.size(); ++i)
          column.values[i] = std::copysign(column.values[i], sign[i]);
  }
  return sources;
}

struct SignMisfit {
  std::vector<double> square;  ///< by block
  double rms_Nm;
};
double total_of(const std::vector<double>& squares) {
  return std::accumulate(squares.begin(), squares.end(), 0.0);
}

SignMisfit in_blocks(const Eigen::VectorXd& left) {
  SignMisfit result{
      {}, std::sqrt(left.squaredNorm() / static_cast<double>(std::max<Eigen::Index>(1, left.size())))};
  for (int b = 0; b < kSignBlocks; ++b) {
    const Eigen::Index from = left.size() * b / kSignBlocks;
    result.square.push_back(left.segment(from, left.size() * (b + 1) / kSignBlocks - from).squaredNorm());
  }
  return result;
}

/// For the command, scaled and shifted to fit.
SignMisfit misfit_of_command(std::span<const Source> sources) {
  Eigen::Index count = 0;
  for (const Source& source : sources) count += static_cast<Eigen::Index>(source.recording.rows());
  Eigen::MatrixXd columns(count, 2);
  Eigen::VectorXd measured(count);
  Eigen::Index row = 0;
  for (const Source& source : sources) {
    const auto command = source.recording.column("torque_command_Nm");
    const auto torque = source.recording.column("torque_measured_Nm");
    for (std::size_t i = 0; i < command.size(); ++i, ++row) {
      columns.row(row) << command[i], 1;
      measured[row] = torque[i];
    }
  }
  return in_blocks(measured - columns * columns.colPivHouseholderQr().solve(measured));
}

/// For the refitted model.
SignMisfit misfit_of_model(std::span<const Source> sources, std::span<const Excerpt> excerpts,
                           const Band& band, const model::effects::DriveModel& base) {
  const std::vector<Signals> signals = signals_of(sources, excerpts, band);
  const Rows rows(signals);
  std::vector<Eigen::Index> all(static_cast<std::size_t>(rows.count()));
  std::iota(all.begin(), all.end(), 0);
  const FittedModel given{.model = base, .given_inertia_kg_m2 = base.inertia_kg_m2};
  const Eigen::VectorXd left = rows.torque_Nm() - predicted_rows(refined(given, rows, all), rows);
  return in_blocks(left);
}

}  // namespace

std::optional<LostSign> lost_sign(const std::vector<Source>& sources, std::size_t data,
                                  const model::effects::DriveModel& base, const Options& options) {
  if (base.find<model::effects::UnsignedCurrent>() != nullptr) return LostSign{with_sign(sources), {}};
  if (!may_be_magnitude(sources)) return {};
  LostSign lost{with_sign(sources), {}};
  const bool commanded = std::ranges::all_of(
      sources, [](const Source& source) { return source.recording.has("torque_command_Nm"); });
  const Band band = choose_band(sources, base);
  // The same excerpts for both.
  const std::vector<Excerpt> excerpts = chosen_excerpts(
      std::span(sources).first(data), band, [](std::size_t, double) { return false; }, options.enough);
  const auto misfit = [&](const std::vector<Source>& all) {
    const std::span<const Source> searched = std::span(all).first(data);
    return commanded ? misfit_of_command(searched) : misfit_of_model(searched, excerpts, band, base);
  };
  const SignMisfit logged = misfit(sources);
  const SignMisfit restored = misfit(lost.sources);
  FoundEffect found{.effect = model::effects::make_effect("unsigned_current"),
                    .where = {.coordinate = "torque_measured_Nm"}};
  found.measured_on =
      commanded ? "misfit of command and measured torque" : "torque residual of the data searched";
  found.gap_before = logged.rms_Nm;
  found.gap_after = restored.rms_Nm;
  found.held_out_gain = 1 - total_of(restored.square) / total_of(logged.square);
  found.blocks = kSignBlocks;
  for (std::size_t b = 0; b < kSignBlocks; ++b)
    found.blocks_improved += restored.square[b] < logged.square[b] ? 1 : 0;
  found.p_value = chance_of(logged.square, restored.square);
  if (!(found.held_out_gain >= options.least_gain) || found.p_value > options.false_positive_rate) return {};
  lost.found = std::move(found);
  return lost;
}

}  // namespace identification::gap
