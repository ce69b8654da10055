#include "identification/gap/repairs.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <numeric>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>

#include "identification/fit/quantile.h"
#include "identification/fit/statistics.h"
#include "identification/gap/signals.h"
#include "identification/gap/wording.h"

namespace identification::gap {
namespace {

/// Minimum number of rows of a useful piece.
constexpr std::size_t kMinRowsOfPart = 100;
/// A time step of up to this many usual ones is bridged by interpolation: half a period of the widest band.
constexpr double kBridgedPeriods = 5;
/// Rates differ if their ratio exceeds this for some hundred rows; less is a logger that is sometimes late.
constexpr double kAnotherRate = 1.8;
/// Minimum share of bridged gaps for a remark.
constexpr double kManyHoles = 1e-3;
/// Distance from the median of five neighbours, in standard deviations of that distance and in usual values.
constexpr double kSpikeSigmas = 8;
constexpr double kSpikeOverUsual = 2;
constexpr double kMaxSpikes = 0.01;
constexpr std::size_t kLongestSpike = 3;
/// A spike returns to where it was, to this share of its height; a step stays, and a push decays.
constexpr double kReturns = 0.3;
/// A commanded peak has at least this share of the height, within this time and number of rows.
constexpr double kCommanded = 0.5;
constexpr double kApart_s = 0.006;
constexpr std::size_t kRowsApart = 2;
/// Steps before and after it over which speeds are compared.
constexpr std::size_t kStepsOfSpeed = 5;
/// Encoder steps by which quantisation can change the difference of two speeds (at most 2), with margin.
constexpr double kTicksOfSpeeds = 4;
/// Distance of a step of position from that of its neighbours.
constexpr double kJumpSigmas = 50;
constexpr double kJumpResolutions = 8;
constexpr double kJumpOverUsual = 5;
constexpr double kMaxJumps = 0.005;
/// A step is of a motion if it is one of three in one direction that each go at least this share of it.
constexpr double kStepOfMotion = 0.3;
constexpr std::size_t kStepsOfMotion = 3;
/// Minimum share of the values at the end of a sensor's range, and its ratio to the next value.
constexpr double kMinSaturated = 0.003;
constexpr std::size_t kFarMore = 5;
/// A sensor reaches its end in small steps, of its range; a torque that switches between few values does not.
constexpr double kMaxSensorStep = 0.1;
/// No drive runs that long: three years.
constexpr double kOtherEpoch_s = 1e8;
/// Tolerance for a jump of a whole turn.
constexpr double kWholeTurn = 0.02;
/// Minimum number of jumps by a full range of counts before the range counts as one turn.
constexpr std::size_t kMinWraps = 3;
/// A turn is the range, and a step more.
constexpr double kTurnOfRange = 0.9;
/// A held value changes by several times the sensor's resolution; a coarse one by one step.
constexpr double kHeldResolutions = 3;
/// A column has stopped if it is constant for this many usual runs of the same value.
constexpr std::size_t kMinHeldRuns = 20;
constexpr double kUsualRuns = 0.99;
/// Noise reverses at two of three values. Without any, or with less than the torque changes from row to row,
/// a dead-band or a constant speed looks like a stop.
constexpr double kTurnsOfNoise = 0.25;
/// Other columns count as moving if they change by this share of their usual value, or by this many of their
/// smallest changes.
constexpr double kMeanwhile = 0.05;
constexpr double kMeanwhileChanges = 10;
/// Within a dead-band of ±its usual size, a command changes by at most this many times that size.
constexpr double kBeyondDeadband = 2;
/// A velocity that leads this far, while the position is constant, contradicts it.
constexpr double kWay_rad = 0.1;

std::vector<double>* column_of(Source& source, std::string_view name) {
  for (Recording::Column& column : source.recording.columns)
    if (column.name == name) return &column.values;
  return nullptr;
}

void remove(Source& source, std::string_view name) {
  std::erase_if(source.recording.columns, [name](const Recording::Column& c) { return c.name == name; });
}

bool is_constant(std::span<const double> values) {
  return std::ranges::adjacent_find(values, std::ranges::not_equal_to()) == values.end();
}

std::vector<double> magnitudes(std::span<const double> values) {
  std::vector<double> result;
  result.reserve(values.size());
  for (const double value : values) result.push_back(std::abs(value));
  return result;
}

std::vector<double> steps_of(std::span<const double> values) {
  std::vector<double> steps;
  steps.reserve(values.size());
  for (std::size_t i = 1; i < values.size(); ++i) steps.push_back(values[i] - values[i - 1]);
  return steps;
}

/// Median of each value with the two before and after it; fewer at the ends.
std::vector<double> medians_of_five(std::span<const double> values) {
  std::vector<double> result;
  result.reserve(values.size());
  std::array<double, 5> window{};
  for (std::size_t i = 0; i < values.size(); ++i) {
    const std::size_t first = i < 2 ? 0 : i - 2;
    const std::size_t count = std::min(values.size(), i + 3) - first;
    std::copy_n(values.begin() + static_cast<std::ptrdiff_t>(first), count, window.begin());
    const auto middle = window.begin() + static_cast<std::ptrdiff_t>(count / 2);
    std::nth_element(window.begin(), middle, window.begin() + static_cast<std::ptrdiff_t>(count));
    result.push_back(*middle);
  }
  return result;
}

/// Consecutive steps of time at one rate.
struct Rate {
  std::size_t from;  ///< step
  std::size_t to;
  double step_s;  ///< usual
};
/// The first step that belongs to the second of two neighbouring rates.
std::size_t change_between(std::span<const double> steps_s, const Rate& first, const Rate& second) {
  const double between_s = std::sqrt(first.step_s * second.step_s);
  const bool slows = second.step_s > first.step_s;
  const std::size_t reach = kMinRowsOfPart;
  const std::size_t low = second.from - std::min(reach, second.from - first.from);
  const std::size_t high = std::min(second.from + reach, second.to);
  std::size_t best = second.from;
  int most = std::numeric_limits<int>::min();
  int score = 0;  // steps of the first rate before the change, less those of the second
  for (std::size_t at = low; at <= high; ++at) {
    if (score > most) {
      most = score;
      best = at;
    }
    if (at < high) score += (steps_s[at] > between_s) == slows ? -1 : 1;
  }
  return best;
}
/// The rates of rows, in time order: one, unless it changes for hundreds of rows.
std::vector<Rate> rates_of(std::span<const double> steps_s) {
  const std::size_t blocks = std::max<std::size_t>(1, steps_s.size() / kMinRowsOfPart);
  const auto block_at = [&](std::size_t b) { return b * steps_s.size() / blocks; };
  // The mean, without holes: steps of two lengths in equal shares have a median of one or the other by
  // chance.
  std::vector<double> means;
  for (std::size_t b = 0; b < blocks; ++b) {
    const auto block = steps_s.subspan(block_at(b), block_at(b + 1) - block_at(b));
    const double hole_s = kBridgedPeriods * fit::median({block.begin(), block.end()});
    double sum_s = 0;
    std::size_t count = 0;
    for (const double step_s : block) {
      if (step_s > hole_s) continue;
      sum_s += step_s;
      ++count;
    }
    means.push_back(sum_s / static_cast<double>(count));
  }
  const std::vector<double> lasting = medians_of_five(means);
  std::vector<Rate> rates{{0, steps_s.size(), lasting.front()}};
  for (std::size_t b = 1; b < blocks; ++b) {
    const double ratio = lasting[b] / rates.back().step_s;
    if (ratio < kAnotherRate && ratio > 1 / kAnotherRate) continue;
    rates.back().to = block_at(b);
    rates.push_back({block_at(b), steps_s.size(), lasting[b]});
  }
  for (std::size_t r = 0; r + 1 < rates.size(); ++r)
    rates[r].to = rates[r + 1].from = change_between(steps_s, rates[r], rates[r + 1]);
  std::erase_if(rates, [](const Rate& rate) { return rate.from == rate.to; });
  for (Rate& rate : rates) {
    const auto own = steps_s.subspan(rate.from, rate.to - rate.from);
    rate.step_s = fit::median({own.begin(), own.end()});
  }
  return rates;
}
/// The usual length of a step of time.
double usual_s(std::span<const Rate> rates, std::size_t step) {
  return std::ranges::upper_bound(rates, step, {}, &Rate::to)->step_s;
}
/// Whether it is too long to be bridged.
bool is_hole(std::span<const Rate> rates, std::span<const double> time_s, std::size_t step) {
  return time_s[step + 1] - time_s[step] > kBridgedPeriods * usual_s(rates, step);
}

/// The smallest change, except for one in a hundred; 0 without any.
double least_change(std::span<const double> steps) {
  std::vector<double> changes;
  changes.reserve(steps.size());
  for (const double step : steps)
    if (step != 0) changes.push_back(std::abs(step));
  return fit::quantile(std::move(changes), 0.01);
}

std::string share_text(std::size_t count, std::size_t all) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), " (%.2g %%)",
                100 * static_cast<double>(count) / static_cast<double>(all));
  return std::to_string(count) + text.data();
}

/// Interpolates values `from` to `to` − 1 between their neighbours.
void interpolate(std::vector<double>& values, std::span<const double> time_s, std::size_t from,
                 std::size_t to) {
  const double rise = (values[to] - values[from - 1]) / (time_s[to] - time_s[from - 1]);
  for (std::size_t i = from; i < to; ++i)
    values[i] = values[from - 1] + rise * (time_s[i] - time_s[from - 1]);
}

/// A run of marked values: first, and one after the last.
struct MarkedRun {
  std::size_t from;
  std::size_t to;
};
std::vector<MarkedRun> runs_of(const std::vector<bool>& marked) {
  std::vector<MarkedRun> runs;
  for (std::size_t i = 0; i < marked.size(); ++i) {
    if (!marked[i]) continue;
    std::size_t to = i;
    while (to < marked.size() && marked[to]) ++to;
    runs.push_back({i, to});
    i = to;
  }
  return runs;
}

/// Consecutive runs of the same value.
template <class Visit>
void for_each_run(std::span<const double> values, const Visit& visit) {
  for (std::size_t from = 0; from < values.size();) {
    std::size_t to = from + 1;
    while (to < values.size() && values[to] == values[from]) ++to;
    visit(MarkedRun{from, to});
    from = to;
  }
}

/// Typical number of rows for which a value is constant; 1 for a fresh one in each row.
std::size_t held_rows(std::span<const double> values) {
  const std::vector<double> steps = steps_of(values);
  std::vector<double> lengths;
  std::vector<double> changes;
  std::size_t since = 0;
  for (std::size_t i = 0; i < steps.size(); ++i) {
    if (steps[i] == 0) continue;
    lengths.push_back(static_cast<double>(i + 1 - since));
    changes.push_back(std::abs(steps[i]));
    since = i + 1;
  }
  if (changes.size() < 2) return 1;
  const double resolution = least_change(steps);
  if (fit::median(changes) < kHeldResolutions * resolution) return 1;
  return static_cast<std::size_t>(fit::median(lengths));
}

/// A step of the position beyond that of its neighbours.
struct Jump {
  std::size_t before;  ///< the row before it
  double rad;
};

/// Steps of position, less those at the usual speed beside them.
std::vector<double> beyond_motion(std::span<const double> steps, std::span<const double> time_s) {
  std::vector<double> speeds(steps.begin(), steps.end());
  for (std::size_t i = 0; i < steps.size(); ++i) speeds[i] /= time_s[i + 1] - time_s[i];
  std::vector<double> beyond = medians_of_five(speeds);
  for (std::size_t i = 0; i < steps.size(); ++i)
    beyond[i] = steps[i] - beyond[i] * (time_s[i + 1] - time_s[i]);
  return beyond;
}

/// Further than the motion goes from row to row, none of them over a hole in time.
std::vector<Jump> jumps_of(const Source& source, std::span<const double> position) {
  const auto time_s = source.recording.column("time_s");
  const std::vector<Rate> rates = rates_of(steps_of(time_s));
  const std::vector<double> steps = steps_of(position);
  const std::vector<double> beyond = beyond_motion(steps, time_s);
  const double least =
      std::max({kJumpSigmas * fit::robust_sigma(beyond), kJumpResolutions * least_change(steps),
                kJumpOverUsual * fit::quantile(magnitudes(steps), 1 - kMaxJumps)});
  // Of a joint that mostly rests, quick motion is rare.
  const auto goes_on = [&](std::size_t i) {
    const auto follows = [&](std::size_t k) {
      return k < steps.size() && steps[k] * steps[i] > kStepOfMotion * steps[i] * steps[i];
    };
    std::size_t from = i;
    while (from > 0 && i + 1 - from < kStepsOfMotion && follows(from - 1)) --from;
    std::size_t to = i + 1;
    while (to - from < kStepsOfMotion && follows(to)) ++to;
    return to - from >= kStepsOfMotion;
  };
  std::vector<Jump> jumps;
  for (std::size_t i = 0; i < beyond.size(); ++i)
    if (std::abs(beyond[i]) > least && least > 0 && !goes_on(i) && !is_hole(rates, time_s, i))
      jumps.push_back({i, beyond[i]});
  return jumps;
}

/// Change of speed at each row, beyond that of the acceleration beside it; a push stands out. 0 where it is
/// hidden in the encoder's steps; empty without motion.
std::vector<double> kicks_of(const Source& source) {
  const Recording& recording = source.recording;
  const auto time_s = recording.column("time_s");
  const char* const name = recording.has("position_rad") ? "position_rad" : "velocity_rad_per_s";
  if (!recording.has(name)) return {};
  const auto motion = recording.column(name);
  std::vector<double> way(motion.begin(), motion.end());
  if (!recording.has("position_rad"))
    for (std::size_t i = 1; i < way.size(); ++i)
      way[i] = way[i - 1] + motion[i] * (time_s[i] - time_s[i - 1]);
  const double hidden = kTicksOfSpeeds * least_change(steps_of(way));
  struct Speed {
    double rad_per_s;
    double time_s;  // of its middle
  };
  const auto speed = [&](std::size_t from, std::size_t to) -> Speed {
    return {(way[to] - way[from]) / (time_s[to] - time_s[from]), 0.5 * (time_s[from] + time_s[to])};
  };
  const auto acceleration = [](const Speed& one, const Speed& next) {
    return (next.rad_per_s - one.rad_per_s) / (next.time_s - one.time_s);
  };
  constexpr std::size_t kWide = kStepsOfSpeed;
  std::vector<double> kicks(time_s.size(), 0);
  for (std::size_t i = 2 * kWide; i + 2 * kWide + 1 < time_s.size(); ++i) {
    const Speed before = speed(i - kWide, i);
    const Speed after = speed(i + 1, i + 1 + kWide);
    const double change = after.rad_per_s - before.rad_per_s;
    const double beside = 0.5 * (acceleration(after, speed(i + 1 + kWide, i + 1 + 2 * kWide)) +
                                 acceleration(speed(i - 2 * kWide, i - kWide), before));
    const double more = change - beside * (after.time_s - before.time_s);
    const double kick = std::abs(more) < std::abs(change) ? more : change;
    const double shorter_s = std::min(time_s[i] - time_s[i - kWide], time_s[i + 1 + kWide] - time_s[i + 1]);
    if (more * change > 0 && std::abs(kick) * shorter_s > hidden) kicks[i] = kick;
  }
  return kicks;
}

/// How far a run of values is from those beside it.
double height_of(std::span<const double> values, const MarkedRun& run) {
  double height = 0;
  for (std::size_t i = run.from; i < run.to; ++i)
    height = std::max(height, std::abs(values[i] - 0.5 * (values[run.from - 1] + values[run.to])));
  return height;
}
bool returns(std::span<const double> values, const MarkedRun& run) {
  return std::abs(values[run.to] - values[run.from - 1]) < kReturns * height_of(values, run);
}
/// Whether the command has a peak in the same direction, within `apart` rows.
bool is_commanded(std::span<const double> command, std::span<const double> torque, const MarkedRun& run,
                  std::size_t apart) {
  const double direction = std::copysign(1.0, torque[run.from] - torque[run.from - 1]);
  const std::size_t from = run.from - std::min(run.from, apart + 1);
  const std::size_t to = std::min(run.to + apart + 1, command.size());
  double peak_Nm = -std::numeric_limits<double>::infinity();
  for (std::size_t i = from; i < to; ++i) peak_Nm = std::max(peak_Nm, direction * command[i]);
  const double beside_Nm = std::max(direction * command[from], direction * command[to - 1]);
  return peak_Nm - beside_Nm > kCommanded * height_of(torque, run);
}
/// Whether the motion follows a torque in that run, in its direction.
bool is_answered(std::span<const double> kicks, double least_kick, double direction, const MarkedRun& run) {
  if (kicks.empty()) return false;
  return std::ranges::any_of(kicks.subspan(run.from - 1, run.to - run.from + 2),
                             [&](double kick) { return std::copysign(kick, kick * direction) > least_kick; });
}

double longest_step(std::span<const double> values) {
  const std::vector<double> steps = magnitudes(steps_of(values));
  return steps.empty() ? 0 : std::ranges::max(steps);
}

/// Beside a position that was unwrapped: a set-point wraps if it stays within a turn, and has shorter steps
/// in the turn that is nearest to the position at each row. Any other is in the turn that is nearest over
/// all.
void align_set_point(Source& source, double turn_rad) {
  std::vector<double>* const command = column_of(source, "position_command_rad");
  if (command == nullptr) return;
  const auto position = source.recording.column("position_rad");
  const auto turns = [&](double rad) { return turn_rad * std::round(rad / turn_rad); };
  std::vector<double> behind;
  std::vector<double> nearest;
  for (std::size_t i = 0; i < command->size(); ++i) {
    behind.push_back(position[i] - (*command)[i]);
    nearest.push_back((*command)[i] + turns(behind[i]));
  }
  const auto [lowest, highest] = std::ranges::minmax(*command);
  if (highest - lowest <= (1 + kWholeTurn) * turn_rad && longest_step(nearest) < longest_step(*command)) {
    *command = std::move(nearest);
    return;
  }
  const double all = turns(fit::median(behind));
  for (double& value : *command) value += all;
}

/// Adds a turn behind each jump, against it.
void add_turns(std::vector<double>& position, std::span<const Jump> jumps, double turn_rad) {
  double offset = 0;
  std::size_t next = 0;
  for (const auto& [before, rad] : jumps) {
    for (; next <= before; ++next) position[next] += offset;
    offset -= std::copysign(turn_rad, rad);
  }
  for (; next < position.size(); ++next) position[next] += offset;
}

/// Single jumps of a whole turn.
void unwrap_single_turns(Source& source, std::vector<double>& position, Diagnoses& diagnoses) {
  constexpr double kTurn = 2 * std::numbers::pi;
  std::vector<Jump> jumps = jumps_of(source, position);
  std::erase_if(jumps, [](const Jump& j) { return std::abs(std::abs(j.rad) - kTurn) >= kWholeTurn * kTurn; });
  if (jumps.empty()) return;
  add_turns(position, jumps, kTurn);
  align_set_point(source, kTurn);
  diagnoses.push_back({source.name, "position_rad",
                       "jumps by a whole turn " + std::to_string(jumps.size()) + " times", "unwrapped"});
}

/// Of an encoder that counts within one turn.
struct Wraps {
  std::vector<Jump> jumps;
  double turn_rad = 0;
};
std::optional<Wraps> wraps_of(std::span<const double> position, std::span<const double> time_s) {
  const std::vector<Rate> rates = rates_of(steps_of(time_s));
  const std::vector<double> steps = steps_of(position);
  const std::vector<double> usual = medians_of_five(steps);
  const auto [lowest, highest] = std::ranges::minmax(position);
  Wraps wraps;
  std::vector<double> turns_rad;
  for (std::size_t i = 0; i < steps.size(); ++i) {
    if (std::abs(steps[i]) <= (highest - lowest) / 2 || is_hole(rates, time_s, i)) continue;
    wraps.jumps.push_back({i, steps[i]});
    // Near rest at the edge of a turn, noise wraps it back and forth.
    if (steps[i] * usual[i] < 0) turns_rad.push_back(std::abs(steps[i] - usual[i]));
  }
  if (turns_rad.size() < kMinWraps || 2 * turns_rad.size() <= wraps.jumps.size()) return std::nullopt;
  wraps.turn_rad = fit::median(turns_rad);
  // Noise at rest and strays do not jump by all of the range.
  if (wraps.turn_rad < kTurnOfRange * (highest - lowest)) return std::nullopt;
  constexpr double kTurn = 2 * std::numbers::pi;
  if (std::abs(wraps.turn_rad - kTurn) < kWholeTurn * kTurn) wraps.turn_rad = kTurn;
  return wraps;
}

}  // namespace

void count_from_first_row(Source& source, Diagnoses& diagnoses) {
  std::vector<double>* const time_s = column_of(source, "time_s");
  if (time_s == nullptr || time_s->empty() || std::abs(time_s->front()) < kOtherEpoch_s) return;
  const double first_s = time_s->front();
  for (double& t : *time_s) t -= first_s;
  if (source.running_from_s) *source.running_from_s -= first_s;
  diagnoses.push_back({source.name, "time_s",
                       "begins at " + std::to_string(std::llround(first_s)) +
                           " s, like a clock that counts from another epoch, such as 1970",
                       "counted from the first row"});
}

void drop_dead_columns(Source& source, Diagnoses& diagnoses) {
  const auto drop = [&](const char* name, const std::string& found, const std::string& done) {
    remove(source, name);
    diagnoses.push_back({source.name, name, found, done});
  };
  if (const auto* measured = column_of(source, "torque_measured_Nm");
      measured != nullptr && is_constant(*measured)) {
    const auto* command = column_of(source, "torque_command_Nm");
    const std::string found = "is " + short_number(measured->front()) + " in every row";
    if (command == nullptr || is_constant(*command))
      throw std::invalid_argument(
          path_of(source) + ": torque_measured_Nm " + found +
          ": the torque or current was not recorded; look at the sensor's channel and "
          "scale, and record again");
    drop("torque_measured_Nm", found, "left out: the command counts");
  }
  const auto* position = column_of(source, "position_rad");
  const auto* velocity = column_of(source, "velocity_rad_per_s");
  if (position == nullptr || velocity == nullptr) return;
  if (is_constant(*position)) {
    const auto time_s = source.recording.column("time_s");
    double way = 0;
    for (std::size_t i = 1; i < time_s.size(); ++i)
      way += std::abs((*velocity)[i]) * (time_s[i] - time_s[i - 1]);
    if (way > kWay_rad)
      drop("position_rad", "does not change, though the velocity leads over " + short_number(way) + " rad",
           "left out: the velocity counts");
  } else if (is_constant(*velocity) && velocity->front() == 0) {
    drop("velocity_rad_per_s", "is 0 in every row, though the position changes",
         "left out: the position counts");
  }
}

void drop_held_torque(Source& source, Diagnoses& diagnoses) {
  const std::vector<double>* const torque = column_of(source, "torque_measured_Nm");
  const std::vector<double>* const command = column_of(source, "torque_command_Nm");
  const bool commanded = command != nullptr && least_change(steps_of(*command)) > 0;
  const std::vector<double>* const moving = commanded ? command : column_of(source, "position_rad");
  if (torque == nullptr || moving == nullptr || torque->size() < kMinRowsOfPart) return;
  std::map<std::size_t, std::size_t> runs;  // how many of each length
  std::vector<double> values;
  for_each_run(*torque, [&](const MarkedRun& run) {
    ++runs[run.to - run.from];
    values.push_back((*torque)[run.from]);
  });
  const std::size_t count = values.size();
  std::size_t turns = 0;
  for (std::size_t i = 2; i < count; ++i)
    turns += (values[i - 2] < values[i - 1]) == (values[i] < values[i - 1]) ? 1 : 0;
  const bool noisy = static_cast<double>(turns) >= kTurnsOfNoise * static_cast<double>(count);
  if (!noisy && !commanded) return;
  std::size_t usual = 1;
  std::size_t shorter = 0;
  for (const auto& [length, times] : runs) {
    if (static_cast<double>(shorter) > kUsualRuns * static_cast<double>(count)) break;
    usual = length;
    shorter += times;
  }
  if (runs.rbegin()->first < kMinHeldRuns * usual) return;

  const double moves = std::max(
      kMeanwhileChanges * least_change(steps_of(*moving)),
      commanded ? (noisy ? kMeanwhile : kBeyondDeadband) * fit::quantile(magnitudes(*command), 0.9) : 0);
  const auto range = std::ranges::minmax(*torque);
  std::vector<MarkedRun> held;
  for_each_run(*torque, [&](const MarkedRun& run) {
    const double value = (*torque)[run.from];
    if (run.to - run.from < kMinHeldRuns * usual || value == range.min || value == range.max) return;
    const auto meanwhile = std::ranges::minmax(std::span(*moving).subspan(run.from, run.to - run.from));
    if (meanwhile.max - meanwhile.min > moves) held.push_back(run);
  });
  if (held.empty()) return;
  const auto time_s = source.recording.column("time_s");
  const std::string first = "stays " + short_number((*torque)[held.front().from]) + " from " +
                            short_number(time_s[held.front().from]) + " s to " +
                            short_number(time_s[held.front().to - 1]) + " s, while " +
                            (commanded ? "its command changes" : "the joint turns");
  std::vector<std::size_t> kept;
  std::size_t next = 0;
  for (const MarkedRun& run : held) {
    for (; next <= run.from; ++next) kept.push_back(next);  // the first of its rows was measured
    next = run.to;
  }
  for (; next < torque->size(); ++next) kept.push_back(next);
  diagnoses.push_back({source.name, "torque_measured_Nm",
                       first + "; " + share_text(torque->size() - kept.size(), torque->size()) +
                           " of the rows are held like that",
                       "left out"});
  source = with_rows(std::move(source), kept);
}

void unwrap_position(Source& source, Diagnoses& diagnoses) {
  std::vector<double>* const position = column_of(source, "position_rad");
  if (position == nullptr || position->size() < kMinRowsOfPart) return;
  if (const std::optional<Wraps> wraps = wraps_of(*position, source.recording.column("time_s"))) {
    add_turns(*position, wraps->jumps, wraps->turn_rad);
    align_set_point(source, wraps->turn_rad);
    diagnoses.push_back({source.name, "position_rad",
                         "jumps " + std::to_string(wraps->jumps.size()) + " times by " +
                             short_number(wraps->turn_rad) +
                             " rad against the motion, like an encoder that counts within one turn",
                         "unwrapped"});
  }
  unwrap_single_turns(source, *position, diagnoses);
}

std::set<std::size_t> mend_position(Source& source, Diagnoses& diagnoses) {
  std::vector<double>* const position = column_of(source, "position_rad");
  if (position == nullptr || position->size() < kMinRowsOfPart) return {};
  const auto time_s = source.recording.column("time_s");
  const std::vector<Jump> jumps = jumps_of(source, *position);
  std::set<std::size_t> cuts;
  std::size_t strays = 0;
  double largest = 0;
  for (std::size_t k = 0; k < jumps.size(); ++k) {
    const auto [i, jump] = jumps[k];
    const bool comes_back = k + 1 < jumps.size() && jumps[k + 1].before == i + 1 &&
                            i + 2 < position->size() &&
                            std::abs(jump + jumps[k + 1].rad) < 0.2 * std::abs(jump);
    if (comes_back) {
      interpolate(*position, time_s, i + 1, i + 2);
      ++strays;
      ++k;
    } else {
      cuts.insert(i + 1);
      largest = std::max(largest, std::abs(jump));
    }
  }
  if (strays > 0)
    diagnoses.push_back({source.name, "position_rad",
                         share_text(strays, position->size()) + " of the values are off the way",
                         "interpolated"});
  if (!cuts.empty())
    diagnoses.push_back({source.name, "position_rad",
                         "jumps " + std::to_string(cuts.size()) + " times, by up to " +
                             short_number(largest) + " rad, further than the motion goes from row to row",
                         "divided there"});
  return cuts;
}

void interpolate_torque_spikes(Source& source, Diagnoses& diagnoses) {
  std::vector<double>* const torque = column_of(source, "torque_measured_Nm");
  if (torque == nullptr || torque->size() < kMinRowsOfPart) return;
  // Wide enough that the longest spike leaves no trace in it.
  const std::vector<double> smooth = medians_of_five(*torque);
  std::vector<double> beyond = *torque;
  for (std::size_t i = 0; i < torque->size(); ++i) beyond[i] -= smooth[i];
  const double usual = fit::quantile(magnitudes(*torque), 1 - kMaxSpikes);
  const double least = kSpikeOverUsual * usual;
  const double sigma = fit::robust_sigma(beyond);
  std::vector<bool> spike(torque->size(), false);
  double largest = 0;
  for (std::size_t i = 1; i + 1 < torque->size(); ++i)
    spike[i] = std::abs((*torque)[i]) > least && least > 0 &&
               (std::abs(beyond[i]) > kSpikeSigmas * sigma || std::abs(smooth[i]) > least);
  const auto time_s = source.recording.column("time_s");
  const std::vector<double>* const command = column_of(source, "torque_command_Nm");
  const std::vector<double> kicks = kicks_of(source);
  const double least_kick = kSpikeSigmas * fit::robust_sigma(kicks);
  const auto apart = std::max(kRowsApart, static_cast<std::size_t>(kApart_s / fit::median(steps_of(time_s))));
  std::size_t mended = 0;
  for (const MarkedRun& run : runs_of(spike)) {
    if (run.to - run.from > kLongestSpike || run.to >= torque->size() || run.from == 0) continue;
    if (!returns(*torque, run) || (command != nullptr && is_commanded(*command, *torque, run, apart)) ||
        is_answered(kicks, least_kick, (*torque)[run.from] - (*torque)[run.from - 1], run))
      continue;
    for (std::size_t i = run.from; i < run.to; ++i) largest = std::max(largest, std::abs((*torque)[i]));
    interpolate(*torque, time_s, run.from, run.to);
    mended += run.to - run.from;
  }
  if (mended > 0)
    diagnoses.push_back({source.name, "torque_measured_Nm",
                         share_text(mended, torque->size()) + " of the values are spikes, up to " +
                             short_number(largest) + " N·m, while 99 % stay below " + short_number(usual) +
                             " N·m",
                         "interpolated"});
}

void mark_saturation(Source& source, Diagnoses& diagnoses) {
  const std::vector<double>* const torque = column_of(source, "torque_measured_Nm");
  if (torque == nullptr || torque->size() < kMinRowsOfPart) return;
  std::vector<double> values = *torque;
  std::ranges::sort(values);
  // The end of a sensor's range is a value far more frequent than the next one.
  const auto count = [&](double value) {
    const auto [first, last] = std::equal_range(values.begin(), values.end(), value);
    return static_cast<std::size_t>(last - first);
  };
  const auto beside = [&](bool top) {
    const auto [first, last] =
        std::equal_range(values.begin(), values.end(), top ? values.back() : values.front());
    if (top) return first == values.begin() ? values.front() : *(first - 1);
    return last == values.end() ? values.back() : *last;
  };
  std::vector<double> saturated(torque->size(), 0);
  std::size_t marked = 0;
  double end_Nm = 0;
  for (const bool top : {false, true}) {
    const double end = top ? values.back() : values.front();
    const std::size_t there = count(end);
    if (beside(top) == end ||
        std::abs(end - beside(top)) > kMaxSensorStep * (values.back() - values.front()) ||
        static_cast<double>(there) < kMinSaturated * static_cast<double>(values.size()) ||
        there < kFarMore * count(beside(top)))
      continue;
    for (std::size_t i = 0; i < torque->size(); ++i)
      if ((*torque)[i] == end) saturated[i] = 1;
    marked += there;
    end_Nm = end;
  }
  if (marked == 0) return;
  diagnoses.push_back({source.name, "torque_measured_Nm",
                       share_text(marked, torque->size()) +
                           " of the values are the end of the sensor's range, " +
                           short_number(std::abs(end_Nm)) + " N·m: it is saturated there",
                       "left out"});
  source.recording.columns.push_back({kSaturated, std::move(saturated)});
}

std::vector<std::size_t> fresh_rows(const Source& source, Diagnoses& diagnoses) {
  std::string_view slowest;
  std::size_t held = 1;
  for (const char* name : {"torque_measured_Nm", "position_rad", "velocity_rad_per_s"}) {
    if (!source.recording.has(name)) continue;
    if (name == std::string_view("velocity_rad_per_s") && source.recording.has("position_rad")) continue;
    const std::size_t rows = held_rows(source.recording.column(name));
    if (rows > held) {
      held = rows;
      slowest = name;
    }
  }
  std::vector<std::size_t> rows;
  if (held == 1) {
    rows.resize(source.recording.rows());
    std::iota(rows.begin(), rows.end(), std::size_t{0});
    return rows;
  }
  const auto values = source.recording.column(slowest);
  std::size_t last = 0;
  for (std::size_t i = 1; i < values.size(); ++i) {
    if (values[i] == values[i - 1] && i - last < held) continue;
    rows.push_back(i);
    last = i;
  }
  diagnoses.push_back({source.name, std::string(slowest),
                       "is held: a fresh value comes every " + std::to_string(held) + " rows",
                       "only rows with a fresh value are used"});
  return rows;
}

Source with_rows(Source source, const std::vector<std::size_t>& rows) {
  for (Recording::Column& column : source.recording.columns) {
    for (std::size_t k = 0; k < rows.size(); ++k) column.values[k] = column.values[rows[k]];
    column.values.resize(rows.size());
    column.values.shrink_to_fit();
  }
  return source;
}

std::vector<Source> divided(Source source, const std::set<std::size_t>& cuts, Diagnoses& diagnoses) {
  const auto time_s = source.recording.column("time_s");
  const std::vector<double> steps = steps_of(time_s);
  std::vector<Source> parts;
  const auto undivided = [&] {
    parts.push_back(std::move(source));
    return std::move(parts);
  };
  if (steps.empty()) return undivided();
  const std::vector<Rate> rates = rates_of(steps);
  std::set<std::size_t> all = cuts;
  for (std::size_t r = 1; r < rates.size(); ++r) all.insert(rates[r].from);
  std::size_t late = 0;
  std::size_t holes = 0;
  double longest = 0;
  for (std::size_t i = 0; i < steps.size(); ++i) {
    const double usual = usual_s(rates, i);
    late += steps[i] > 1.5 * usual ? 1 : 0;
    if (steps[i] <= kBridgedPeriods * usual) continue;
    ++holes;
    longest = std::max(longest, steps[i]);
    all.insert(i + 1);
  }
  if (late - holes > static_cast<std::size_t>(kManyHoles * static_cast<double>(steps.size())))
    diagnoses.push_back({source.name, "time_s",
                         share_text(late - holes, steps.size()) +
                             " of the rows come late, or rows before them "
                             "are missing",
                         "interpolated"});
  if (all.empty()) return undivided();
  if (rates.size() > 1)
    diagnoses.push_back({source.name, "time_s",
                         "the rate changes from " + short_number(1 / rates[0].step_s) + " to " +
                             short_number(1 / rates[1].step_s) + " Hz at " +
                             short_number(time_s[rates[1].from]) + " s" +
                             (rates.size() > 2 ? ", and later again" : ""),
                         "divided there"});
  if (holes > 0)
    diagnoses.push_back({source.name, "time_s",
                         std::to_string(holes) + " holes of up to " + short_number(longest) + " s",
                         "divided there"});
  std::vector<MarkedRun> kept;
  std::size_t lost = 0;
  std::size_t slow = 0;
  std::size_t from = 0;
  const double slowest_s = kBridgedPeriods * std::ranges::max(rates, {}, [](const Rate& rate) {
                                               return rate.to - rate.from;
                                             }).step_s;
  all.insert(time_s.size());
  for (const std::size_t to : all) {
    if (to - from < kMinRowsOfPart)
      lost += to - from;
    else if (usual_s(rates, from) > slowest_s)
      slow += to - from;
    else
      kept.push_back({from, to});
    from = to;
  }
  for (const MarkedRun& stretch : kept)
    parts.push_back({.name = source.name + ", " + short_number(time_s[stretch.from]) + " s to " +
                             short_number(time_s[stretch.to - 1]) + " s",
                     .recording = {.rig = source.recording.rig,
                                   .experiment = source.recording.experiment,
                                   .sample_rate_Hz = rates.size() > 1 ? 0 : source.recording.sample_rate_Hz,
                                   .comments = source.recording.comments,
                                   .columns = {}},
                     .path = source.path,
                     .running_from_s = source.running_from_s.value_or(time_s.front())});
  if (parts.empty())
    throw std::invalid_argument(
        path_of(source) + ": " + std::to_string(all.size() - 1) +
        " holes in time_s, changes of its rate or jumps of position_rad leave no part of " +
        std::to_string(kMinRowsOfPart) + " rows; record again");
  if (lost > 0)
    diagnoses.push_back({source.name, "time_s",
                         share_text(lost, time_s.size()) + " of the rows are in parts too short to use",
                         "left out"});
  // All recordings are compared at the lowest of their rates.
  if (slow > 0)
    diagnoses.push_back(
        {source.name, "time_s",
         share_text(slow, time_s.size()) + " of the rows have less than a fifth of the usual rate",
         "left out"});
  // Column by column, so that only one of them is duplicated.
  for (Recording::Column& column : source.recording.columns) {
    for (std::size_t i = 0; i < kept.size(); ++i) {
      const auto begin = column.values.begin();
      parts[i].recording.columns.push_back({column.name,
                                            {begin + static_cast<std::ptrdiff_t>(kept[i].from),
                                             begin + static_cast<std::ptrdiff_t>(kept[i].to)}});
    }
    column.values = {};
  }
  return parts;
}

}  // namespace identification::gap
