#include "identification/gap/actuator_channel.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <functional>
#include <limits>
#include <optional>
#include <string_view>
#include <utility>

#include "identification/fit/statistics.h"
#include "identification/gap/fitted_model.h"
#include "identification/gap/prediction.h"
#include "identification/gap/sign_test.h"
#include "identification/gap/speed_channel.h"
#include "identification/gap/zero_phase.h"
#include "model/effects/effect_chain.h"

namespace identification::gap {
namespace {

/// Minimum share of the squared misfit between command and measured torque for an effect to be named.
constexpr double kMinGain = 0.1;
/// A row may hold the torque from before its command: up to this many sample periods are not a delay.
constexpr double kMinPeriods = 1.5;
/// Pieces of this length, at most this many: the actuator is the same everywhere.
constexpr double kPiece_s = 1.0;
constexpr std::size_t kMaxPieces = 80;
/// Time after which a piece's delay line and lag have settled.
constexpr double kSettle_s = 0.1;
/// Torque constants are not known better: a gain that differs from one by less has no name.
constexpr double kMinGainError = 0.03;
/// One round per kind of effect.
constexpr int kActuatorRounds = 6;
constexpr std::size_t kMinRepeats = 20;
constexpr std::size_t kFarMoreRepeats = 5;
/// Share of the largest command below which no limit of the torque is looked for.
constexpr double kLowestLimit = 0.1;
/// Command that varies by a smaller share of its square shows no gain.
constexpr double kMinVariation = 1e-6;

/// A lag of this or less may be a current loop's or the sensor's.
constexpr double kLongestLoop_s = 0.01;
constexpr double kSlowestActuator_s = 1.0;

constexpr std::array<std::string_view, 6> kChain{"torque_deadband", "torque_saturation", "transport_delay",
                                                 "torque_lag",      "actuator_gain",     "actuator_offset"};

constexpr const char* kMisfit = "misfit of command and measured torque";
/// Share of a delay or lag, by which the measured torque is late against the motion.
constexpr double kOfSensor = 0.7;

/// Hypothesis of one simple actuator: the command through the effects, through a lag, times a gain, plus a
/// constant.
struct Actuator {
  double threshold_Nm = 0;
  double limit_Nm = 0;  ///< 0: none
  double delay_s = 0;
  double lag_s = 0;
  double gain = 1;
  double offset_Nm = 0;
};

model::effects::ParameterDescription range_of(std::string_view effect, std::string_view parameter) {
  const auto parameters = model::effects::effect_description(effect).parameters;
  return *std::ranges::find(parameters, parameter, &model::effects::ParameterDescription::name);
}

bool is_within(std::string_view effect, std::string_view parameter, double value) {
  const auto range = range_of(effect, parameter);
  return value >= range.lower && value <= range.upper;
}

std::vector<double> delivered(const Signals& s, const model::effects::DriveModel& base,
                              const Actuator& actuator) {
  std::vector<model::effects::AnyEffect> effects = base.effects;
  if (actuator.threshold_Nm > 0)
    effects.push_back(
        model::effects::make_effect("torque_deadband", {{"threshold_Nm", actuator.threshold_Nm}}));
  if (actuator.limit_Nm > 0)
    effects.push_back(model::effects::make_effect("torque_saturation", {{"limit_Nm", actuator.limit_Nm}}));
  if (actuator.delay_s > 0)
    effects.push_back(model::effects::make_effect(
        "transport_delay", {{"delay_s", std::min(actuator.delay_s, model::effects::DelayLine::kLongest_s)}}));
  model::effects::EffectChain chain(effects);
  std::vector<double> result;
  result.reserve(s.raw_command_Nm.size());
  // What came before is not here: until the first command arrives, a lag is where the sensor shows it.
  const auto unknown =
      actuator.gain != 0 ? static_cast<std::size_t>(actuator.delay_s / s.raw_period_s) + 1 : 0;
  double state = s.raw_command_Nm.empty() ? 0 : s.raw_command_Nm.front();
  const double follow = actuator.lag_s > 0 ? -std::expm1(-s.raw_period_s / actuator.lag_s) : 1;
  for (std::size_t i = 0; i < s.raw_command_Nm.size(); ++i) {
    state += follow * (chain.deliver(s.raw_command_Nm[i], s.raw_period_s) - state);
    if (i < unknown) state = (s.raw_measured_Nm[i] - actuator.offset_Nm) / actuator.gain;
    result.push_back(actuator.gain * state + actuator.offset_Nm);
  }
  return result;
}

std::size_t settled(const Signals& piece) {
  return std::min(piece.raw_command_Nm.size() / 4, static_cast<std::size_t>(kSettle_s / piece.raw_period_s));
}

/// Sum of squared misfit of each piece, after it has settled.
std::vector<double> misfit(const std::vector<Signals>& pieces, const model::effects::DriveModel& base,
                           const Actuator& actuator) {
  std::vector<double> squares;
  for (const Signals& s : pieces) {
    const std::vector<double> predicted = delivered(s, base, actuator);
    double square = 0;
    for (std::size_t i = settled(s); i < predicted.size(); ++i) {
      const double error = s.raw_measured_Nm[i] - predicted[i];
      square += error * error;
    }
    squares.push_back(square);
  }
  return squares;
}

/// Stretches of the recordings in which the command changes, evenly spread.
std::vector<Signals> pieces_of(std::span<const Signals> signals) {
  struct Place {
    const Signals* signals;
    std::size_t first;
    std::size_t length;
  };
  std::vector<Place> places;
  for (const Signals& s : signals) {
    const auto length = static_cast<std::size_t>(std::max(20.0, kPiece_s / s.raw_period_s));
    for (std::size_t first = 0; first + length <= s.raw_measured_Nm.size(); first += length)
      places.push_back({&s, first, length});
  }
  const std::size_t count = std::min(kMaxPieces, places.size());
  std::vector<Signals> pieces(count);
  for (std::size_t i = 0; i < count; ++i) {
    const Place& place = places[i * places.size() / count];
    const auto cut = [&](const std::vector<double>& values) {
      const auto begin = values.begin() + static_cast<std::ptrdiff_t>(place.first);
      return std::vector<double>(begin, begin + static_cast<std::ptrdiff_t>(place.length));
    };
    pieces[i].raw_period_s = place.signals->raw_period_s;
    pieces[i].raw_command_Nm = cut(place.signals->raw_command_Nm);
    pieces[i].raw_measured_Nm = cut(place.signals->raw_measured_Nm);
  }
  return pieces;
}

/// With the gain, the offset or both that fit best; the other keeps its value.
enum class Scale : std::uint8_t { kGain, kOffset, kBoth };
Actuator with_scale(const std::vector<Signals>& pieces, const model::effects::DriveModel& base,
                    Actuator actuator, Scale free) {
  const double offset_Nm = free == Scale::kGain ? actuator.offset_Nm : 0;
  const double gain = actuator.gain;
  actuator.gain = 1;
  actuator.offset_Nm = 0;
  double n = 0;
  double x = 0;
  double y = 0;
  double xx = 0;
  double xy = 0;
  for (const Signals& s : pieces) {
    const std::vector<double> predicted = delivered(s, base, actuator);
    for (std::size_t i = settled(s); i < predicted.size(); ++i) {
      n += 1;
      x += predicted[i];
      y += s.raw_measured_Nm[i];
      xx += predicted[i] * predicted[i];
      xy += predicted[i] * s.raw_measured_Nm[i];
    }
  }
  const double variation = free == Scale::kGain ? xx : xx - x * x / n;
  if (free == Scale::kOffset || !(variation > kMinVariation * xx))
    actuator.gain = gain;
  else
    actuator.gain = (free == Scale::kGain ? xy - offset_Nm * x : xy - x * y / n) / variation;
  actuator.offset_Nm = free == Scale::kGain ? offset_Nm : (y - actuator.gain * x) / n;
  return actuator;
}

double sum(const std::vector<double>& values) {
  double total = 0;
  for (const double value : values) total += value;
  return total;
}

/// Whether the largest magnitude is far more frequent than the one below: a sensor's end has no noise, a
/// motor's limit has that of its sensor.
bool ends_are_one_value(const std::vector<Signals>& pieces) {
  struct Count {
    double value_Nm = 0;
    std::size_t times = 0;
  };
  Count largest;
  Count below;
  for (const Signals& s : pieces) {
    for (const double measured : s.raw_measured_Nm) {
      const double value_Nm = std::abs(measured);
      if (value_Nm > largest.value_Nm) below = std::exchange(largest, Count{value_Nm, 0});
      if (value_Nm > below.value_Nm && value_Nm < largest.value_Nm) below = {value_Nm, 0};
      if (value_Nm == largest.value_Nm) ++largest.times;
      if (value_Nm == below.value_Nm) ++below.times;
    }
  }
  return largest.times > kMinRepeats && largest.times > kFarMoreRepeats * below.times;
}

/// The value with the least misfit: a grid, then golden-section search around its best point.
double least(const std::vector<double>& grid, const std::function<double(double)>& cost) {
  std::size_t best = 0;
  double lowest = cost(grid[0]);
  for (std::size_t i = 1; i < grid.size(); ++i) {
    const double value = cost(grid[i]);
    if (value < lowest) {
      lowest = value;
      best = i;
    }
  }
  constexpr double kGolden = 0.6180339887;
  double a = grid[best > 0 ? best - 1 : 0];
  double b = grid[std::min(best + 1, grid.size() - 1)];
  double left = b - kGolden * (b - a);
  double right = a + kGolden * (b - a);
  double cost_left = cost(left);
  double cost_right = cost(right);
  for (int i = 0; i < 14; ++i) {
    if (cost_left < cost_right) {
      b = right;
      right = left;
      cost_right = cost_left;
      cost_left = cost(left = b - kGolden * (b - a));
    } else {
      a = left;
      left = right;
      cost_left = cost_right;
      cost_right = cost(right = a + kGolden * (b - a));
    }
  }
  return 0.5 * (a + b);
}

std::vector<double> geometric(double from, double to, int count) {
  std::vector<double> grid;
  for (int i = 0; i < count; ++i)
    grid.push_back(from * std::pow(to / from, static_cast<double>(i) / (count - 1)));
  return grid;
}

std::vector<double> linear(double from, double to, int count) {
  std::vector<double> grid;
  for (int i = 0; i < count; ++i) grid.push_back(from + (to - from) * i / (count - 1));
  return grid;
}

fit::Estimate estimate(const char* name, double value, double half_width) {
  return {.name = name, .value = value, .lower = value - half_width, .upper = value + half_width};
}

/// Half the 95 % interval, from groups of pieces that are fitted separately.
double half_width(const std::vector<Signals>& pieces,
                  const std::function<double(const std::vector<Signals>&)>& fit) {
  constexpr std::size_t kGroups = 6;
  double mean = 0;
  double square = 0;
  for (std::size_t group = 0; group < kGroups; ++group) {
    std::vector<Signals> own;
    for (std::size_t i = group; i < pieces.size(); i += kGroups) own.push_back(pieces[i]);
    if (own.empty()) return std::numeric_limits<double>::infinity();
    const double value = fit(own);
    mean += value / kGroups;
    square += value * value / kGroups;
  }
  const double sigma = std::sqrt(std::max(0.0, square - mean * mean) / (kGroups - 1));
  return fit::student_975(kGroups - 1) * sigma;
}

}  // namespace

ActuatorFindings actuator_channel(std::span<const Signals> all, const model::effects::DriveModel& base,
                                  const Options& options) {
  ActuatorFindings findings;
  const std::vector<Signals> signals = pieces_of(all);
  double largest = 0;
  double period_s = 0;
  for (const Signals& s : signals) {
    period_s = std::max(period_s, s.raw_period_s);
    for (const double command : s.raw_command_Nm) largest = std::max(largest, std::abs(command));
  }
  if (signals.empty() || largest == 0) {
    if (auto delay = speed_command_delay(all, base, options)) findings.effects.push_back(std::move(*delay));
    return findings;
  }

  std::size_t samples = 0;
  for (const Signals& s : signals) samples += s.raw_command_Nm.size() - settled(s);
  const auto rms = [&](const std::vector<double>& blocks) {
    return std::sqrt(sum(blocks) / static_cast<double>(samples));
  };
  const auto cost = [&](const Actuator& a) { return sum(misfit(signals, base, a)); };

  Actuator actuator;
  const double longest_loop_s = std::max(kLongestLoop_s, kMinPeriods * period_s);
  const auto fit_lag_of = [&](Actuator a, const std::vector<double>& grid) {
    a.lag_s = least(grid, [&](double lag) {
      Actuator b = a;
      b.lag_s = lag;
      return cost(b);
    });
    return a;
  };
  const auto fit_loop = [&](const Actuator& a) { return fit_lag_of(a, linear(0, longest_loop_s, 12)); };
  const std::vector<double> lags_s = geometric(longest_loop_s, kSlowestActuator_s, 24);
  // Of a row's command, or of that before.
  const auto fit_lag = [&](Actuator a) {
    a.delay_s = 0;
    const Actuator same_row = fit_lag_of(a, lags_s);
    if (base.find<model::effects::TransportDelay>()) return same_row;
    a.delay_s = period_s;
    const Actuator next_row = fit_lag_of(a, lags_s);
    return cost(next_row) < cost(same_row) ? next_row : same_row;
  };
  const auto fit_delay = [&](Actuator a) {
    a.delay_s = least(linear(period_s, std::min(0.4, 50 * period_s), 50), [&](double x) {
      Actuator b = a;
      b.delay_s = x;
      return cost(b);
    });
    return a;
  };
  // A delay and a lag trade time: for each delay its own lag.
  const auto fit_both = [&](Actuator a) {
    const std::vector<double> shorter_s = geometric(longest_loop_s, a.lag_s, 6);
    const auto with_lag = [&](double delay_s) {
      Actuator b = a;
      b.delay_s = delay_s;
      return fit_lag_of(b, shorter_s);
    };
    return with_lag(least(linear(period_s, std::min(0.4, 50 * period_s), 25),
                          [&](double x) { return cost(with_lag(x)); }));
  };
  actuator = fit_loop(actuator);
  bool delayed = false;
  bool lagged = false;
  if (!base.find<model::effects::TransportDelay>()) {
    const Actuator next_row = fit_loop({.delay_s = period_s});
    if (cost(next_row) < (1 - kMinGain) * cost(actuator)) actuator = next_row;
  }

  const bool has_deadband = base.find<model::effects::TorqueDeadband>() != nullptr;
  // Also not if a few rows are longer than any delay in the search range.
  const bool has_delay = base.find<model::effects::TransportDelay>() != nullptr ||
                         kMinPeriods * period_s >= model::effects::DelayLine::kLongest_s;
  const bool has_lag = base.find<model::effects::TorqueLag>() != nullptr;
  const double highest_limit = std::min(largest, range_of("torque_saturation", "limit_Nm").upper);
  const bool has_limit = base.find<model::effects::TorqueSaturation>() != nullptr;
  bool scaled = false;
  bool shifted = false;
  // A gain and an offset that have a name are fitted again beside everything else.
  const auto rescaled = [&](const std::vector<Signals>& part, const Actuator& a) {
    if (!scaled && !shifted) return a;
    return with_scale(part, base, a,
                      scaled && shifted ? Scale::kBoth
                      : scaled          ? Scale::kGain
                                        : Scale::kOffset);
  };
  for (int round = 0; round < kActuatorRounds; ++round) {
    const std::vector<double> now = misfit(signals, base, actuator);
    struct Try {
      const char* name;
      Actuator actuator;
      std::vector<double> blocks;
    };
    std::optional<Try> best;
    const auto consider = [&](const char* name, const Actuator& a) {
      std::vector<double> blocks = misfit(signals, base, a);
      if (!best || sum(blocks) < sum(best->blocks)) best = Try{name, a, std::move(blocks)};
    };
    const double most =
        std::min(usual_command_Nm(signals), range_of("torque_deadband", "threshold_Nm").upper);
    if (!has_deadband && actuator.threshold_Nm == 0 && most > 0.01 * largest) {
      const auto fit = [&](const std::vector<Signals>& part) {
        return least(linear(0.01 * largest, most, 30), [&](double x) {
          Actuator b = actuator;
          b.threshold_Nm = x;
          return sum(misfit(part, base, b));
        });
      };
      Actuator a = actuator;
      a.threshold_Nm = fit(signals);
      consider("torque_deadband", a);
    }
    if (!has_limit && actuator.limit_Nm == 0) {
      Actuator a = actuator;
      a.limit_Nm = least(linear(kLowestLimit * highest_limit, highest_limit, 30), [&](double x) {
        Actuator b = actuator;
        b.limit_Nm = x;
        return cost(b);
      });
      consider("torque_saturation", a);
    }
    if (!has_delay && !delayed) {
      Actuator a = actuator;
      if (lagged) {
        a = fit_both(a);
      } else {
        a.lag_s = 0;
        a = fit_loop(fit_delay(a));
      }
      if (a.delay_s >= kMinPeriods * period_s) consider("transport_delay", a);
    }
    if (!has_lag && !lagged) {
      const Actuator a = delayed ? fit_both(fit_lag_of(actuator, lags_s)) : fit_lag(actuator);
      if (a.lag_s > longest_loop_s) consider("torque_lag", a);
    }
    if (!scaled) {
      const Actuator a = with_scale(signals, base, actuator, shifted ? Scale::kBoth : Scale::kGain);
      if (std::abs(a.gain - 1) >= kMinGainError && is_within("actuator_gain", "gain", a.gain))
        consider("actuator_gain", a);
    }
    if (!shifted) {
      const Actuator a = with_scale(signals, base, actuator, scaled ? Scale::kBoth : Scale::kOffset);
      if (is_within("actuator_offset", "torque_Nm", a.offset_Nm)) consider("actuator_offset", a);
    }
    if (!best) break;
    const double gain = 1 - sum(best->blocks) / sum(now);
    const double chance = chance_of(now, best->blocks);
    if (gain < kMinGain || chance > options.false_positive_rate) break;
    const std::string_view name = best->name;
    if (name == "torque_saturation" && ends_are_one_value(signals)) {
      // The sensor's end, or the motor's: the diagnosis lists it and leaves these samples out.
      actuator = best->actuator;
      continue;
    }
    FoundEffect found{.effect = model::effects::make_effect(name),
                      .where = {},
                      .measured_on = kMisfit,
                      .held_out_gain = gain};
    const Actuator chosen = best->actuator;
    if (name == "torque_deadband") {
      found.effect = model::effects::make_effect("torque_deadband", {{"threshold_Nm", chosen.threshold_Nm}});
      found.where = {
          .coordinate = "torque_command_Nm", .from = -chosen.threshold_Nm, .to = chosen.threshold_Nm};
      const double half = half_width(signals, [&](const std::vector<Signals>& part) {
        return least(linear(0.5 * chosen.threshold_Nm, 1.5 * chosen.threshold_Nm, 11), [&](double x) {
          Actuator b = chosen;
          b.threshold_Nm = x;
          return sum(misfit(part, base, b));
        });
      });
      found.parameters = {
          estimate("threshold_Nm", chosen.threshold_Nm, std::max(half, 0.002 * chosen.threshold_Nm))};
    } else if (name == "torque_saturation") {
      found.effect = model::effects::make_effect("torque_saturation", {{"limit_Nm", chosen.limit_Nm}});
      found.where = {.coordinate = "torque_command_Nm", .from = chosen.limit_Nm, .to = largest};
      const double half = half_width(signals, [&](const std::vector<Signals>& part) {
        return least(linear(0.8 * chosen.limit_Nm, std::min(1.2 * chosen.limit_Nm, highest_limit), 11),
                     [&](double x) {
                       Actuator b = chosen;
                       b.limit_Nm = x;
                       return sum(misfit(part, base, b));
                     });
      });
      found.parameters = {estimate("limit_Nm", chosen.limit_Nm, half)};
    } else if (name == "transport_delay" || name == "torque_lag") {
      found.where = {.coordinate = "frequency_Hz", .from = 0, .to = 0.5 / period_s};
      delayed = delayed || name == "transport_delay";
      lagged = lagged || name == "torque_lag";
    } else {
      found.where = {.coordinate = "torque_command_Nm", .from = -largest, .to = largest};
      scaled = scaled || name == "actuator_gain";
      shifted = shifted || name == "actuator_offset";
    }
    found.gap_before = rms(now);
    found.gap_after = rms(best->blocks);
    found.blocks = static_cast<int>(now.size());
    for (std::size_t b = 0; b < now.size(); ++b) found.blocks_improved += best->blocks[b] < now[b] ? 1 : 0;
    found.p_value = chance;
    findings.effects.push_back(std::move(found));
    actuator = rescaled(signals, chosen);
  }
  // Their sizes depend on what was found after them.
  for (FoundEffect& found : findings.effects) {
    const std::string_view name = model::effects::name_of(found.effect);
    if (name == "transport_delay") {
      if (actuator.delay_s < kMinPeriods * period_s) continue;  // a lag has taken its place
      // A row's measured torque answers the previous row; with a recorder that stores both at one instant it
      // appears a period later, which the interval covers.
      const double delay_s = actuator.delay_s - period_s;
      found.effect = model::effects::make_effect("transport_delay", {{"delay_s", delay_s}});
      const double half = half_width(signals, [&](const std::vector<Signals>& part) {
        return least(
            linear(std::max(0.0, actuator.delay_s - 3 * period_s), actuator.delay_s + 3 * period_s, 13),
            [&](double x) {
              Actuator b = actuator;
              b.delay_s = x;
              return sum(misfit(part, base, b));
            });
      });
      found.parameters = {estimate("delay_s", delay_s, std::max(half, 0.5 * period_s))};
      found.parameters.front().upper += period_s;
    } else if (name == "torque_lag") {
      found.effect = model::effects::make_effect("torque_lag", {{"time_constant_s", actuator.lag_s}});
      const double half = half_width(signals, [&](const std::vector<Signals>& part) {
        return least(linear(0.8 * actuator.lag_s, 1.2 * actuator.lag_s, 11), [&](double x) {
          Actuator b = actuator;
          b.lag_s = x;
          return sum(misfit(part, base, b));
        });
      });
      // A row's torque may be that of its own command or of the one before.
      found.parameters = {estimate("time_constant_s", actuator.lag_s, std::max(half, period_s))};
    }
    const bool is_gain = name == "actuator_gain";
    if (!is_gain && name != "actuator_offset") continue;
    const auto size = [is_gain](const Actuator& a) { return is_gain ? a.gain : a.offset_Nm; };
    const char* parameter = is_gain ? "gain" : "torque_Nm";
    const double half =
        half_width(signals, [&](const std::vector<Signals>& part) { return size(rescaled(part, actuator)); });
    const fit::Estimate fitted = estimate(parameter, size(actuator), half);
    const bool may_be_none =
        is_gain ? std::abs(fitted.value - 1) < kMinGainError : fitted.lower <= 0 && fitted.upper >= 0;
    found.parameters.clear();
    if (may_be_none || !is_within(name, parameter, fitted.value)) continue;
    found.effect = model::effects::make_effect(name, {{parameter, fitted.value}});
    found.parameters = {fitted};
  }
  std::erase_if(findings.effects, [](const FoundEffect& found) { return found.parameters.empty(); });
  // In a model they act in the order of its effects.
  std::ranges::sort(findings.effects, {}, [](const FoundEffect& found) {
    return std::ranges::find(kChain, model::effects::name_of(found.effect)) - kChain.begin();
  });
  // A difference in scale between command and measured torque is no noise, whether it has a name or not.
  actuator = with_scale(signals, base, actuator, Scale::kBoth);
  for (const Signals& s : all) {
    if (s.raw_measured_Nm.empty()) continue;
    std::vector<double> left = delivered(s, base, actuator);
    for (std::size_t i = 0; i < left.size(); ++i) left[i] = s.raw_measured_Nm[i] - left[i];
    findings.left_Nm.push_back(std::move(left));
  }
  return findings;
}

bool is_of_late_sensor(const FoundEffect& found, double late_s) {
  if (found.measured_on != kMisfit) return false;
  const std::string_view name = model::effects::name_of(found.effect);
  const char* const parameter = name == "transport_delay" ? "delay_s"
                                : name == "torque_lag"    ? "time_constant_s"
                                                          : nullptr;
  if (parameter == nullptr) return false;
  const double time_s = model::effects::parameter_of(found.effect, parameter);
  return late_s > kOfSensor * std::min(time_s, kLongestLag_s);
}

}  // namespace identification::gap
