#include "identification/gap/prediction.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "identification/gap/zero_phase.h"
#include "model/effects/effect_chain.h"
#include "model/friction/dahl_curve.h"

namespace identification::gap {
namespace {

/// At the ends of a recording the filters have only half of their input: this many periods of the band's edge
/// are ignored.
constexpr double kEdgePeriods = 1;
/// At this distance, in periods of the band's edge, a sample has a millionth of the weight of a near one.
constexpr double kReachPeriods = 3;
/// Share of the time that counts as none.
constexpr double kNever = 1e-6;

struct Friction {
  std::vector<double> torque_Nm;
  std::vector<double> deflection_rad;  // of the bristle; empty without one
};
/// Friction of a bristle between the levels of the two directions, or by the sign of the velocity without
/// one, and of the laws with memory, which act beside it as in sim::MovingParts.
Friction friction(const model::effects::EffectChain& chain, const model::effects::DriveModel& model,
                  const Signals& s, const std::vector<double>& load) {
  const double inertia = chain.arranged({.inertia_kg_m2 = model.inertia_kg_m2}).inertia_kg_m2;
  const auto* contact = model.find<model::effects::Presliding>();
  const model::effects::PreslidingParameters bristle =
      contact ? contact->parameters() : model::effects::PreslidingParameters();
  Friction result{.torque_Nm = std::vector<double>(s.size()), .deflection_rad = {}};
  if (contact != nullptr) result.deflection_rad.reserve(s.size());
  double spring_Nm = 0;
  std::vector<model::friction::State> laws(chain.law_count());
  for (std::size_t i = 0; i < s.size(); ++i) {
    double& torque_Nm = result.torque_Nm[i];
    const double v = s.velocity_rad_per_s[i];
    const model::effects::Slide slide = slide_at(s, i, load[i], inertia);
    const auto level_Nm = [&](double direction) {
      return std::max(chain.contact_level_Nm(towards(slide, direction)), 0.0);
    };
    double laws_Nm = chain.laws_Nm(laws, {v, 0}, s.period_s);
    if (!laws.empty())
      laws_Nm = chain.reduced_laws_Nm(laws_Nm, std::abs(v),
                                      chain.contact_level_Nm(towards(slide, std::copysign(1.0, laws_Nm))));
    if (contact == nullptr) {
      const double forward = 0.5 + 0.5 * s.direction[i];
      torque_Nm = laws_Nm;
      if (forward > kNever) torque_Nm += forward * level_Nm(+1);
      if (1 - forward > kNever) torque_Nm -= (1 - forward) * level_Nm(-1);
      continue;
    }
    const double forward = level_Nm(+1);
    const double backward = level_Nm(-1);
    const double moved = i > 0 ? s.position_rad[i] - s.position_rad[i - 1] : 0;
    const double before_Nm =
        std::exchange(spring_Nm, model::friction::dahl_force(spring_Nm, moved, bristle.stiffness_Nm_per_rad,
                                                             bristle.exponent, backward, forward));
    // As in sim::BoundedBristle: on the deflection's rate, or the part that a straight bristle passes.
    const double rate = (spring_Nm - before_Nm) / (bristle.stiffness_Nm_per_rad * s.period_s);
    torque_Nm = bristle.exponent > 0
                    ? spring_Nm + bristle.damping_Nm_s_per_rad * rate
                    : std::clamp(spring_Nm + bristle.damping_Nm_s_per_rad * v, -backward, forward);
    torque_Nm += laws_Nm;
    result.deflection_rad.push_back(spring_Nm / bristle.stiffness_Nm_per_rad);
  }
  return result;
}

template <class Torque>
std::vector<double> at_positions(const Signals& s, const Torque& torque) {
  std::vector<double> result(s.size());
  std::ranges::transform(s.position_rad, result.begin(), torque);
  return result;
}

}  // namespace

std::vector<double> delivered_beyond_command_Nm(const model::effects::DriveModel& model, const Signals& s) {
  model::effects::EffectChain chain(model.effects);
  std::vector<double> beyond;
  beyond.reserve(s.raw_command_Nm.size());
  for (const double command : s.raw_command_Nm)
    beyond.push_back(chain.deliver(command, s.raw_period_s) - command);
  if (beyond.empty()) return std::vector<double>(s.size());
  const std::vector<double> smooth = steep_zero_phase(at_samples(beyond), s.raw_period_s, s.filter_Hz);
  const auto step = static_cast<std::size_t>(std::llround(s.period_s / s.raw_period_s));
  std::vector<double> result;
  for (std::size_t i = 0; i < smooth.size(); i += step) result.push_back(smooth[i]);
  return result;
}

namespace {

/// The motor's motion instead of that of an encoder with an error.
Signals behind_encoder(const model::effects::EffectChain& chain, const Signals& measured) {
  Signals s = measured;
  for (std::size_t i = 0; i < s.size(); ++i) {
    const model::effects::EffectChain::Motion motion =
        chain.motion_behind({s.position_rad[i], s.velocity_rad_per_s[i], s.acceleration_rad_per_s2[i]});
    s.position_rad[i] = motion.position_rad;
    s.velocity_rad_per_s[i] = motion.velocity_rad_per_s;
    s.acceleration_rad_per_s2[i] = motion.acceleration_rad_per_s2;
  }
  return s;
}

LoadSide load_side_behind_encoder(const model::effects::DriveModel& model,
                                  const model::effects::EffectChain& chain, const Signals& s) {
  std::vector<double> drive = s.torque_Nm;
  if (s.torque_is_command) {
    const std::vector<double> beyond = delivered_beyond_command_Nm(model, s);
    for (std::size_t i = 0; i < s.size(); ++i) drive[i] += beyond[i];
  }
  for (std::size_t i = 0; i < s.size(); ++i) drive[i] *= chain.motor_gain(s.position_rad[i]);
  return load_side(chain.arranged({.inertia_kg_m2 = model.inertia_kg_m2}), chain, s,
                   {drive, at_positions(s, [&](double x) { return chain.motor_load_Nm(x); }),
                    at_positions(s, [&](double x) { return chain.load_Nm(x); })});
}

std::vector<double> torque_behind_encoder_Nm(const model::effects::DriveModel& model,
                                             const model::effects::EffectChain& chain, const Signals& s,
                                             const LoadSide* known) {
  const model::effects::Mechanics mechanics = chain.arranged({.inertia_kg_m2 = model.inertia_kg_m2});
  const std::vector<double> load = at_positions(s, [&](double x) { return chain.load_Nm(x); });
  std::vector<double> torque = friction(chain, model, s, load).torque_Nm;
  const bool two_masses = mechanics.two_masses();
  const double inertia = (two_masses ? 1 - mechanics.load_share : 1) * mechanics.inertia_kg_m2;
  const double rubs = two_masses ? 1 - mechanics.friction_share() : 1;
  const std::vector<double> behind =
      two_masses ? torque_on_motor_Nm(known != nullptr ? *known : load_side_behind_encoder(model, chain, s),
                                      mechanics, s, torque, load)
                 : load;
  for (std::size_t i = 0; i < s.size(); ++i)
    torque[i] = (inertia * s.acceleration_rad_per_s2[i] + rubs * torque[i] +
                 chain.motor_load_Nm(s.position_rad[i]) + behind[i]) /
                chain.motor_gain(s.position_rad[i]);
  if (s.torque_is_command) {
    const std::vector<double> beyond = delivered_beyond_command_Nm(model, s);
    for (std::size_t i = 0; i < s.size(); ++i) torque[i] -= beyond[i];
  }
  return torque;
}

}  // namespace

LoadSide load_side_of(const model::effects::DriveModel& model, const Signals& s) {
  const model::effects::EffectChain chain(model.effects);
  return chain.acts_on_encoder() ? load_side_behind_encoder(model, chain, behind_encoder(chain, s))
                                 : load_side_behind_encoder(model, chain, s);
}

std::vector<double> bristle_deflection_rad(const model::effects::DriveModel& model, const Signals& s) {
  const model::effects::EffectChain chain(model.effects);
  const auto of = [&](const Signals& motor) {
    return friction(chain, model, motor, at_positions(motor, [&](double x) { return chain.load_Nm(x); }))
        .deflection_rad;
  };
  return chain.acts_on_encoder() ? of(behind_encoder(chain, s)) : of(s);
}

std::vector<model::friction::State> law_states(const model::effects::DriveModel& model, const Signals& s,
                                               std::size_t sample) {
  const model::effects::EffectChain chain(model.effects);
  std::vector<model::friction::State> states(chain.law_count());
  if (states.empty()) return states;
  const Signals& motor = chain.acts_on_encoder() ? behind_encoder(chain, s) : s;
  for (std::size_t i = 0; i < sample; ++i)
    (void)chain.laws_Nm(states, {motor.velocity_rad_per_s[i], 0}, motor.period_s);
  return states;
}

std::vector<double> predicted_torque_Nm(const model::effects::DriveModel& model, const Signals& s,
                                        const LoadSide* known) {
  const model::effects::EffectChain chain(model.effects);
  return chain.acts_on_encoder() ? torque_behind_encoder_Nm(model, chain, behind_encoder(chain, s), known)
                                 : torque_behind_encoder_Nm(model, chain, s, known);
}

Rows::Rows(const std::vector<Signals>& signals) : signals_(&signals) {
  if (signals.empty()) return;
  const double band_Hz = signals.front().band_Hz;
  const double period_s = signals.front().period_s;
  const auto samples_in = [&](double periods) {
    return static_cast<std::size_t>(std::max(1LL, std::llround(periods / (band_Hz * period_s))));
  };
  length_ = samples_in(0.5);
  reach_ = samples_in(kReachPeriods);
  // A zero-phase filter applied to a box gives the weights of a filtered mean.
  std::vector<double> box(2 * reach_ + length_);
  std::fill_n(box.begin() + static_cast<std::ptrdiff_t>(reach_), length_, 1 / static_cast<double>(length_));
  const std::vector<double> weights = zero_phase(box, period_s, band_Hz);
  filter_ = Eigen::Map<const Eigen::VectorXd>(weights.data(), static_cast<Eigen::Index>(weights.size()));

  const auto edge = static_cast<std::size_t>(kEdgePeriods / (band_Hz * period_s));
  for (std::size_t r = 0; r < signals.size(); ++r) {
    for (std::size_t first = edge; first + length_ + edge <= signals[r].size(); first += length_) {
      double moving = 0;
      for (std::size_t i = first; i < first + length_; ++i) moving += signals[r].moving[i];
      if (moving * 2 >= static_cast<double>(length_)) at_.push_back({r, first});
    }
  }
  torque_Nm_ = column([](const Signals& s) { return s.torque_Nm; });
  torque_rate_Nm_per_s_ = column([](const Signals& s) { return s.torque_rate_Nm_per_s; });
  torque_bend_Nm_per_s2_ = column([](const Signals& s) { return s.torque_bend_Nm_per_s2; });
}

Eigen::VectorXd Rows::weighted(const std::function<std::vector<double>(const Signals&)>& samples,
                               const Eigen::VectorXd& weights, std::size_t reach) const {
  Eigen::VectorXd result(count());
  std::size_t recording = signals_->size();
  std::vector<double> values;
  for (Eigen::Index row = 0; row < count(); ++row) {
    const At& at = at_[static_cast<std::size_t>(row)];
    if (at.recording != recording)
      values = with_mirrored_ends(samples((*signals_)[recording = at.recording]), reach);
    result[row] = weights.dot(Eigen::Map<const Eigen::VectorXd>(&values[at.first], weights.size()));
  }
  return result;
}

Eigen::VectorXd Rows::column(const std::function<std::vector<double>(const Signals&)>& quantity) const {
  const auto masked = [&](const Signals& s) {
    std::vector<double> values = quantity(s);
    for (std::size_t i = 0; i < values.size(); ++i) values[i] *= s.moving[i];
    return values;
  };
  return weighted(masked, filter_, reach_);
}

Eigen::VectorXd Rows::means(const std::function<std::vector<double>(const Signals&)>& quantity) const {
  const auto length = static_cast<Eigen::Index>(length_);
  return weighted(quantity, Eigen::VectorXd::Constant(length, 1 / static_cast<double>(length_)), 0);
}

double Rows::length_s() const {
  return signals_->empty() ? 0 : static_cast<double>(length_) * signals_->front().period_s;
}

double Rows::time_s(Eigen::Index row) const {
  const At& at = at_[static_cast<std::size_t>(row)];
  return (*signals_)[at.recording].time_s[at.first];
}

}  // namespace identification::gap
