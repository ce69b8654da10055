/// @file
/// Finds where the model of a robot and recordings of it disagree, which part is wrong and by which effect.
#pragma once
#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "identification/fit/statistics.h"
#include "identification/gap/gap.h"
#include "identification/robot_gap/subject.h"

namespace identification::robot_gap {

using gap::Verdict;

/// Part of the disagreement in a range of one quantity.
struct Share {
  std::string coordinate{};  ///< "channel", "time" or one of the subject's
  std::string unit{};        ///< of the range
  std::string channel{};     ///< of which; empty: all
  std::string recording{};   ///< of time
  double from = 0;
  double to = 0;
  double before = 0;  ///< share of the squared held-out residual of the given model
  double after = 0;   ///< the same of the new one, as a share of the given model's
  double rows = 0;    ///< share of the rows
};

/// An effect with the part that it belongs to.
struct NamedEffect {
  std::string effect;  ///< "coulomb"
  std::string part;    ///< name of joint, link, wheel or floor; "tip", "base", "steering" or "tracking"
};

struct FoundPart {
  NamedEffect name;
  double held_out_gain = 0;  ///< share of the squared held-out residual, without it, that it removes
  int blocks_improved = 0;
  int blocks = 0;
  double p_value = 1;
  std::vector<double> gap_before{};  ///< by unit: held-out rms residual of the new model, refitted without it
  std::vector<double> gap_after{};
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

/// Rms residuals on held-out recordings, in one unit.
struct Gap {
  double noise_floor = 0;  ///< what the sensors' noise leaves
  double before = 0;
  double refitted = 0;  ///< with the friction of the given model refitted
  double dense = 0;     ///< with every parameter of the catalogue fitted at once
  double after = 0;
};
struct UnitGap {
  std::string unit;  ///< over all channels of this unit
  Gap gap{};
};
struct ChannelGap {
  Channel channel;
  Gap gap{};
  bool judged = true;  ///< it moves
};
/// Of each recording, in noise floors.
struct MotionGap {
  std::string recording;
  bool held_out = false;
  double before = 0;
  double after = 0;
};

struct RobotTrace {
  std::string recording;
  std::string channel;
  std::string unit;
  std::vector<double> time_s;
  std::vector<double> measured;
  std::vector<double> before;
  std::vector<double> after;
};

struct RobotResult {
  Verdict verdict = Verdict::kNoGap;
  std::string reason{};       ///< for the verdict, a sentence
  Eigen::VectorXd changes{};  ///< of every term of the catalogue: the accepted corrections
  double delay_s = 0;         ///< of the recording; no part of the model
  std::vector<UnitGap> gaps{};
  std::vector<ChannelGap> channels{};
  std::vector<MotionGap> motions{};
  std::vector<std::string> held_out{};
  std::vector<FoundPart> effects{};
  std::vector<RejectedPart> rejected{};
  std::vector<Share> shares{};
  std::vector<RobotTrace> traces{};
  std::vector<std::string> notes{};
};

struct RobotOptions {
  std::uint64_t seed = 1;
  std::function<void(std::string_view what, double done)> progress{};
};

/// Deterministic for a seed.
RobotResult analyse(const Subject& subject, const RobotOptions& options);

}  // namespace identification::robot_gap
