#include "identification/robot_gap/base_effort_signs.h"

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <stdexcept>

#include "identification/robot_gap/base_effort.h"

namespace identification::robot_gap {
namespace {

using control::BaseDescription;

/// Share of what friction and inertia explain by which those of the wrong sign outweigh the others.
constexpr double kNegated = 0.3;
/// Friction and inertia must explain this share of a torque to say anything about its sign.
constexpr double kExplainedShare = 0.5;
/// Of the windows in one direction, with the same sign of the torque as in the other.
constexpr double kOneSided = 0.95;
/// Windows in the rarer direction.
constexpr double kBothDirections = 0.1;
/// A magnitude explains a torque if it leaves this share of the squares that a signed torque does.
constexpr double kMagnitudeLeaves = 0.5;
/// Of the squares of a torque: less is rounding.
constexpr double kExact = 1e-12;

enum TorqueColumn : Eigen::Index {
  kOfNothing,
  kOfDirection,
  kOfSpeed,
  kOfInertia,
  kOfSlopeX,
  kOfSlopeY,
  kOfTurning,
  kOfSideways,
  kTorqueColumns
};

/// One wheel, window after window.
struct WheelTorque {
  Eigen::VectorXd torque_Nm;
  Eigen::MatrixXd columns;
  Eigen::VectorXd given_Nm;  // as the given model says

  auto direction() const { return columns.col(kOfDirection); }
};

/// The base with its inertia alone. It keeps its torque_scale: a given slope counts in reported torque.
BaseDescription inertia_of(BaseDescription base) {
  for (BaseDescription::Wheel& wheel : base.wheels)
    wheel.offset_Nm = wheel.coulomb_Nm = wheel.viscous_Nm_s_per_rad = 0;
  base.body.sideways_resistance_N = base.body.turning_resistance_Nm = 0;
  base.body.slope.setZero();
  return base;
}

std::vector<WheelTorque> wheel_torques(const BaseDescription& given,
                                       std::span<const std::vector<EffortWindow>> windows) {
  const BaseDescription level = inertia_of(given);
  BaseDescription along_x = level;
  along_x.body.slope.x() = 1;
  BaseDescription along_y = level;
  along_y.body.slope.y() = 1;
  BaseDescription turning = level;
  turning.body.turning_resistance_Nm = 1;
  BaseDescription sideways = level;
  sideways.body.sideways_resistance_N = 1;
  const BaseForces as_given(given, given, -1);
  const BaseForces inertia(level, level, -1);
  const BaseForces slope_x(along_x, along_x, -1);
  const BaseForces slope_y(along_y, along_y, -1);
  const BaseForces resists_turning(turning, turning, -1);
  const BaseForces resists_sideways(sideways, sideways, -1);
  Eigen::Index count = 0;
  for (const std::vector<EffortWindow>& own : windows) count += static_cast<Eigen::Index>(own.size());
  std::vector<WheelTorque> wheels(
      given.wheels.size(),
      {Eigen::VectorXd(count), Eigen::MatrixXd::Ones(count, kTorqueColumns), Eigen::VectorXd(count)});
  Eigen::Index row = 0;
  for (const std::vector<EffortWindow>& own : windows)
    for (const EffortWindow& window : own) {
      const Eigen::VectorXd by_inertia = inertia.reported_torques(window);
      const Eigen::VectorXd by_x = slope_x.reported_torques(window) - by_inertia;
      const Eigen::VectorXd by_y = slope_y.reported_torques(window) - by_inertia;
      const Eigen::VectorXd by_turning = resists_turning.reported_torques(window) - by_inertia;
      const Eigen::VectorXd by_sideways = resists_sideways.reported_torques(window) - by_inertia;
      const Eigen::VectorXd by_given = as_given.reported_torques(window);
      for (std::size_t w = 0; w < wheels.size(); ++w) {
        const auto at = static_cast<Eigen::Index>(w);
        wheels[w].torque_Nm[row] = window.torque_Nm[at];
        wheels[w].given_Nm[row] = by_given[at];
        wheels[w].columns(row, kOfDirection) = window.sign[at];
        wheels[w].columns(row, kOfSpeed) = window.speed_rad_per_s[at];
        wheels[w].columns(row, kOfInertia) = by_inertia[at];
        wheels[w].columns(row, kOfSlopeX) = by_x[at];
        wheels[w].columns(row, kOfSlopeY) = by_y[at];
        wheels[w].columns(row, kOfTurning) = by_turning[at];
        wheels[w].columns(row, kOfSideways) = by_sideways[at];
      }
      ++row;
    }
  return wheels;
}

bool has_both_directions(const WheelTorque& wheel) {
  const double ahead = (wheel.direction().array() > 0).cast<double>().mean();
  return std::min(ahead, 1 - ahead) >= kBothDirections;
}

/// Whether friction drives and mass brakes. On one arc the resistance to turning looks like friction of the
/// outer wheel and like its opposite of the inner one: only what no resistance explains says anything. In one
/// direction only, friction cannot be distinguished from a slope or an offset.
bool is_negated(const WheelTorque& wheel) {
  const Eigen::VectorXd by = wheel.columns.completeOrthogonalDecomposition().solve(wheel.torque_Nm);
  const Eigen::VectorXd friction =
      by[kOfDirection] * wheel.direction() + by[kOfSpeed] * wheel.columns.col(kOfSpeed);
  const auto resistances = wheel.columns.middleCols<2>(kOfTurning);
  const Eigen::VectorXd distinct =
      friction - resistances * resistances.completeOrthogonalDecomposition().solve(friction);
  const double of_inertia = (by[kOfInertia] * wheel.columns.col(kOfInertia)).squaredNorm();
  const double all = friction.squaredNorm() + of_inertia;
  const double left = (wheel.torque_Nm - wheel.columns * by).squaredNorm();
  if (!(all > 0) || left > kExplainedShare * (all + left)) return false;
  const double for_friction =
      has_both_directions(wheel) ? std::copysign(distinct.squaredNorm(), distinct.dot(wheel.direction())) : 0;
  const double for_inertia = std::copysign(of_inertia, by[kOfInertia]);
  return for_friction + for_inertia < -kNegated * all;
}

/// 1 or -1 if almost all windows have that sign of the torque, both forwards and backwards; otherwise 0.
double one_sign(const WheelTorque& wheel, const Eigen::VectorXd& torque_Nm) {
  if (!has_both_directions(wheel)) return 0;
  const Eigen::ArrayXd forwards = (wheel.direction().array() > 0).cast<double>();
  const Eigen::ArrayXd positive = (torque_Nm.array() > 0).cast<double>();
  const auto count = static_cast<double>(forwards.size());
  const double ahead = forwards.sum();
  const double back = count - ahead;
  const double positive_ahead = (forwards * positive).sum();
  const double positive_back = positive.sum() - positive_ahead;
  if (positive_ahead > kOneSided * ahead && positive_back > kOneSided * back) return 1;
  return positive_ahead < (1 - kOneSided) * ahead && positive_back < (1 - kOneSided) * back ? -1 : 0;
}

/// Whether a torque of one sign is explained much better with the sign of the motion, or of what the given
/// model says.
bool is_magnitude(const WheelTorque& wheel) {
  const auto left = [&](const Eigen::VectorXd& torque_Nm) {
    const Eigen::VectorXd by = wheel.columns.completeOrthogonalDecomposition().solve(torque_Nm);
    return (torque_Nm - wheel.columns * by).squaredNorm();
  };
  // A constant torque is either.
  const double as_it_is = left(wheel.torque_Nm);
  if (as_it_is < kExact * wheel.torque_Nm.squaredNorm()) return false;
  const Eigen::VectorXd magnitude = wheel.torque_Nm.cwiseAbs();
  const double with_signs = std::min(left(magnitude.cwiseProduct(wheel.direction())),
                                     left(magnitude.cwiseProduct(wheel.given_Nm.cwiseSign())));
  return with_signs < kMagnitudeLeaves * as_it_is;
}

}  // namespace

std::vector<std::string> check_torque_signs(const BaseDescription& given,
                                            std::span<const std::vector<EffortWindow>> windows) {
  std::vector<std::string> notes;
  const std::vector<WheelTorque> wheels = wheel_torques(given, windows);
  for (std::size_t w = 0; w < wheels.size(); ++w) {
    const WheelTorque& wheel = wheels[w];
    const std::string of = "the torque of wheel " + given.wheels[w].name;
    if (wheel.torque_Nm.isZero(0))
      throw std::invalid_argument(of + " is zero wherever the wheel turns: check its torque_column");
    const auto one_sided = [&](double sign) {
      return of + (sign > 0 ? " is positive" : " is negative") + " whichever way the wheel turns";
    };
    const double sign = one_sign(wheel, wheel.torque_Nm);
    if (sign != 0 && is_magnitude(wheel))
      throw std::invalid_argument(
          one_sided(sign) +
          ": it is a magnitude, and forces need its direction; leave torque_column out "
          "of all wheels, or use load_column");
    if (is_negated(wheel))
      throw std::invalid_argument(of +
                                  " has the wrong sign: by it friction drives the wheel, or mass brakes it; "
                                  "change the sign of its torque_factor");
    const double offset_Nm = given.wheels[w].offset_Nm / given.wheels[w].torque_scale;
    const Eigen::VectorXd level_Nm = wheel.torque_Nm - offset_Nm * wheel.columns.col(kOfNothing) -
                                     wheel.columns.middleCols<2>(kOfSlopeX) * given.body.slope -
                                     given.body.turning_resistance_Nm * wheel.columns.col(kOfTurning) -
                                     given.body.sideways_resistance_N * wheel.columns.col(kOfSideways);
    if (const double level_sign = one_sign(wheel, level_Nm); level_sign != 0)
      notes.push_back(one_sided(level_sign) + ", as on a slope; check torque_column if the floor is level");
    else if (level_Nm.dot(wheel.direction()) < -kNegated * level_Nm.lpNorm<1>())
      notes.push_back(
          of +
          " brakes the wheel most of the time, as downhill or inside a turn; check torque_column and "
          "torque_factor if the floor is level");
  }
  return notes;
}

}  // namespace identification::robot_gap
