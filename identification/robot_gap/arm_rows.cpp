#include "identification/robot_gap/arm_rows.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <map>
#include <numeric>
#include <utility>

#include "identification/gap/parallel.h"
#include "identification/gap/zero_phase.h"
#include "identification/robot_gap/link_motion.h"

namespace identification::robot_gap {
namespace {

using control::ArmDescription;
using control::ArmDrive;
using Kind = ArmTerm::Kind;

/// Below this share of its top speed a joint is at rest.
constexpr double kRestShare = 0.02;
/// Below so many standard deviations of the noise of its speed, too.
constexpr double kAboveNoise = 3;
/// More than rounding leaves of a position that does not change.
constexpr double kStill_rad_per_s = 1e-6;
/// A row counts if the joint moves for more than this share of the time that it averages.
constexpr double kMovingShare = 0.5;
/// Of an angle [rad] or a compliance [rad/(N·m)].
constexpr double kStep = 1e-5;

/// Mean of the sign over a sample: between two reversals exact for a constant acceleration.
double mean_sign(double v, double a, double period_s) {
  const double half = 0.5 * period_s * std::abs(a);
  if (std::abs(v) >= half) return v > 0 ? 1.0 : (v < 0 ? -1.0 : 0.0);
  return v / half;
}

/// All that terms of drives are made of, joints × samples.
struct Samples {
  LinkMotion link;
  Eigen::MatrixXd sign;
  Eigen::MatrixXd reported_Nm;
};

double drive_torque(const ArmDescription& arm, const ArmMotion& motion, const Samples& s, Eigen::Index j,
                    Eigen::Index i) {
  const ArmDrive& drive = arm.drives[static_cast<std::size_t>(j)];
  const double q = s.link.q_rad(j, i);
  const double v = motion.velocity_rad_per_s(j, i);
  const double slower = v / drive.stribeck_speed_rad_per_s;
  double torque = drive.rotor_inertia_kg_m2 * motion.acceleration_rad_per_s2(j, i) +
                  drive.viscous_Nm_s_per_rad * v + drive.quadratic_drag_Nm_s2_per_rad2 * v * std::abs(v) +
                  drive.offset_Nm + drive.spring_Nm_per_rad * (q - drive.spring_rest_rad) +
                  drive.cable_2_Nm_per_rad2 * q * q + drive.cable_3_Nm_per_rad3 * q * q * q;
  torque += s.sign(j, i) * (drive.coulomb_Nm + drive.load_friction * std::abs(s.link.rigid_Nm(j, i)) +
                            drive.stribeck_Nm * std::exp(-slower * slower));
  if (j > 0) torque += drive.friction_of_previous_Nm * s.sign(j - 1, i);
  if (j + 1 < s.sign.rows()) torque += drive.friction_of_next_Nm * s.sign(j + 1, i);
  for (const ArmDrive::Ripple& ripple : drive.ripples)
    torque += ripple.sine_Nm * std::sin(ripple.periods_per_rev * q) +
              ripple.cosine_Nm * std::cos(ripple.periods_per_rev * q);
  return torque;
}

Eigen::MatrixXd reported(const ArmDescription& arm, const ArmMotion& motion, const Samples& s) {
  Eigen::MatrixXd result(s.link.q_rad.rows(), s.link.q_rad.cols());
  for (Eigen::Index j = 0; j < s.link.q_rad.rows(); ++j)
    for (Eigen::Index i = 0; i < s.link.q_rad.cols(); ++i)
      result(j, i) = (s.link.rigid_Nm(j, i) + drive_torque(arm, motion, s, j, i)) /
                     arm.drives[static_cast<std::size_t>(j)].torque_scale;
  return result;
}

Samples samples_of(const ArmDescription& arm, const ArmMotion& motion) {
  Samples s;
  s.link = link_motion(arm, motion);
  s.sign.resize(s.link.q_rad.rows(), s.link.q_rad.cols());
  for (Eigen::Index j = 0; j < s.link.q_rad.rows(); ++j)
    for (Eigen::Index i = 0; i < s.link.q_rad.cols(); ++i)
      s.sign(j, i) = mean_sign(motion.velocity_rad_per_s(j, i), motion.acceleration_rad_per_s2(j, i),
                               motion.is_scattered ? 0 : motion.period_s);
  s.reported_Nm = reported(arm, motion, s);
  return s;
}

bool is_rigid(Kind kind) { return kind <= Kind::kLinkInertia; }

/// Change of the link's inertial parameters per unit of a term.
InertialVector inertial_change(const ArmDescription& arm, const ArmTerm& term) {
  const control::LinkInertia& body = arm.arm.links[static_cast<std::size_t>(term.part)].inertia;
  const Eigen::Vector3d tip = arm.arm.X_LT.translation();
  const Eigen::Vector3d from_tip = arm.arm.X_LT.linear() * arm.p_TP_m;
  switch (term.kind) {
    case Kind::kPayloadMass: {  // the mass changes at constant first moment about the tip
      InertialVector result = unit_mass_at(tip);
      result.tail<6>() -= unit_mass_at(from_tip).tail<6>();
      return result;
    }
    case Kind::kPayloadMoment: {
      const Eigen::Vector3d along = arm.arm.X_LT.linear().col(term.index);
      control::LinkInertia point{1.0, tip + from_tip, Eigen::Matrix3d::Zero()};
      return by_centre(point) * along;
    }
    case Kind::kLinkMass: return unit_mass_at(body.p_LC_m);
    case Kind::kLinkDensity: return inertial_vector(body) / body.mass_kg;
    case Kind::kLinkCentre: return by_centre(body).col(term.index);
    default: return by_inertia().col(term.index);
  }
}

/// Derivative of one joint's torque by a term of its drive, in the samples.
double drive_column(const ArmDescription& arm, const ArmMotion& motion, const Samples& s, const ArmTerm& term,
                    Eigen::Index i) {
  const Eigen::Index j = term.part;
  const double q = s.link.q_rad(j, i);
  const double v = motion.velocity_rad_per_s(j, i);
  switch (term.kind) {
    case Kind::kRotorInertia: return motion.acceleration_rad_per_s2(j, i);
    case Kind::kCoulomb: return s.sign(j, i);
    case Kind::kViscous: return v;
    case Kind::kQuadraticDrag: return v * std::abs(v);
    case Kind::kOffset: return 1;
    case Kind::kLoadFriction: return s.sign(j, i) * std::abs(s.link.rigid_Nm(j, i));
    case Kind::kStribeck: return s.sign(j, i) * std::exp(-(v / term.setting) * (v / term.setting));
    case Kind::kSpring: return q - arm.drives[static_cast<std::size_t>(j)].spring_rest_rad;
    case Kind::kCable: return term.index == 2 ? q * q : q * q * q;
    case Kind::kRippleSine: return std::sin(term.setting * q);
    case Kind::kRippleCosine: return std::cos(term.setting * q);
    case Kind::kNeighbour: return s.sign(j + term.index, i);
    default: return 0;
  }
}

/// Places of a motion's rows in the comparison, by joint: index of each row, or −1.
std::vector<std::vector<std::vector<Eigen::Index>>> places_of(std::span<const ArmMotion> motions,
                                                              const RowPlan& plan) {
  std::vector<std::vector<std::vector<Eigen::Index>>> places;
  for (const ArmMotion& motion : motions)
    places.emplace_back(static_cast<std::size_t>(motion.position_rad.rows()),
                        std::vector<Eigen::Index>(motion.rows(), -1));
  for (std::size_t row = 0; row < plan.rows.size(); ++row) {
    const RowPlan::Row& one = plan.rows[row];
    places[one.motion][static_cast<std::size_t>(one.channel)][one.at] = static_cast<Eigen::Index>(row);
  }
  return places;
}

/// Writes one joint's signal of a motion into its rows of the comparison.
template <class Into>
void into_rows(const ArmMotion& motion, const std::vector<Eigen::Index>& place,
               std::span<const double> signal, Into&& result) {
  const std::vector<double> rows = motion.band(signal);
  for (std::size_t k = 0; k < rows.size(); ++k)
    if (place[k] >= 0) result[place[k]] = rows[k];
}

std::vector<double> row_of(const Eigen::MatrixXd& matrix, Eigen::Index row) {
  std::vector<double> result(static_cast<std::size_t>(matrix.cols()));
  for (Eigen::Index i = 0; i < matrix.cols(); ++i) result[static_cast<std::size_t>(i)] = matrix(row, i);
  return result;
}

/// The columns of some terms, for one motion.
class Columns {
 public:
  Columns(const ArmDescription& arm, const ArmMotion& motion, const Samples& samples,
          const std::vector<std::vector<Eigen::Index>>& place, Eigen::MatrixXd& result)
      : arm_(arm), motion_(motion), samples_(samples), place_(place), result_(result) {}

  /// All terms of a link.
  void rigid(Eigen::Index link, std::span<const std::size_t> columns, std::span<const ArmTerm> terms) {
    InertialChanges changes(10, static_cast<Eigen::Index>(columns.size()));
    for (std::size_t k = 0; k < columns.size(); ++k)
      changes.col(static_cast<Eigen::Index>(k)) = inertial_change(arm_, terms[columns[k]]);
    RigidArm body(arm_.arm);
    const Eigen::Index samples = samples_.link.q_rad.cols();
    std::vector<std::vector<double>> signals(static_cast<std::size_t>(link + 1) * columns.size(),
                                             std::vector<double>(static_cast<std::size_t>(samples)));
    Eigen::MatrixXd torque;
    for (Eigen::Index i = 0; i < samples; ++i) {
      const LinkMotion& link_at = samples_.link;
      body.move(link_at.q_rad.col(i), link_at.v_rad_per_s.col(i), link_at.a_rad_per_s2.col(i),
                arm_.gravity_B_m_per_s2);
      body.torques(link, changes, torque);
      for (Eigen::Index j = 0; j <= link; ++j)
        for (std::size_t k = 0; k < columns.size(); ++k)
          signals[static_cast<std::size_t>(j) * columns.size() + k][static_cast<std::size_t>(i)] =
              torque(j, static_cast<Eigen::Index>(k)) / scale(j);
    }
    for (Eigen::Index j = 0; j <= link; ++j)
      for (std::size_t k = 0; k < columns.size(); ++k)
        write(j, columns[k], signals[static_cast<std::size_t>(j) * columns.size() + k]);
  }

  /// Of a term that changes the motion or gravity: the difference that a step of it makes.
  void by_difference(std::size_t column, const ArmTerm& term) {
    ArmDescription less = arm_;
    ArmDescription more = arm_;
    change(less, term, -kStep);
    change(more, term, kStep);
    const Eigen::MatrixXd slope =
        (predicted_torque_Nm(more, motion_) - predicted_torque_Nm(less, motion_)) / (2 * kStep);
    for (Eigen::Index j = 0; j < slope.rows(); ++j) write(j, column, row_of(slope, j));
  }

  void of_drive(std::size_t column, const ArmTerm& term) {
    const Eigen::Index j = term.part;
    std::vector<double> signal(static_cast<std::size_t>(samples_.link.q_rad.cols()));
    for (std::size_t i = 0; i < signal.size(); ++i) {
      const auto at = static_cast<Eigen::Index>(i);
      signal[i] = term.kind == Kind::kTorqueScale
                      ? -samples_.reported_Nm(j, at) / scale(j)
                      : drive_column(arm_, motion_, samples_, term, at) / scale(j);
    }
    write(j, column, signal);
  }

  /// reported = true − lag·(rate of it)
  void lag(std::size_t column) {
    for (Eigen::Index j = 0; j < samples_.link.q_rad.rows(); ++j) {
      std::vector<double> rate = gap::derivative(row_of(motion_.torque_Nm, j), motion_.period_s);
      for (double& one : rate) one = -one;
      write(j, column, rate);
    }
  }

 private:
  double scale(Eigen::Index j) const { return arm_.drives[static_cast<std::size_t>(j)].torque_scale; }
  void write(Eigen::Index joint, std::size_t column, std::span<const double> signal) {
    into_rows(motion_, place_[static_cast<std::size_t>(joint)], signal,
              result_.col(static_cast<Eigen::Index>(column)));
  }

  const ArmDescription& arm_;
  const ArmMotion& motion_;
  const Samples& samples_;
  const std::vector<std::vector<Eigen::Index>>& place_;
  Eigen::MatrixXd& result_;
};

/// Terms that one pass over a motion computes.
struct Pass {
  bool rigid = false;
  Eigen::Index link = 0;
  std::vector<std::size_t> columns;
};
std::vector<Pass> passes_of(std::span<const ArmTerm> terms) {
  std::vector<Pass> passes;
  std::map<int, std::size_t> of_link;
  for (std::size_t k = 0; k < terms.size(); ++k) {
    if (!is_rigid(terms[k].kind)) {
      passes.push_back({false, 0, {k}});
      continue;
    }
    const auto [known, is_new] = of_link.emplace(terms[k].part, passes.size());
    if (is_new) passes.push_back({true, terms[k].part, {}});
    passes[known->second].columns.push_back(k);
  }
  return passes;
}

}  // namespace

Eigen::MatrixXd predicted_torque_Nm(const ArmDescription& arm, const ArmMotion& motion) {
  return samples_of(arm, motion).reported_Nm;
}

std::vector<double> top_speeds_rad_per_s(std::span<const ArmMotion> motions) {
  std::vector<double> result;
  for (Eigen::Index j = 0; j < motions.front().position_rad.rows(); ++j) {
    std::vector<double> speeds;
    for (const ArmMotion& motion : motions)
      for (Eigen::Index i = 0; i < motion.velocity_rad_per_s.cols(); ++i)
        speeds.push_back(std::abs(motion.velocity_rad_per_s(j, i)));
    const auto high = speeds.begin() + static_cast<std::ptrdiff_t>(0.95 * static_cast<double>(speeds.size()));
    std::ranges::nth_element(speeds, high);
    result.push_back(*high);
  }
  return result;
}

std::vector<double> rest_speeds_rad_per_s(std::span<const ArmMotion> motions,
                                          std::span<const ArmRecording> recordings, double band_Hz) {
  std::vector<double> rest = top_speeds_rad_per_s(motions);
  for (double& speed : rest) speed = std::max(kRestShare * speed, kStill_rad_per_s);
  for (const ArmRecording& recording : recordings) {
    const Eigen::VectorXd noise = noise_of(recording, band_Hz).position_rad;
    const double gain_per_s = velocity_noise_gain_per_s(recording, band_Hz);
    for (std::size_t j = 0; j < rest.size(); ++j)
      rest[j] = std::max(rest[j], kAboveNoise * gain_per_s * noise[static_cast<Eigen::Index>(j)]);
  }
  return rest;
}

RowPlan plan_rows(std::span<const ArmMotion> motions, std::span<const double> rest_speed_rad_per_s,
                  double block_s) {
  RowPlan plan;
  for (std::size_t m = 0; m < motions.size(); ++m) {
    const ArmMotion& motion = motions[m];
    const auto joints = static_cast<std::size_t>(motion.position_rad.rows());
    const std::size_t margin = static_cast<std::size_t>(std::ceil(1 / (motion.band_Hz * motion.row_s())));
    const std::size_t first = margin;
    const std::size_t last = motion.rows() - std::min(motion.rows(), margin);
    if (first >= last) continue;
    // Share of the time around each row in which the joint moves.
    const auto half = static_cast<Eigen::Index>(std::ceil(0.5 / (motion.band_Hz * motion.period_s)));
    std::vector<std::vector<char>> moves(joints, std::vector<char>(motion.rows()));
    for (std::size_t j = 0; j < joints; ++j)
      for (std::size_t k = first; k < last; ++k) {
        const auto centre = static_cast<Eigen::Index>(k * motion.step);
        const Eigen::Index from = std::max<Eigen::Index>(0, centre - half);
        const Eigen::Index to = std::min<Eigen::Index>(motion.velocity_rad_per_s.cols(), centre + half + 1);
        const auto speeds =
            motion.velocity_rad_per_s.row(static_cast<Eigen::Index>(j)).segment(from, to - from);
        const double moving = (speeds.array().abs() > rest_speed_rad_per_s[j]).cast<double>().mean();
        moves[j][k] = moving > kMovingShare ? 1 : 0;
      }
    const double length_s = static_cast<double>(last - first) * motion.row_s();
    const auto blocks = static_cast<std::size_t>(std::max(1.0, std::round(length_s / block_s)));
    for (std::size_t b = 0; b < blocks; ++b) {
      const std::size_t from = first + b * (last - first) / blocks;
      const std::size_t to = first + (b + 1) * (last - first) / blocks;
      const int number = plan.blocks();
      const std::size_t before = plan.rows.size();
      for (std::size_t j = 0; j < joints; ++j)
        for (std::size_t k = from; k < to; ++k)
          if (moves[j][k] != 0) {
            plan.rows.push_back({m, static_cast<Eigen::Index>(j), k});
            plan.block.push_back(number);
          }
      if (plan.rows.size() == before) continue;
      plan.block_motion.push_back(m);
    }
  }
  return plan;
}

ComparedRows compare(const ArmDescription& arm, std::span<const ArmMotion> motions, const RowPlan& plan,
                     std::span<const ArmTerm> terms) {
  const auto rows = static_cast<Eigen::Index>(plan.rows.size());
  ComparedRows result{Eigen::VectorXd::Zero(rows), Eigen::VectorXd::Zero(rows),
                      Eigen::MatrixXd::Zero(rows, static_cast<Eigen::Index>(terms.size()))};
  const auto places = places_of(motions, plan);
  const std::vector<Pass> passes = passes_of(terms);
  for (std::size_t m = 0; m < motions.size(); ++m) {
    const ArmMotion& motion = motions[m];
    const Samples samples = samples_of(arm, motion);
    for (Eigen::Index j = 0; j < samples.link.q_rad.rows(); ++j) {
      const auto& place = places[m][static_cast<std::size_t>(j)];
      into_rows(motion, place, row_of(motion.torque_Nm, j), result.measured);
      into_rows(motion, place, row_of(samples.reported_Nm, j), result.predicted);
    }
    gap::in_parallel(passes.size(), [&](std::size_t p) {
      Columns columns(arm, motion, samples, places[m], result.columns);
      const Pass& pass = passes[p];
      if (pass.rigid) {
        columns.rigid(pass.link, pass.columns, terms);
        return;
      }
      const std::size_t column = pass.columns.front();
      const ArmTerm& term = terms[column];
      if (term.kind == Kind::kLag)
        columns.lag(column);
      else if (term.kind == Kind::kTilt || term.kind == Kind::kEncoderZero || term.kind == Kind::kCompliance)
        columns.by_difference(column, term);
      else
        columns.of_drive(column, term);
    });
  }
  return result;
}

}  // namespace identification::robot_gap
