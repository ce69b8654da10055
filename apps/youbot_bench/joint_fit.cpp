#include "apps/youbot_bench/joint_fit.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "runtime/program/wording.h"

namespace youbot_bench {
namespace {

using runtime::number_text;

/// Minimum distance of a plan from the ends of the range.
constexpr double kPlanMargin_rad = 0.05;
/// Share of the torque limit; the rest is for friction, and for starting and stopping.
constexpr double kWeightShare = 0.75;
/// Share of the largest torque command, for a joint that must rest without torque: such a small weight moves
/// it no further than the experiment does, and spoils no result.
constexpr double kRestingShare = 0.1;

}  // namespace

JointFit::JointFit(const Plan& plan, std::span<const hal::JointInfo> joints, std::size_t joint)
    : plan_(plan),
      info_(joints[joint]),
      joint_(joint),
      torque_limit_Nm_(std::min(info_.torque_limit_Nm, info_.rated_torque_Nm)),
      weight_(joints, joint) {
  const identification::experiments::Demand& demand = plan.demand;
  const auto refuse = [&](const std::string& why) {
    throw std::invalid_argument("--joint " + info_.name + ": " + plan.experiment + " " + why);
  };
  if (demand.speed_rad_per_s > info_.speed_limit_rad_per_s)
    refuse("turns it at up to " + number_text(demand.speed_rad_per_s, "rad/s") + ", and its limit is " +
           number_text(info_.speed_limit_rad_per_s, "rad/s") + ": choose lower speeds");
  if (demand.torque_Nm > torque_limit_Nm_)
    refuse("pushes it with up to " + number_text(demand.torque_Nm, "N·m") + ", and its limit is " +
           number_text(torque_limit_Nm_, "N·m") + ": choose a lower torque");
  const double lower_rad = info_.range.lower_rad + kPlanMargin_rad;
  const double upper_rad = info_.range.upper_rad - kPlanMargin_rad;
  const std::string room = number_text(upper_rad - lower_rad, "rad");
  if (demand.by_torque && plan.max_travel_rad == 0)
    refuse("pushes it freely, and it has " + room + " to turn: say with --max-travel how far it may go");
  const double pushed_rad = demand.by_torque ? plan.max_travel_rad : 0.0;
  below_rad_ = std::max(-demand.lowest_rad, pushed_rad);
  above_rad_ = std::max(demand.highest_rad, pushed_rad);
  if (below_rad_ + above_rad_ > upper_rad - lower_rad)
    refuse("may turn it by " + number_text(below_rad_ + above_rad_, "rad") + ", and it has " + room + ": " +
           (demand.by_torque ? "lower --max-travel"
                             : "choose fewer, slower or shorter runs, or reversals, which come back"));
  if (plan.start_rad && !(*plan.start_rad >= lower_rad && *plan.start_rad <= upper_rad))
    refuse("cannot begin at --start " + number_text(*plan.start_rad, "rad") + ", outside " +
           number_text(lower_rad) + " to " + number_text(upper_rad, "rad"));
}

Misfit JointFit::check(const hal::RobotSample& sample) noexcept {
  const hal::JointSample& own = sample.joints[joint_];
  int unknown = weight_.first_not_homed(sample);
  if (!own.homed) unknown = static_cast<int>(joint_);
  if (unknown >= 0) return {.kind = Misfit::Kind::kNotHomed, .joint = unknown};

  const double begin_rad = start_rad(own);
  const double room_below_rad = begin_rad - info_.range.lower_rad;
  if (below_rad_ + kPlanMargin_rad > room_below_rad)
    return {.kind = Misfit::Kind::kRoomBelow,
            .need = below_rad_ + kPlanMargin_rad,
            .limit = std::max(0.0, room_below_rad)};
  const double room_above_rad = info_.range.upper_rad - begin_rad;
  if (above_rad_ + kPlanMargin_rad > room_above_rad)
    return {.kind = Misfit::Kind::kRoomAbove,
            .need = above_rad_ + kPlanMargin_rad,
            .limit = std::max(0.0, room_above_rad)};

  const double least_rad = begin_rad - below_rad_;
  const double most_rad = begin_rad + above_rad_;
  const double resting_Nm = kRestingShare * plan_.demand.torque_Nm;
  if (const double weight_Nm = weight_.heaviest_Nm(sample, least_rad, most_rad);
      plan_.demand.by_torque && weight_Nm > resting_Nm)
    return {.kind = Misfit::Kind::kFallsAlone, .need = weight_Nm, .limit = resting_Nm};
  // It may be moved to its start first.
  const double weight_Nm = weight_.heaviest_Nm(sample, std::min(least_rad, own.position_rad),
                                               std::max(most_rad, own.position_rad));
  if (weight_Nm > kWeightShare * torque_limit_Nm_)
    return {.kind = Misfit::Kind::kHeavy, .need = weight_Nm, .limit = kWeightShare * torque_limit_Nm_};
  return {};
}

std::string JointFit::describe(const Misfit& misfit, std::span<const hal::JointInfo> joints) const {
  const std::string before = "--joint " + info_.name + ": ";
  const std::string need_rad = number_text(misfit.need, "rad");
  const std::string limit_rad = number_text(misfit.limit, "rad");
  switch (misfit.kind) {
    case Misfit::Kind::kNone: break;
    case Misfit::Kind::kNotHomed:
      return before + joints[static_cast<std::size_t>(misfit.joint)].name +
             " does not know where it stands between its end stops: set home_arms = true in [ethercat], or, "
             "on a bench rig, range_rad in [can]";
    case Misfit::Kind::kRoomBelow:
      return before + plan_.experiment + " needs " + need_rad + " below where it begins, and there are " +
             limit_rad + ": begin higher up, with --start, or " +
             (plan_.demand.by_torque ? "lower --max-travel" : "turn it less");
    case Misfit::Kind::kRoomAbove:
      return before + plan_.experiment + " needs " + need_rad + " above where it begins, and there are " +
             limit_rad + ": begin lower down, with --start, or " +
             (plan_.demand.by_torque ? "lower --max-travel" : "turn it less");
    case Misfit::Kind::kHeavy:
      return before + "it bears up to " + number_text(misfit.need, "N·m") +
             " of the arm's weight on its way, and " + number_text(misfit.limit, "N·m") +
             " leave enough of its torque for the rest: fold the arm, or raise it straight";
    case Misfit::Kind::kFallsAlone:
      return before + plan_.experiment + " leaves it without torque, and up to " +
             number_text(misfit.need, "N·m") + " of the arm's weight would move it; only " +
             number_text(misfit.limit, "N·m") +
             " would not matter: raise the arm straight and lower --max-travel, or measure with velocities "
             "(reversals)";
  }
  return before + "it fits";
}

}  // namespace youbot_bench
