#include "identification/gap/excerpts.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <string>
#include <utility>

#include "identification/gap/parallel.h"
#include "identification/gap/wording.h"

namespace identification::gap {
namespace {

/// Long enough that the filters' ends, and the unknown initial state of an excerpt, are negligible.
constexpr double kExcerpt_s = 4;
constexpr double kExcerptPeriods = 100;  // of the band's edge
/// Samples of the widest band.
constexpr double kKept_s = 2e-3;
/// Interval at which motion and torque are sampled, and over which the velocity is computed.
constexpr double kLook_s = 0.02;
constexpr double kVelocity_s = 0.05;
constexpr std::size_t kPositions = 48;
constexpr std::size_t kShares = 16;

/// Step between excerpts that avoids repetition: the fraction of the golden ratio.
constexpr double kGolden = 0.6180339887498949;

double mean_step_of(const Source& source) {
  const auto time_s = source.recording.column("time_s");
  return (time_s.back() - time_s.front()) / static_cast<double>(time_s.size() - 1);
}

std::vector<Excerpt> divided_evenly(std::span<const Source> sources, double length_s) {
  std::vector<Excerpt> result;
  for (std::size_t s = 0; s < sources.size(); ++s) {
    const std::size_t rows = sources[s].recording.rows();
    const auto parts = static_cast<std::size_t>(
        std::max(1.0, std::round(static_cast<double>(rows) * mean_step_of(sources[s]) / length_s)));
    for (std::size_t p = 0; p < parts; ++p) result.push_back({s, p * rows / parts, (p + 1) * rows / parts});
  }
  return result;
}

/// A sample of an excerpt.
struct Look {
  std::size_t excerpt;
  float position_rad;
  float velocity_rad_per_s;
  float torque_Nm;
};

std::vector<Look> looks_at(std::span<const Source> sources, std::span<const Excerpt> excerpts) {
  std::vector<Look> looks;
  for (std::size_t i = 0; i < excerpts.size(); ++i) {
    const Recording& recording = sources[excerpts[i].source].recording;
    const auto time_s = recording.column("time_s");
    const double period_s = mean_step_of(sources[excerpts[i].source]);
    const auto rows = [&](double seconds) {
      return static_cast<std::size_t>(std::max(1.0, std::round(seconds / period_s)));
    };
    const std::size_t back = rows(kVelocity_s);
    const bool has_position = recording.has("position_rad");
    const auto motion = recording.column(has_position ? "position_rad" : "velocity_rad_per_s");
    const auto torque =
        recording.column(recording.has("torque_measured_Nm") ? "torque_measured_Nm" : "torque_command_Nm");
    for (std::size_t row = excerpts[i].from + back; row < excerpts[i].to; row += rows(kLook_s)) {
      const double velocity = has_position
                                  ? (motion[row] - motion[row - back]) / (time_s[row] - time_s[row - back])
                                  : motion[row];
      looks.push_back({i, static_cast<float>(has_position ? motion[row] : 0), static_cast<float>(velocity),
                       static_cast<float>(torque[row])});
    }
  }
  return looks;
}

/// Cells by the share of values below each, narrower towards both ends: each is e^(1/2) times as far out as
/// the next.
std::vector<std::size_t> shares(const std::vector<Look>& looks, float Look::*quantity) {
  std::vector<std::size_t> order(looks.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::ranges::sort(order, {}, [&](std::size_t i) { return looks[i].*quantity; });
  std::vector<std::size_t> cells(looks.size());
  for (std::size_t from = 0; from < order.size();) {
    std::size_t to = from;
    while (to < order.size() && looks[order[to]].*quantity == looks[order[from]].*quantity) ++to;
    const double below = 0.5 * static_cast<double>(from + to) / static_cast<double>(order.size());
    const double place = 0.5 * static_cast<double>(kShares) + std::log(below / (1 - below));
    const auto cell = static_cast<std::size_t>(std::clamp(place, 0.0, static_cast<double>(kShares - 1)));
    for (; from < to; ++from) cells[order[from]] = cell;
  }
  return cells;
}

/// Number of cells that only this excerpt visits, plus its share of the visits to the others.
std::vector<double> rarity(const std::vector<Look>& looks, std::size_t excerpts) {
  std::vector<double> result(excerpts, 0);
  if (looks.empty()) return result;
  const auto add = [&](const std::vector<std::size_t>& cell, std::size_t cells) {
    std::vector<double> visits(cells, 0);
    for (const std::size_t c : cell) visits[c] += 1;
    for (std::size_t i = 0; i < looks.size(); ++i) result[looks[i].excerpt] += 1 / visits[cell[i]];
  };
  const auto [low, high] = std::ranges::minmax(looks, {}, &Look::position_rad);
  const double span = high.position_rad - low.position_rad;
  std::vector<std::size_t> cell(looks.size(), 0);
  for (std::size_t i = 0; i < looks.size() && span > 0; ++i)
    cell[i] = std::min(kPositions - 1, static_cast<std::size_t>((looks[i].position_rad - low.position_rad) /
                                                                span * static_cast<double>(kPositions)));
  add(cell, kPositions);
  cell = shares(looks, &Look::velocity_rad_per_s);
  const std::vector<std::size_t> torque = shares(looks, &Look::torque_Nm);
  for (std::size_t i = 0; i < looks.size(); ++i) cell[i] = cell[i] * kShares + torque[i];
  add(cell, kShares * kShares);
  return result;
}

Source part_of(const Source& source, const Excerpt& excerpt) {
  const auto time_s = source.recording.column("time_s");
  Source part{.name = source.name,
              .recording = {},
              .path = source.path,
              .running_from_s = source.running_from_s.value_or(time_s.front()),
              .signed_by_motion = source.signed_by_motion};
  for (const Recording::Column& column : source.recording.columns) {
    const auto begin = column.values.begin();
    part.recording.columns.push_back({column.name,
                                      {begin + static_cast<std::ptrdiff_t>(excerpt.from),
                                       begin + static_cast<std::ptrdiff_t>(excerpt.to)}});
  }
  return part;
}

/// Whether some of its rows, however few, are held out.
bool judges_anywhere(const Excerpt& excerpt, std::span<const double> time_s, const Judges& judges) {
  constexpr std::size_t kPlaces = 32;
  const double length_s = time_s.back() - time_s.front();
  for (std::size_t k = 0; k <= kPlaces; ++k) {
    const std::size_t row = excerpt.from + (excerpt.to - 1 - excerpt.from) * k / kPlaces;
    if (judges(excerpt.source, (time_s[row] - time_s.front()) / length_s)) return true;
  }
  return false;
}

bool is_whole(const Excerpt& excerpt, std::span<const Source> sources) {
  return excerpt.from == 0 && excerpt.to == sources[excerpt.source].recording.rows();
}

}  // namespace

std::vector<Excerpt> chosen_excerpts(std::span<const Source> sources, const Band& band, const Judges& judges,
                                     const Enough& enough) {
  double rows = 0;
  double samples = 0;
  std::vector<Excerpt> wholes;
  for (std::size_t s = 0; s < sources.size(); ++s) {
    wholes.push_back({s, 0, sources[s].recording.rows()});
    const auto own = static_cast<double>(wholes.back().to);
    rows += own;
    samples += own * std::min(1.0, mean_step_of(sources[s]) / kKept_s);
  }
  const double share =
      std::min(static_cast<double>(enough.rows) / rows, static_cast<double>(enough.samples) / samples);
  if (share >= 1) return wholes;

  const std::vector<Excerpt> all =
      divided_evenly(sources, std::max(kExcerpt_s, kExcerptPeriods / band.cutoff_Hz));
  std::array<std::vector<std::size_t>, 2> kinds;  // for the search and for the judgement
  for (std::size_t i = 0; i < all.size(); ++i)
    kinds[judges_anywhere(all[i], sources[all[i].source].recording.column("time_s"), judges) ? 1 : 0]
        .push_back(i);
  const std::vector<double> rare = rarity(looks_at(sources, all), all.size());
  std::vector<Excerpt> chosen;
  for (const std::vector<std::size_t>& kind : kinds) {
    const auto count = static_cast<std::size_t>(std::ceil(share * static_cast<double>(kind.size())));
    for (std::size_t n = 0; n < count; ++n) {
      const std::size_t from = n * kind.size() / count;
      const auto neighbours = std::span(kind).subspan(from, (n + 1) * kind.size() / count - from);
      const double turn = kGolden * static_cast<double>(n);
      const std::size_t by_number = neighbours[static_cast<std::size_t>(
          (turn - std::floor(turn)) * static_cast<double>(neighbours.size()))];
      const std::size_t rarest =
          *std::ranges::max_element(neighbours, {}, [&](std::size_t i) { return rare[i]; });
      chosen.push_back(all[&kind == &kinds[0] ? rarest : by_number]);
    }
  }
  std::ranges::sort(chosen, {}, [](const Excerpt& s) { return std::pair(s.source, s.from); });
  return chosen;
}

std::vector<Signals> signals_of(std::span<const Source> sources, std::span<const Excerpt> excerpts,
                                const Band& band) {
  std::vector<Signals> signals(excerpts.size());
  in_parallel(excerpts.size(), [&](std::size_t i) {
    const Excerpt& excerpt = excerpts[i];
    const Source& source = sources[excerpt.source];
    const bool whole = is_whole(excerpt, sources);
    signals[i] = make_signals(whole ? source : part_of(source, excerpt), band);
    signals[i].source = excerpt.source;
    if (whole) return;
    const auto time_s = source.recording.column("time_s");
    signals[i].recorded_from_s = time_s.front();
    signals[i].recorded_to_s = time_s.back();
  });
  return signals;
}

std::vector<Diagnosis> left_out(std::span<const Source> sources, std::span<const Excerpt> excerpts) {
  std::size_t all = 0;
  for (const Source& source : sources) all += source.recording.rows();
  std::size_t analysed = 0;
  for (const Excerpt& excerpt : excerpts) analysed += excerpt.to - excerpt.from;
  if (analysed == all) return {};
  const double length_s = static_cast<double>(excerpts.front().to - excerpts.front().from) *
                          mean_step_of(sources[excerpts.front().source]);
  return {{"all recordings", "time_s", std::to_string(all) + " rows are more than a search needs",
           "all rows were looked at for damage; " + std::to_string(excerpts.size()) + " excerpts of about " +
               short_number(length_s) + " s are analysed, " + std::to_string(analysed) +
               " rows: of neighbours the one with the rarest motion to search in, one by its number to judge "
               "with"}};
}

}  // namespace identification::gap
