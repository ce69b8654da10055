#include "identification/robot_gap/rivals.h"

#include <algorithm>
#include <functional>
#include <vector>

#include "identification/gap/noise_draws.h"

namespace identification::robot_gap {
namespace {

/// Candidates with this share of the chosen one's gain are fitted, the best of them.
constexpr double kNearGain = 0.8;
constexpr std::size_t kMostRivals = 8;
/// Draws that a rival must win: one of twenty happens to effects that are clearly worse.
constexpr int kLeastWins = 2;

/// Whether `outer` has all terms of `inner`.
bool contains(const Catalogue& catalogue, std::size_t outer, std::size_t inner) {
  const std::vector<std::size_t>& terms = catalogue.candidates[outer].terms;
  return std::ranges::all_of(catalogue.candidates[inner].terms,
                             [&](std::size_t term) { return std::ranges::find(terms, term) != terms.end(); });
}

}  // namespace

Rivals rivals_of(const View& view, const Linearised& rows, const Chosen& chosen, std::size_t place,
                 std::span<const std::size_t> banned, std::uint64_t seed) {
  const Catalogue& catalogue = view.catalogue();
  Chosen rest = chosen;
  rest.erase(rest.begin() + static_cast<std::ptrdiff_t>(place));
  const std::size_t own = chosen[place];
  const double before = rows.left_out(rest);
  const double gain = before - rows.left_out(chosen);
  struct Tried {
    std::size_t candidate = 0;
    double left = 0;
  };
  std::vector<Tried> tried;
  for (std::size_t c = 0; c < catalogue.candidates.size(); ++c) {
    const auto same = [&](std::size_t other) {
      return catalogue.candidates[c].same_effect(catalogue.candidates[other]);
    };
    if (std::ranges::any_of(chosen, same) || std::ranges::any_of(banned, same) || contains(catalogue, c, own))
      continue;
    Chosen with = rest;
    with.push_back(c);
    if (const double left = rows.left_out(with); before - left >= kNearGain * gain)
      tried.push_back({c, left});
  }
  std::ranges::stable_sort(tried, {}, &Tried::left);
  if (tried.size() > kMostRivals) tried.resize(kMostRivals);
  std::vector<std::size_t> others;
  std::vector<std::vector<double>> squares{rows.fit(chosen).held_out_of};
  for (const Tried& one : tried) {
    Chosen with = rest;
    with.push_back(one.candidate);
    others.push_back(one.candidate);
    squares.push_back(left_out_squares(view, with));
  }
  const std::vector<int> wins = gap::draws_won(squares, seed);
  Rivals result;
  result.own_wins = wins.front();
  for (std::size_t i = 0; i < others.size(); ++i) {
    if (wins[i + 1] < kLeastWins) continue;
    // The best variant of each.
    const auto known = std::ranges::find_if(result.rivals, [&](const Rival& rival) {
      return catalogue.candidates[rival.candidate].same_effect(catalogue.candidates[others[i]]);
    });
    if (known == result.rivals.end())
      result.rivals.push_back({others[i], wins[i + 1]});
    else
      known->wins += wins[i + 1];
  }
  std::ranges::stable_sort(result.rivals, std::ranges::greater{}, &Rival::wins);
  return result;
}

}  // namespace identification::robot_gap
