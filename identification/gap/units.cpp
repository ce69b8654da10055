#include "identification/gap/units.h"

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>

#include "identification/fit/statistics.h"
#include "identification/gap/implied_drive.h"
#include "identification/gap/quantum.h"
#include "identification/gap/wording.h"

namespace identification::gap {
namespace {

constexpr double kDegrees = 180 / std::numbers::pi;
constexpr double kTurns = 1 / (2 * std::numbers::pi);
constexpr double kRpm = 30 / std::numbers::pi;
constexpr double kThousand = 1e3;
/// Tolerance of a stated rate relative to the times.
constexpr double kRateTolerance = 0.05;
/// Tolerance for agreement of position and velocity, and for a unit's factor.
constexpr double kAgree = 0.1;
constexpr double kUnitTolerance = 0.03;
/// Minimum correlation of two columns that show the same motion.
constexpr double kSameMotion = 0.9;
/// A gear ratio, or a wrong torque constant, changes inertia and friction equally and by more than this.
constexpr double kMinGear = 2.5;
/// An implied inertia matches a unit within this factor: a base model's own is hardly more accurate.
constexpr double kModelTolerance = 1.25;
/// Friction is less accurate.
constexpr double kFrictionTolerance = 2;

bool is_about(double value, double expected, double tolerance) {
  return std::abs(value / expected - 1) < tolerance;
}
bool is_within_factor(double value, double expected, double factor) {
  const double ratio = value / expected;
  return ratio > 1 / factor && ratio < factor;  // negative: never
}

void check_rate(const Source& source, std::vector<Diagnosis>& diagnoses) {
  const auto time_s = source.recording.column("time_s");
  const double stated_Hz = source.recording.sample_rate_Hz;
  if (stated_Hz <= 0) return;
  std::vector<double> steps;
  for (std::size_t i = 1; i < time_s.size(); ++i) steps.push_back(time_s[i] - time_s[i - 1]);
  const double rate_Hz = 1 / fit::median(steps);
  if (is_about(stated_Hz, rate_Hz, kRateTolerance)) return;
  if (is_about(stated_Hz, kThousand * rate_Hz, kRateTolerance))
    throw std::invalid_argument(path_of(source) + ": sample_rate_Hz is " + short_number(stated_Hz) +
                                ", but the rows are " + short_number(1 / rate_Hz) +
                                " s apart: time_s seems to be in milliseconds; divide it by 1000");
  diagnoses.push_back({source.name, "time_s",
                       "sample_rate_Hz is " + short_number(stated_Hz) + ", but the times say " +
                           short_number(rate_Hz) + " Hz",
                       "the times count"});
}

std::string whole_number(double value) { return std::to_string(std::llround(value)); }

/// Steps that are smaller than the model's, or twice as large and more, are of another encoder.
void check_ticks(const Source& source, const model::effects::DriveModel& base,
                 std::vector<Diagnosis>& diagnoses) {
  if (!base.encoder_ticks_per_rev || !source.recording.has("position_rad")) return;
  const std::optional<double> quantum = quantum_of(source.recording.column("position_rad"));
  if (!quantum) return;
  const double ticks = 2 * std::numbers::pi / *quantum;
  const double ratio = ticks / *base.encoder_ticks_per_rev;
  if (is_about(ratio, 1, kAgree)) return;
  diagnoses.push_back({source.name, "position_rad",
                       "moves in steps of " + short_number(*quantum) + " rad, " + whole_number(ticks) +
                           " to a turn, but encoder_ticks_per_rev of the model's [sensor] is " +
                           whole_number(*base.encoder_ticks_per_rev) + ", " + short_number(1 / ratio) +
                           " times as many",
                       "the coarser one is used; correct the model, or the unit of position_rad"});
}

/// Cause of a position that changes `factor` times as fast as the velocity column.
std::string cause_of(double factor) {
  struct Cause {
    double factor;
    std::string_view text;
  };
  static constexpr std::array kCauses{
      Cause{kDegrees, "position_rad seems to be in degrees; multiply it by pi/180"},
      Cause{kTurns, "position_rad seems to be in turns; multiply it by 2*pi"},
      Cause{1 / kDegrees, "velocity_rad_per_s seems to be in degrees per second; multiply it by pi/180"},
      Cause{1 / kRpm, "velocity_rad_per_s seems to be in revolutions per minute; multiply it by pi/30"},
      Cause{1 / kTurns, "velocity_rad_per_s seems to be in turns per second; multiply it by 2*pi"},
      Cause{1 / kThousand, "time_s seems to be in milliseconds; divide it by 1000"},
      Cause{-1, "one of them has the wrong sign; turn it round"},
  };
  for (const Cause& cause : kCauses)
    if (is_about(factor, cause.factor, kUnitTolerance)) return std::string(cause.text);
  return {};
}

void check_velocity(const Source& source, const SmoothMotion& motion, std::vector<Diagnosis>& diagnoses) {
  if (motion.position_rad.empty() || !source.recording.has("velocity_rad_per_s")) return;
  const std::vector<double> reported = smooth(motion, source.recording.column("velocity_rad_per_s"));
  const auto derived = Eigen::Map<const Eigen::VectorXd>(motion.velocity_rad_per_s.data(),
                                                         static_cast<Eigen::Index>(reported.size()));
  const auto column =
      Eigen::Map<const Eigen::VectorXd>(reported.data(), static_cast<Eigen::Index>(reported.size()));
  const double product = derived.dot(column);
  if (!(std::abs(product) > kSameMotion * derived.norm() * column.norm())) return;
  const double factor = product / column.squaredNorm();
  if (is_about(factor, 1, kAgree)) return;
  const std::string found = "changes " + short_number(factor) + " times as fast as velocity_rad_per_s says";
  if (const std::string cause = cause_of(factor); !cause.empty())
    throw std::invalid_argument(path_of(source) + ": position_rad " + found + ": " + cause);
  diagnoses.push_back({source.name, "position_rad",
                       found + ": one of them may be on the other side of the gear", "the position counts"});
}

void check_torque(const Source& source, const SmoothMotion& motion, const model::effects::DriveModel& base) {
  const std::optional<ImpliedDrive> implied = implied_by(source, motion);
  if (!implied) return;
  const std::string torque =
      source.recording.has("torque_measured_Nm") ? "torque_measured_Nm" : "torque_command_Nm";
  const bool inertia_is_sure = implied->inertia_is_sure();
  const bool friction_is_sure = implied->friction_is_sure();
  // A joint with a spring follows its torque as if its inertia were negative, and gains energy.
  const bool takes_energy = implied->friction_W > 0;
  if (!takes_energy && inertia_is_sure && friction_is_sure && implied->inertia_kg_m2 < 0 &&
      implied->coulomb_Nm < 0)
    throw std::invalid_argument(
        path_of(source) + ": " + torque +
        " has the wrong sign against the motion: it implies an inertia of " +
        short_number(implied->inertia_kg_m2) + " kg m² and a friction of " +
        short_number(implied->coulomb_Nm) +
        " N·m that drives the joint; turn the sign of the torque or of the motion round");
  const auto* coulomb = base.find<model::effects::Coulomb>();
  if (!inertia_is_sure || !friction_is_sure || coulomb == nullptr || implied->inertia_kg_m2 < 0 ||
      coulomb->parameters().torque_Nm <= 0 || base.inertia_kg_m2 <= 0)
    return;
  const double inertia = implied->inertia_kg_m2 / base.inertia_kg_m2;
  const double friction = implied->coulomb_Nm / coulomb->parameters().torque_Nm;
  const std::string implies = path_of(source) + ": torque and motion imply an inertia of " +
                              short_number(implied->inertia_kg_m2) + " kg m² and a Coulomb friction of " +
                              short_number(implied->coulomb_Nm) + " N·m, ";
  const std::string implies_factors =
      implies + short_number(inertia) + " and " + short_number(friction) + " times those of the model: ";
  const std::string otherwise = ". If the units are right, put these numbers into the model";
  const auto* viscous = base.find<model::effects::Viscous>();
  const bool has_viscous = viscous != nullptr && viscous->parameters().coefficient_Nm_s_per_rad > 0;
  const double drag =
      has_viscous ? implied->viscous_Nm_s_per_rad / viscous->parameters().coefficient_Nm_s_per_rad : 0;
  struct Unit {
    double inertia;
    double friction;
    std::string text;
    bool is_usual = false;  ///< models are often wrong by that factor: viscous friction must confirm it
  };
  const bool has_position = source.recording.has("position_rad");
  const std::array units{
      Unit{kThousand, kThousand, torque + " seems to be in mN·m; divide it by 1000"},
      Unit{1 / kDegrees, 1, "the motion seems to be in degrees; multiply it by pi/180"},
      Unit{kThousand * kThousand, 1, "time_s seems to be in milliseconds; divide it by 1000"},
      has_position
          ? Unit{1 / kTurns, 1, "position_rad seems to be in turns; multiply it by 2*pi", true}
          : Unit{1 / kRpm, 1,
                 "velocity_rad_per_s seems to be in revolutions per minute; multiply it by pi/30", true},
  };
  for (const Unit& unit : units)
    if (is_within_factor(inertia, unit.inertia, kModelTolerance) &&
        is_within_factor(friction, unit.friction, kFrictionTolerance) &&
        (!unit.is_usual || (has_viscous && is_within_factor(drag, unit.inertia, kFrictionTolerance))))
      throw std::invalid_argument(implies_factors + unit.text + otherwise);
  // Through a gear ratio of n, the torque is divided by n and the motion multiplied by n: the inertia is
  // divided by n².
  if (has_viscous && friction < 1 / kMinGear && is_within_factor(inertia, drag, kFrictionTolerance) &&
      is_within_factor(inertia, friction * friction, kFrictionTolerance))
    throw std::invalid_argument(implies_factors +
                                "torque and motion seem to be on the motor's side of a gear of about " +
                                short_number(1 / friction) +
                                "; multiply the torque by its ratio and divide the motion by it" + otherwise);
  if (is_within_factor(inertia, friction, kModelTolerance) && !is_within_factor(inertia, 1, kMinGear))
    throw std::invalid_argument(implies + "both about " + short_number(inertia) +
                                " times those of the model: " + torque +
                                " seems to be on the motor's side of the gear, or its torque constant is "
                                "wrong; scale it to the joint's "
                                "side. If it is right, put these numbers into the model");
}

}  // namespace

void check_units(const Source& source, const model::effects::DriveModel& base,
                 std::vector<Diagnosis>& diagnoses) {
  check_rate(source, diagnoses);
  check_ticks(source, base, diagnoses);
  const SmoothMotion motion = smooth_motion_of(source);
  check_velocity(source, motion, diagnoses);
  check_torque(source, motion, base);
}

}  // namespace identification::gap
