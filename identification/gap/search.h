/// @file
/// Which effects of the library the data asks for, one by one.
#pragma once
#include <Eigen/Core>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "identification/gap/fitted_model.h"
#include "identification/gap/gap.h"

namespace identification::gap {

/// The rows a search may look at, in blocks that are left out as wholes.
struct Training {
  std::vector<Eigen::Index> rows;
  std::vector<int> block;  ///< of each of these
  double least_Nm = 0;     ///< rms that an effect has to take away to be worth a name
};

/// Another effect in place of one that was added, everything refitted.
struct RivalModel {
  std::string effect;
  FittedModel model{};
  int wins = 0;  ///< of kNoiseDraws
};

struct Added {
  std::string_view effect;
  FittedModel before;
  FittedModel after;
  double gain = 0;  ///< share of the squared residual of the blocks that the search left out
  int blocks_improved = 0;
  int blocks = 0;
  double p_value = 1;
  std::vector<RivalModel> rivals{};  ///< each wins some draws of the noise; models by weigh_rivals()
  int wins = 0;                      ///< its own
  FittedModel without{};             ///< the delivered model, refitted without it, by deliver()
  bool judged_by_held_out = false;   ///< by deliver(): `gain` is of held-out recordings that are sure of it
};
struct SearchResult {
  FittedModel fitted;
  std::vector<Added> added;
  struct Rejected {
    std::string effect;
    double gain;  ///< share of the squared residual that it would still take away
    std::string reason;
  };
  std::vector<Rejected> rejected;  ///< effects that are not in it
};

/// Begins with the given model, whose parameters are refitted with every hypothesis, and adds the effect that
/// predicts the left-out blocks best, as long as its gain is more than chance gives the whole search: the
/// same search on the model's own residuals, cut into stretches that are put elsewhere with a random sign,
/// which keeps their colour and destroys what they had to do with the motion. After each addition, effects
/// that no longer gain leave. Where nothing gains any more, each effect has to win its name once more,
/// against all others in its place; when one loses it, the search goes on.
SearchResult search(const FittedModel& start, const Rows& rows, const Training& training,
                    const Options& options);

/// Whether an effect lets the load move against the motor or the ground: presliding, backlash, elasticity.
bool gives(std::string_view effect) noexcept;

/// Which effect of the model the i-th addition is: of its type, those of the given model come first, then in
/// the order in which they were added. None when another one that contains it has replaced it.
std::optional<std::size_t> place_of_added(const SearchResult& result, std::size_t i);
/// The model without the i-th addition, refitted: all parameters, or those for which is_free() is true; none
/// when another one has replaced that.
std::optional<FittedModel> without_added(const SearchResult& result, std::size_t i, const Rows& rows,
                                         const Training& training,
                                         const std::function<bool(const FreeParameter&)>& is_free = {});

/// The model with one of these effects more, each in its best shape and refined; those that have none are
/// left out.
std::vector<RivalModel> with_one_of(const FittedModel& without, const std::vector<std::string>& effects,
                                    const Rows& rows, const Training& training);
/// Squares of what a model leaves of blocks that it was not fitted to, its parameters free, by block.
std::vector<double> left_out_squares(const FittedModel& fitted, const Rows& rows, const Training& training);

}  // namespace identification::gap
