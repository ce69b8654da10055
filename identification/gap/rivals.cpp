#include "identification/gap/rivals.h"

#include <cstddef>
#include <optional>
#include <utility>

#include "identification/gap/noise_draws.h"

namespace identification::gap {

void weigh_rivals(SearchResult& result, const Rows& rows, const Training& training, const Options& options) {
  for (std::size_t i = 0; i < result.added.size(); ++i) {
    Added& added = result.added[i];
    if (added.rivals.empty()) continue;
    std::vector<std::string> names;
    for (const RivalModel& rival : added.rivals) names.push_back(rival.effect);
    added.rivals.clear();
    const std::optional<FittedModel> without = without_added(result, i, rows, training);
    if (!without) continue;
    std::vector<RivalModel> rivals = with_one_of(*without, names, rows, training);
    std::vector<std::vector<double>> squares{left_out_squares(result.fitted, rows, training)};
    for (const RivalModel& rival : rivals) squares.push_back(left_out_squares(rival.model, rows, training));
    const std::vector<int> wins = draws_won(squares, options.seed);
    added.wins = wins.front();
    for (std::size_t k = 0; k < rivals.size(); ++k) {
      rivals[k].wins = wins[k + 1];
      if (rivals[k].wins > 0) added.rivals.push_back(std::move(rivals[k]));
    }
  }
}

}  // namespace identification::gap
