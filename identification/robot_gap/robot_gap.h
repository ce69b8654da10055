/// @file
/// Finds where the model of an arm and recordings of it disagree, which part is wrong and by which effect.
#pragma once
#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "control/arm_description.h"
#include "identification/fit/statistics.h"
#include "identification/gap/gap.h"
#include "identification/robot_gap/arm_motion.h"

namespace identification::robot_gap {

using gap::Verdict;

/// Part of the disagreement in a range of one quantity.
struct Share {
  std::string coordinate;  ///< "joint", "speed", "direction", "pose", "load" or "time"
  std::string joint;       ///< of which joint; empty: all
  std::string recording;   ///< of time
  double from = 0;
  double to = 0;
  double before = 0;  ///< share of the squared held-out residual of the given model
  double after = 0;   ///< the same of the new one, as a share of the given model's
  double rows = 0;    ///< share of the rows
};

/// An effect with the part that it belongs to.
struct NamedEffect {
  std::string effect;  ///< "coulomb"
  std::string part;    ///< name of joint or link, "tip" or "base"
};

struct FoundPart {
  NamedEffect name;
  double held_out_gain = 0;  ///< share of the squared held-out residual, without it, that it removes
  int blocks_improved = 0;
  int blocks = 0;
  double p_value = 1;
  double gap_before_Nm = 0;  ///< held-out rms residual of the new model, refitted without it
  double gap_after_Nm = 0;
  std::vector<NamedEffect> equivalent{};
  std::vector<int> wins{};  ///< of gap::kNoiseDraws: its own, then those of each rival
  std::vector<fit::Estimate> parameters{};
  std::vector<double> given{};        ///< of each parameter, in the model as given
  std::string deciding_experiment{};  ///< empty without rivals
};

struct RejectedPart {
  NamedEffect name;
  std::string reason;
};

/// Of one joint, and of each recording.
struct JointGap {
  std::string joint;
  double noise_floor_Nm = 0;
  double before_Nm = 0;
  double after_Nm = 0;
  double dense_Nm = 0;  ///< with every parameter of the catalogue fitted at once
  bool judged = true;   ///< it moves
};
struct MotionGap {
  std::string recording;
  bool held_out = false;
  double before_Nm = 0;
  double after_Nm = 0;
};

struct RobotTrace {
  std::string recording;
  std::string joint;
  std::vector<double> time_s;
  std::vector<double> measured_Nm;
  std::vector<double> before_Nm;
  std::vector<double> after_Nm;
};

struct RobotResult {
  Verdict verdict = Verdict::kNoGap;
  std::string reason;           ///< for the verdict, a sentence
  control::ArmDescription arm;  ///< with the accepted corrections
  double noise_floor_Nm = 0;    ///< rms over all rows
  double band_Hz = 0;
  double torque_lag_s = 0;     ///< of the recording; no part of the model
  double gap_before_Nm = 0;    ///< held-out rms residual
  double gap_refitted_Nm = 0;  ///< with the friction of the given model refitted
  double gap_dense_Nm = 0;     ///< with every parameter fitted at once
  double gap_after_Nm = 0;
  std::vector<std::string> held_out;
  std::vector<JointGap> joints;
  std::vector<MotionGap> motions;
  std::vector<FoundPart> effects;
  std::vector<RejectedPart> rejected;
  std::vector<Share> shares;
  std::vector<RobotTrace> traces;
  std::vector<std::string> notes;
};

struct RobotOptions {
  double band_Hz = 10;
  std::vector<double> ripples_per_rev{};  ///< to try in a turn of each joint
  std::uint64_t seed = 1;
  std::function<void(std::string_view what, double done)> progress{};
};

/// Deterministic for a seed. Without `held_out` the last quarter of each recording is set aside.
/// @throws std::invalid_argument naming recording or joint if the data cannot answer the question.
RobotResult analyse(const control::ArmDescription& arm, std::vector<ArmRecording> data,
                    std::vector<ArmRecording> held_out, const RobotOptions& options);

}  // namespace identification::robot_gap
