/// @file
/// Identification from recordings: friction from a steady-state map, and effects that a model lacks. Part of
/// the component `identification`: link youbot::identification.
///
///     const auto map = youbot::static_map(recordings);
///     const auto fit = youbot::fit_static(map, youbot::form_named("kfm"));     // values with 95 % intervals
///
///     const auto result = youbot::gap::analyse(...);                           // names what is missing
///     youbot::add_custom_effect({.name = ..., .load = ...});                   // an effect of your own,
///     tried too
///
/// Set-up only: allocates, takes seconds to minutes, and throws std::invalid_argument if the data cannot
/// answer the question.
#pragma once
#include "identification/fit/static_fit.h"
#include "identification/fit/static_map.h"
#include "identification/gap/gap.h"
#include "model/effects/custom.h"
#include "youbot/friction.h"
#include "youbot/recording.h"

namespace youbot {

using identification::fit::fit_static;
using identification::fit::form_named;
using identification::fit::static_map;
using identification::fit::StaticFit;
using identification::fit::StaticMap;
using model::effects::add_custom_effect;
using model::effects::CustomEffect;
using model::effects::Sliding;
namespace gap = identification::gap;

}  // namespace youbot
