/// @file
/// Searches for missing effects of the library, one by one.
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

/// The rows that a search may use, in blocks that cross-validation leaves out as a whole.
struct Training {
  std::vector<Eigen::Index> rows;
  std::vector<int> block;  ///< of each row
  double least_Nm = 0;     ///< rms that an effect must remove to be named
};

/// The model with another effect instead of an added one, refitted.
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
  std::vector<RivalModel> rivals{};  ///< each wins some noise draws; models by weigh_rivals()
  int wins = 0;                      ///< of the effect itself
  FittedModel without{};             ///< the delivered model, refitted without it, by deliver()
  bool judged_by_held_out =
      false;  ///< by deliver(): `gain` is that of held-out recordings, which are certain of it
};
struct SearchResult {
  FittedModel fitted;
  std::vector<Added> added;
  struct Rejected {
    std::string effect;
    double gain;  ///< share of the squared residual that it would still remove
    std::string reason;
  };
  std::vector<Rejected> rejected;  ///< effects that are not in the model
};

/// Starts with the given model, refits its parameters with every hypothesis, and adds the effect that
/// predicts the left-out blocks best, as long as its gain exceeds what the whole search gains by chance. The
/// gain by chance comes from the same search on the model's own residuals, cut into stretches that are moved
/// and given a random sign, which keeps their colour and destroys their relation to the motion. After each
/// addition, effects without a gain are removed. When no effect gains, each added effect is compared once
/// more with all others in its place; if one is replaced, the search continues.
SearchResult search(const FittedModel& start, const Rows& rows, const Training& training,
                    const Options& options);

/// Whether an effect allows the load to move relative to the motor or the ground: presliding, backlash,
/// elasticity.
bool gives(std::string_view effect) noexcept;

/// Whether the load behind the gap of a model goes from flank to flank several times, and the gap is small
/// against the stroke: otherwise the data show no free travel.
bool crosses_gap(const FittedModel& fitted, const Rows& rows);

/// Index of the i-th addition in the model's effects. Within a type, the effects of the given model come
/// first, then the additions in order. Empty if another effect that contains it has replaced it.
std::optional<std::size_t> place_of_added(const SearchResult& result, std::size_t i);
/// The model without the i-th addition, refitted: all parameters, or those for which is_free() is true. Empty
/// if another effect has replaced the addition.
std::optional<FittedModel> without_added(const SearchResult& result, std::size_t i, const Rows& rows,
                                         const Training& training,
                                         const std::function<bool(const FreeParameter&)>& is_free = {});

/// The models with one of these effects added, each in its best shape and refined; without the effects that
/// have no shape.
std::vector<RivalModel> with_one_of(const FittedModel& without, const std::vector<std::string>& effects,
                                    const Rows& rows, const Training& training);
/// Squared residuals by block, each with the model's free parameters fitted to the other blocks.
std::vector<double> left_out_squares(const FittedModel& fitted, const Rows& rows, const Training& training);

}  // namespace identification::gap
