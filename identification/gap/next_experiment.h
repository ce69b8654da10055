/// @file
/// Selects the experiment that would distinguish models that the available data cannot.
#pragma once
#include <optional>
#include <span>
#include <vector>

#include "identification/gap/bench_experiments.h"
#include "identification/gap/fitted_model.h"
#include "identification/gap/gap.h"
#include "identification/gap/signals.h"

namespace identification::gap {

/// Available data, to which every model has been fitted.
struct AtHand {
  const Rows& rows;
  const std::vector<Eigen::Index>& use;
  const Band& band;
  double noise_Nm = 0;  ///< of a row, beyond the model
};

/// Limits of the drive in those recordings.
DriveLimits limits_of(std::span<const Signals> signals);

/// A possible model of the drive, and a rival for which it may be mistaken.
struct Pair {
  FittedModel truth;
  FittedModel rival;
};

/// Separation of the two by the recording of an experiment, in standard deviations of the noise, after the
/// rival is fitted to it and to the available data:
///   min over δ of √(|Δ − J·δ|² + |J₀·δ|²)/σ
/// with Δ the difference of the two predictions and J, J₀ the rival's Jacobians of the new and the old rows.
/// At rest, where rows carry no information: the difference in compliance, in steps of the encoder, for any
/// stiffness of the rival.
double separation(const Pair& pair, const Source& experiment, const AtHand& at_hand);

/// Simulated recording of an experiment on a drive like the model; empty if it exceeds the limits or
/// youbot-bench stops it.
std::optional<Source> carried_out(const model::effects::DriveModel& model,
                                  experiments::JointExperiment& experiment, const DriveLimits& limits,
                                  const BenchStops& stops = {});

/// For each question the experiment, carried out on `drive`, that separates all its pairs clearly: the one
/// with the largest separation per second of its least separated pair. Empty if no experiment does.
std::vector<std::optional<NextExperiment>> next_experiments(const model::effects::DriveModel& drive,
                                                            const std::vector<std::vector<Pair>>& questions,
                                                            const AtHand& at_hand, const DriveLimits& limits);

}  // namespace identification::gap
