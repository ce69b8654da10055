/// @file
/// Which experiment would tell models apart that the data at hand cannot.
#pragma once
#include <optional>
#include <span>
#include <vector>

#include "identification/gap/bench_experiments.h"
#include "identification/gap/fitted_model.h"
#include "identification/gap/gap.h"
#include "identification/gap/signals.h"

namespace identification::gap {

/// Data at hand, to which every model has been fitted.
struct AtHand {
  const Rows& rows;
  const std::vector<Eigen::Index>& use;
  const Band& band;
  double noise_Nm = 0;  ///< of a row, beyond what a model explains
};

/// Of the drive in those recordings: no more than it has done in them.
DriveLimits limits_of(std::span<const Signals> signals);

/// What a drive may be, and what else it may be taken for.
struct Pair {
  FittedModel truth;
  FittedModel rival;
};

/// By how much the recording of an experiment separates the two, in standard deviations of the noise, after
/// the rival is fitted to it and to the data at hand:
///   min over δ of √(|Δ − J·δ|² + |J₀·δ|²)/σ
/// with Δ the difference of the two predictions and J, J₀ the rival's Jacobians of the new and the old rows.
/// At rest, where rows say nothing, by how much more or less the joint gives under the torque, in steps of
/// the encoder, whatever the rival's stiffness.
double separation(const Pair& pair, const Source& experiment, const AtHand& at_hand);

/// What a drive that is as the model says records in an experiment; none where it goes beyond its limits or
/// youbot-bench stops it.
std::optional<Source> carried_out(const model::effects::DriveModel& model,
                                  experiments::JointExperiment& experiment, const DriveLimits& limits,
                                  const BenchStops& stops = {});

/// For each question the experiment, carried out on `drive`, that separates all its pairs clearly: the one
/// with the largest separation per second of the pair that it separates least. None where no experiment does.
std::vector<std::optional<NextExperiment>> next_experiments(const model::effects::DriveModel& drive,
                                                            const std::vector<std::vector<Pair>>& questions,
                                                            const AtHand& at_hand, const DriveLimits& limits);

}  // namespace identification::gap
