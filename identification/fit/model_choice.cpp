#include "identification/fit/model_choice.h"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <random>
#include <set>
#include <stdexcept>
#include <utility>

#include "identification/chance.h"
#include "model/effects/basis.h"
#include "model/effects/dissipation.h"

namespace identification::fit {
namespace {

using model::effects::AnyEffect;
using model::effects::ParameterDescription;

constexpr std::array kTerms{terms::kCoulomb,          terms::kViscous,   terms::kTorqueOffset,
                            terms::kViscousAsymmetry, terms::kQuadratic, terms::kStribeck,
                            terms::kStribeckExponent};

struct InTheirOrder {
  static auto place(const EffectParameter& term) { return std::ranges::find(kTerms, term); }
  bool operator()(const EffectParameter& a, const EffectParameter& b) const { return place(a) < place(b); }
};
using Terms = std::set<EffectParameter, InTheirOrder>;

/// One row per speed, all values divided by their standard deviation.
struct Data {
  Eigen::VectorXd v;
  Eigen::VectorXd weight;  // 1/sigma
  Eigen::VectorXd y;       // weighted
  bool both_directions = false;
};

/// Terms whose sign is fixed, because they brake.
bool brakes(const EffectParameter& term) {
  const auto& parameters = model::effects::effect_description(term.effect).parameters;
  return std::ranges::find(parameters, term.name, &ParameterDescription::name)->lower == 0;
}

/// Torque of `term` at each speed, per unit; for a Stribeck term at this velocity and exponent.
Eigen::VectorXd column(const EffectParameter& term, const Data& data, double velocity, double exponent) {
  const AnyEffect effect = term == terms::kStribeck
                               ? model::effects::make_effect(
                                     term.effect, {{"velocity_rad_per_s", velocity}, {"exponent", exponent}})
                               : model::effects::make_effect(term.effect);
  const AnyEffect basis = model::effects::basis_of(effect, term.name);
  const model::effects::EffectChain chain({&basis, 1});
  return data.weight.cwiseProduct(
      data.v.unaryExpr([&](double v) { return model::effects::sliding_torque_Nm(chain, v); }));
}

/// Least squares on one set of terms at one Stribeck velocity and exponent, prepared for any torques.
struct Candidate {
  Eigen::MatrixXd Q;         // orthonormal basis of the columns
  Eigen::VectorXd leverage;  // diagonal of Q·Qᵀ
  Eigen::MatrixXd braking;   // coefficients of the terms that must not be negative = braking·y
  double velocity = 0;
  double exponent = 0;
  bool reduced = false;  // some terms left out: used where the preceding candidate has them negative
};

/// All candidates of one set of terms; linear except for the choice among them. Where the data would make a
/// Coulomb, viscous or Stribeck term drive, its coefficient is zero, as in a fit of the law: a Stribeck dip,
/// or a negative viscous term with a large quadratic one, would predict well but is not friction.
class Family {
 public:
  Family(const Terms& terms, const Data& data) {
    Terms flat = terms;
    flat.erase(terms::kStribeck);
    flat.erase(terms::kStribeckExponent);
    if (!add(flat, data, 0, 0) || !terms.contains(terms::kStribeck)) return;
    const std::size_t flat_ones = candidates_.size();
    // Below the slowest speed the term is invisible; near the fastest its end is.
    const double slowest = std::log(data.v.cwiseAbs().minCoeff());
    const double widest = std::log(0.7 * data.v.cwiseAbs().maxCoeff()) - slowest;
    std::vector<double> exponents{1, 2};
    if (terms.contains(terms::kStribeckExponent)) exponents = {0.3, 0.5, 0.75, 1, 1.5, 2, 3, 4};
    for (const double exponent : exponents) {
      // A grid that is refined about the best, to a step below the noise: otherwise other terms compensate
      // the grid.
      constexpr int kVelocities = 20;
      double step = widest / (kVelocities - 1);
      double best = 0;
      double most = -1;
      const auto look = [&](double log_velocity) {
        const std::size_t before = candidates_.size();
        if (!add(terms, data, std::exp(log_velocity), exponent)) return;
        for (std::size_t i = before; i < candidates_.size(); ++i)
          if (const double explained = explained_by(candidates_[i], data.y); explained > most) {
            most = explained;
            best = log_velocity;
          }
      };
      for (int i = 0; i < kVelocities; ++i) look(slowest + i * step);
      for (int level = 0; level < 4 && most >= 0; ++level) {
        step /= 3;
        const double middle = best;
        for (const int i : {-2, -1, 1, 2}) look(middle + i * step);
      }
    }
    if (candidates_.size() == flat_ones)
      candidates_.clear();  // no peak can be distinguished from the other
                            // terms
  }
  bool usable() const { return !candidates_.empty(); }

  /// Sum of squared errors when each entry of `y` is predicted from the others.
  double held_out(const Eigen::VectorXd& y) const {
    const Eigen::Index n = y.size();
    const double square = y.squaredNorm();
    // Without any term nothing is predicted.
    Eigen::VectorXd best_error = y;
    Eigen::VectorXd best_sum = square - y.array().square();
    Eigen::VectorXd coefficients;
    Eigen::VectorXd residual;
    Eigen::VectorXd braking;
    bool whole_fits = false;
    for (const Candidate& candidate : candidates_) {
      if (candidate.reduced && whole_fits) continue;  // it cannot be better
      coefficients.noalias() = candidate.Q.transpose() * y;
      residual.noalias() = y - candidate.Q * coefficients;
      braking.noalias() = candidate.braking * y;
      const double sum = square - coefficients.squaredNorm();
      bool fits = braking.size() == 0 || braking.minCoeff() >= 0;
      for (Eigen::Index i = 0; i < n; ++i) {
        // Without row i the residual there is e/(1 − h), the sum of squares is less by e²/(1 − h), and each
        // coefficient is less by its share in that residual.
        const double error = residual[i] / (1 - candidate.leverage[i]);
        if (!((braking - candidate.braking.col(i) * error).array() >= 0).all()) {
          fits = false;
          continue;
        }
        const double rest = sum - residual[i] * error;
        if (rest < best_sum[i]) {
          best_sum[i] = rest;
          best_error[i] = error;
        }
      }
      if (!candidate.reduced) whole_fits = fits;
    }
    return best_error.squaredNorm();
  }

  const Candidate& best(const Eigen::VectorXd& y) const {
    return *std::max_element(candidates_.begin(), candidates_.end(), [&](const auto& a, const auto& b) {
      return explained_by(a, y) < explained_by(b, y);
    });
  }

 private:
  /// Negative if a term would drive.
  static double explained_by(const Candidate& candidate, const Eigen::VectorXd& y) {
    const bool drives = candidate.braking.rows() > 0 && (candidate.braking * y).minCoeff() < 0;
    return drives ? -1.0 : (candidate.Q.transpose() * y).squaredNorm();
  }

  /// All terms, then with some or all of the braking ones at zero, except the Stribeck term, without which
  /// velocity and exponent have no meaning. False if the terms cannot be distinguished there.
  bool add(const Terms& terms, const Data& data, double velocity, double exponent) {
    if (!add_one(terms, data, velocity, exponent)) return false;
    for (const bool coulomb : {true, false})
      for (const bool viscous : {true, false}) {
        Terms some = terms;
        if (!coulomb) some.erase(terms::kCoulomb);
        if (!viscous) some.erase(terms::kViscous);
        if (some.empty() || some == terms) continue;
        if (add_one(some, data, velocity, exponent)) candidates_.back().reduced = true;
      }
    return true;
  }
  bool add_one(const Terms& terms, const Data& data, double velocity, double exponent) {
    const Eigen::Index n = data.v.size();
    Eigen::MatrixXd columns(n, static_cast<Eigen::Index>(terms.size()));
    Eigen::Index count = 0;
    std::vector<Eigen::Index> braking;
    for (const EffectParameter& term : terms) {
      if (term == terms::kStribeckExponent) continue;
      if (brakes(term)) braking.push_back(count);
      columns.col(count++) = column(term, data, velocity, exponent);
    }
    columns.conservativeResize(n, count);
    const Eigen::VectorXd length = columns.colwise().norm();
    if (n <= count || !(length.minCoeff() > 0)) return false;
    columns *= length.cwiseInverse().asDiagonal();
    const Eigen::HouseholderQR<Eigen::MatrixXd> qr(columns);
    const Eigen::MatrixXd R = qr.matrixQR().topRows(count).triangularView<Eigen::Upper>();
    if (R.diagonal().cwiseAbs().minCoeff() < 1e-6) return false;  // two terms look alike here
    Candidate candidate;
    candidate.velocity = velocity;
    candidate.exponent = exponent;
    candidate.Q = qr.householderQ() * Eigen::MatrixXd::Identity(n, count);
    candidate.leverage = candidate.Q.rowwise().squaredNorm();
    if (candidate.leverage.maxCoeff() > 1 - 1e-9) return false;  // a point that only itself can predict
    const Eigen::MatrixXd inverse =
        R.triangularView<Eigen::Upper>().solve(Eigen::MatrixXd(candidate.Q.transpose()));
    candidate.braking = inverse(braking, Eigen::all);
    candidates_.push_back(std::move(candidate));
    return true;
  }

  std::vector<Candidate> candidates_;
};

/// Form for fit_static() with these terms.
StaticForm form_of(const Terms& terms, const Data& data) {
  StaticForm form;
  for (const EffectParameter& term : terms)
    if (term != terms::kStribeckExponent) form.add(term.effect);
  if (terms.contains(terms::kStribeck) && !terms.contains(terms::kStribeckExponent)) {
    const double exponent = Family(terms, data).best(data.y).exponent;
    form.give(terms::kStribeckExponent, exponent > 0 ? exponent : 1.0);  // 0: a peak of no height
  }
  return form;
}

class ChoiceSearch {
 public:
  ChoiceSearch(const StaticMap& map, const std::vector<std::size_t>& left_out, const Data& data,
               const ChoiceOptions& options)
      : map_(map), left_out_(left_out), data_(data), options_(options), random_(options.seed) {
    for (const MapPoint& point : map.points)
      top_speed_rad_per_s_ = std::max(top_speed_rad_per_s_, std::abs(point.velocity_rad_per_s));
    top_speed_rad_per_s_ = std::max(top_speed_rad_per_s_, options.top_speed_rad_per_s);
  }

  Terms run(std::vector<ChoiceStep>& steps) {
    Terms terms{terms::kCoulomb, terms::kViscous};
    while (add_one(terms, steps)) remove_some(terms, steps);
    remove_some(terms, steps);
    return terms;
  }

 private:
  /// A fit as reported.
  struct Fitted {
    double held_out_percent = std::numeric_limits<double>::infinity();
    bool brakes = false;  // at all speeds
  };

  static std::vector<EffectParameter> addable(const Terms& terms, const Data& data) {
    std::vector<EffectParameter> result;
    for (const EffectParameter& term : kTerms) {
      if (terms.contains(term) || term == terms::kCoulomb || term == terms::kViscous) continue;
      if (term == terms::kStribeckExponent && !terms.contains(terms::kStribeck)) continue;
      if ((term == terms::kTorqueOffset || term == terms::kViscousAsymmetry) && !data.both_directions)
        continue;
      result.push_back(term);
    }
    return result;
  }
  static Terms with(Terms terms, const EffectParameter& term) {
    terms.insert(term);
    return terms;
  }
  static Terms without(Terms terms, const EffectParameter& term) {
    terms.erase(term);
    if (term == terms::kStribeck) terms.erase(terms::kStribeckExponent);
    return terms;
  }

  const Fitted& fitted(const Terms& terms) {
    const auto [at, is_new] = fitted_.try_emplace(terms);
    if (!is_new) return at->second;
    const StaticFit fit = fit_static(map_, form_of(terms, data_),
                                     {.profile = false, .exclude_outliers = false, .left_out = left_out_});
    if (fit.ok())
      at->second = {fit.leave_one_out_percent, !model::effects::driving_velocity_rad_per_s(
                                                   {.effects = fit.effects}, top_speed_rad_per_s_)};
    return at->second;
  }
  /// Whether the additional terms of `rich` reduce the reported error relative to `simple`, and friction
  /// still brakes.
  bool serves(const Terms& rich, const Terms& simple) {
    return fitted(rich).brakes && fitted(rich).held_out_percent < fitted(simple).held_out_percent;
  }

  /// Probability that data from `simple` gain as much by one of `richer` as the measured ones did.
  double chance_of(double gain, const Family& simple, const std::vector<Family>& richer) {
    const Candidate& fit = simple.best(data_.y);
    const Eigen::VectorXd expected = fit.Q * (fit.Q.transpose() * data_.y);
    const Eigen::VectorXd noise = ((data_.y - expected).array() / (1 - fit.leverage.array()).sqrt()).matrix();
    std::uniform_int_distribution<Eigen::Index> any(0, noise.size() - 1);
    const ChanceTest test{
        .draw =
            [&] {
              Eigen::VectorXd made = expected;
              for (double& value : made)
                value += ((random_() >> 63U) != 0 ? 1.0 : -1.0) * noise[any(random_)];
              return made;
            },
        .most_gain =
            [&](const Eigen::VectorXd& made) {
              const double before = simple.held_out(made);
              double most = 0;
              for (const Family& family : richer) most = std::max(most, 1 - family.held_out(made) / before);
              return most;
            },
        .repetitions = options_.repetitions,
        // From here on no further repetition can make the p-value small enough.
        .enough_exceedances = std::max(
            6, static_cast<int>(std::ceil(options_.false_positive_rate * (1.0 + options_.repetitions))))};
    return test.p_value(gain);
  }

  bool add_one(Terms& terms, std::vector<ChoiceStep>& steps) {
    const Family simple(terms, data_);
    if (!simple.usable()) return false;
    const double before = simple.held_out(data_.y);
    std::vector<Family> families;
    std::vector<std::pair<double, EffectParameter>> candidates;  // by their error
    for (const EffectParameter& term : addable(terms, data_)) {
      Family family(with(terms, term), data_);
      if (!family.usable()) continue;
      candidates.emplace_back(family.held_out(data_.y), term);
      families.push_back(std::move(family));
    }
    if (families.empty() || !(before > 0)) return false;
    std::ranges::stable_sort(candidates, {}, &std::pair<double, EffectParameter>::first);
    const auto serving = std::ranges::find_if(
        candidates, [&](const auto& candidate) { return serves(with(terms, candidate.second), terms); });
    const auto [least, best] = serving == candidates.end() ? candidates.front() : *serving;
    ChoiceStep step{.term = best,
                    .held_out_before_percent = fitted(terms).held_out_percent,
                    .held_out_after_percent = fitted(with(terms, best)).held_out_percent,
                    .drives = !fitted(with(terms, best)).brakes};
    const double gain = 1 - least / before;
    if (gain > 0) step.p_value = chance_of(gain, simple, families);
    step.added = serving != candidates.end() && gain > 0 && step.p_value <= options_.false_positive_rate;
    steps.push_back(step);
    if (step.added) terms.insert(step.term);
    return step.added;
  }

  void remove_some(Terms& terms, std::vector<ChoiceStep>& steps) {
    const Terms asked = terms;
    for (const EffectParameter& term : asked) {
      if (term == terms::kCoulomb && (terms.contains(terms::kStribeck) || !terms.contains(terms::kViscous)))
        continue;
      if (term == terms::kViscous && !terms.contains(terms::kCoulomb)) continue;
      if (!steps.empty() && steps.back().added && steps.back().term == term) continue;
      if (term == terms::kStribeck && terms.contains(terms::kStribeckExponent)) continue;
      const Family simple(without(terms, term), data_);
      std::vector<Family> richer;
      richer.emplace_back(terms, data_);
      if (!simple.usable() || !richer.front().usable()) continue;
      ChoiceStep step{.term = term,
                      .removal = true,
                      .held_out_before_percent = fitted(without(terms, term)).held_out_percent,
                      .held_out_after_percent = fitted(terms).held_out_percent};
      const double gain = 1 - richer.front().held_out(data_.y) / simple.held_out(data_.y);
      if (gain > 0) step.p_value = chance_of(gain, simple, richer);
      step.added =
          gain > 0 && step.p_value <= options_.false_positive_rate && serves(terms, without(terms, term));
      if (step.added) continue;
      terms = without(terms, term);
      steps.push_back(step);
    }
  }

  const StaticMap& map_;
  const std::vector<std::size_t>& left_out_;
  const Data& data_;
  const ChoiceOptions& options_;
  double top_speed_rad_per_s_ = 0;
  std::mt19937_64 random_;
  std::map<Terms, Fitted> fitted_;
};

/// The speeds of a map, with the weights of a fit with all terms, without its outliers.
Data data_of(const StaticMap& map, const StaticFit& all) {
  std::vector<bool> out(map.points.size(), false);
  for (const std::size_t i : all.outliers) out[i] = true;
  std::vector<double> v;
  std::vector<double> y;
  std::vector<double> weight;
  bool forward = false;
  bool backward = false;
  for (const auto& speed : speeds_of(map)) {
    double sum_w = 0;
    double sum_v = 0;
    double sum_y = 0;
    for (const std::size_t i : speed) {
      if (out[i]) continue;
      const MapPoint& p = map.points[i];
      const double sigma = p.torque_ci95_Nm / 1.96;
      const double variance = sigma * sigma + all.scatter_Nm * all.scatter_Nm;
      const double w = variance > 0 ? 1 / variance : 1;
      sum_w += w;
      sum_v += w * p.velocity_rad_per_s;
      sum_y += w * p.torque_Nm;
    }
    if (sum_w == 0) continue;
    v.push_back(sum_v / sum_w);
    weight.push_back(std::sqrt(sum_w));
    y.push_back(sum_y / sum_w * std::sqrt(sum_w));
    (v.back() > 0 ? forward : backward) = true;
  }
  const auto size = static_cast<Eigen::Index>(v.size());
  return {Eigen::Map<Eigen::VectorXd>(v.data(), size), Eigen::Map<Eigen::VectorXd>(weight.data(), size),
          Eigen::Map<Eigen::VectorXd>(y.data(), size), forward && backward};
}

}  // namespace

std::string term_name(const EffectParameter& term) {
  if (term == terms::kTorqueOffset) return "torque offset or direction asymmetry";
  if (term == terms::kViscousAsymmetry) return "viscous asymmetry";
  std::string name(term.effect);
  if (term == terms::kStribeckExponent) name += " exponent";
  std::ranges::replace(name, '_', ' ');
  return name;
}

ModelChoice choose_model(const StaticMap& map, const ChoiceOptions& options) {
  ModelChoice choice;
  const StaticForm rich = form_named("kfm+offset+asymmetry+quadratic").give(terms::kStribeckExponent, 1);
  const StaticFitOptions quick{.profile = false, .leave_one_out = false};
  StaticFit all = fit_static(map, rich, quick);
  if (!all.ok()) {
    choice.verdicts.emplace_back(
        "too few speeds to choose terms from; Coulomb and viscous friction are assumed");
    choice.terms = {terms::kCoulomb, terms::kViscous};
    choice.form = form_named("stiction");
    return choice;
  }
  const Data data = data_of(map, all);
  choice.outliers = all.outliers;
  const Terms terms = ChoiceSearch(map, all.outliers, data, options).run(choice.steps);
  choice.terms.assign(terms.begin(), terms.end());
  choice.form = form_of(terms, data);
  return choice;
}

}  // namespace identification::fit
