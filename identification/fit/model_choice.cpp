#include "identification/fit/model_choice.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <random>
#include <set>
#include <stdexcept>
#include <utility>

#include "model/friction/kfm.h"

namespace identification::fit {
namespace {

using Terms = std::set<Term>;

/// One row per speed, everything divided by its standard deviation.
struct Data {
  Eigen::VectorXd v;
  Eigen::VectorXd weight;  // 1/sigma
  Eigen::VectorXd y;       // weighted
  bool both_directions = false;
};

/// The law whose static_Nm alone is 1: the Stribeck term per N·m.
double stribeck_shape(double v, double velocity, double exponent) {
  return model::friction::Kfm({.coulomb_Nm = 0,
                               .static_Nm = 1,
                               .stribeck_velocity_rad_per_s = velocity,
                               .stribeck_exponent = exponent,
                               .viscous_Nm_s_per_rad = 0})
      .steady_Nm(v);
}

double column_value(Term term, double v) {
  switch (term) {
    case Term::kCoulomb: return std::copysign(1.0, v);
    case Term::kViscous: return v;
    case Term::kTorqueOffset: return 1;
    case Term::kViscousAsymmetry: return std::abs(v);
    case Term::kQuadratic: return v * std::abs(v);
    case Term::kStribeck:
    case Term::kStribeckExponent: break;
  }
  throw std::logic_error("model choice: not a linear term");
}

/// What no drive has with another sign, and no law takes: these terms brake.
bool brakes(Term term) { return term == Term::kCoulomb || term == Term::kViscous || term == Term::kStribeck; }

/// Least squares on one set of terms at one Stribeck velocity and exponent, ready for any torques.
struct Candidate {
  Eigen::MatrixXd Q;         // orthonormal basis of the columns
  Eigen::VectorXd leverage;  // diagonal of Q·Qᵀ
  Eigen::MatrixXd braking;   // coefficients of the terms that must not be negative = braking·y
  double velocity = 0;
  double exponent = 0;
  bool reduced = false;  // some of them left out: for where the candidate before it has them negative
};

/// All candidates of one set of terms; linear but for the choice among them. Where the data would have a
/// Coulomb, viscous or Stribeck term drive, its coefficient is zero, as in a fit of the law: a Stribeck term
/// that is a hollow, or a viscous one that is negative beside a large quadratic one, would predict well and
/// be no friction.
class Family {
 public:
  Family(const Terms& terms, const Data& data) {
    Terms flat = terms;
    flat.erase(Term::kStribeck);
    flat.erase(Term::kStribeckExponent);
    if (!add(flat, data, 0, 0) || !terms.contains(Term::kStribeck)) return;
    const std::size_t flat_ones = candidates_.size();
    // Below the slowest speed nothing of the term is seen, near the fastest no end of it.
    const double slowest = std::log(data.v.cwiseAbs().minCoeff());
    const double widest = std::log(0.7 * data.v.cwiseAbs().maxCoeff()) - slowest;
    std::vector<double> exponents{1, 2};
    if (terms.contains(Term::kStribeckExponent)) exponents = {0.3, 0.5, 0.75, 1, 1.5, 2, 3, 4};
    for (const double exponent : exponents) {
      // Finer and finer about the best, to a step that the noise hides: else other terms mend the grid.
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
    if (candidates_.size() == flat_ones) candidates_.clear();  // no peak can be told from the other terms
  }
  bool usable() const { return !candidates_.empty(); }

  /// Sum of squared errors of predicting each entry of `y` from the others.
  double held_out(const Eigen::VectorXd& y) const {
    const Eigen::Index n = y.size();
    const double square = y.squaredNorm();
    // Without any term that may be there nothing is predicted.
    best_error_ = y;
    best_sum_ = square - y.array().square();
    bool whole_fits = false;
    for (const Candidate& candidate : candidates_) {
      if (candidate.reduced && whole_fits) continue;  // it would not be better
      coefficients_.noalias() = candidate.Q.transpose() * y;
      residual_.noalias() = y - candidate.Q * coefficients_;
      braking_.noalias() = candidate.braking * y;
      const double sum = square - coefficients_.squaredNorm();
      bool fits = braking_.size() == 0 || braking_.minCoeff() >= 0;
      for (Eigen::Index i = 0; i < n; ++i) {
        // Without row i the residual there is e/(1 − h), the sum of squares e²/(1 − h) less and each
        // coefficient less by its share in that residual.
        const double error = residual_[i] / (1 - candidate.leverage[i]);
        if (!((braking_ - candidate.braking.col(i) * error).array() >= 0).all()) {
          fits = false;
          continue;
        }
        const double rest = sum - residual_[i] * error;
        if (rest < best_sum_[i]) {
          best_sum_[i] = rest;
          best_error_[i] = error;
        }
      }
      if (!candidate.reduced) whole_fits = fits;
    }
    return best_error_.squaredNorm();
  }

  const Candidate& best(const Eigen::VectorXd& y) const {
    return *std::max_element(candidates_.begin(), candidates_.end(), [&](const auto& a, const auto& b) {
      return explained_by(a, y) < explained_by(b, y);
    });
  }

 private:
  /// Negative where a term would drive.
  static double explained_by(const Candidate& candidate, const Eigen::VectorXd& y) {
    const bool drives = candidate.braking.rows() > 0 && (candidate.braking * y).minCoeff() < 0;
    return drives ? -1.0 : (candidate.Q.transpose() * y).squaredNorm();
  }

  /// The terms there, then with some or all of the braking ones at zero, but for the Stribeck term, without
  /// which velocity and exponent mean nothing. False when the terms cannot be told apart there.
  bool add(const Terms& terms, const Data& data, double velocity, double exponent) {
    if (!add_one(terms, data, velocity, exponent)) return false;
    for (const bool coulomb : {true, false})
      for (const bool viscous : {true, false}) {
        Terms some = terms;
        if (!coulomb) some.erase(Term::kCoulomb);
        if (!viscous) some.erase(Term::kViscous);
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
    for (const Term term : terms) {
      if (term == Term::kStribeckExponent) continue;
      if (brakes(term)) braking.push_back(count);
      for (Eigen::Index i = 0; i < n; ++i)
        columns(i, count) =
            data.weight[i] * (term == Term::kStribeck ? stribeck_shape(data.v[i], velocity, exponent)
                                                      : column_value(term, data.v[i]));
      ++count;
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
  // Kept between calls of held_out(), which runs thousands of times.
  mutable Eigen::VectorXd coefficients_;
  mutable Eigen::VectorXd residual_;
  mutable Eigen::VectorXd braking_;
  mutable Eigen::VectorXd best_sum_;
  mutable Eigen::VectorXd best_error_;
};

/// What fit_static() fits with these terms.
StaticForm form_of(const Terms& terms, const Data& data) {
  StaticForm form{.law = "stiction"};
  if (terms.contains(Term::kStribeck)) {
    form.law = "kfm";
    if (!terms.contains(Term::kStribeckExponent)) {
      const double exponent = Family(terms, data).best(data.y).exponent;
      form.fixed.emplace_back("stribeck_exponent", exponent > 0 ? exponent : 1.0);  // 0: a peak of no height
    }
    if (!terms.contains(Term::kViscous)) form.fixed.emplace_back("viscous_Nm_s_per_rad", 0.0);
  } else if (!terms.contains(Term::kViscous)) {
    form.law = "coulomb";
  } else if (!terms.contains(Term::kCoulomb)) {
    form.law = "viscous";
  }
  form.torque_offset = terms.contains(Term::kTorqueOffset);
  form.viscous_asymmetry = terms.contains(Term::kViscousAsymmetry);
  form.quadratic = terms.contains(Term::kQuadratic);
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
    Terms terms{Term::kCoulomb, Term::kViscous};
    while (add_one(terms, steps)) remove_some(terms, steps);
    remove_some(terms, steps);
    return terms;
  }

 private:
  /// A fit as the one that is reported.
  struct Fitted {
    double held_out_percent = std::numeric_limits<double>::infinity();
    bool brakes = false;  // at all speeds
  };

  static std::vector<Term> addable(const Terms& terms, const Data& data) {
    std::vector<Term> result;
    for (const Term term : {Term::kTorqueOffset, Term::kViscousAsymmetry, Term::kQuadratic, Term::kStribeck,
                            Term::kStribeckExponent}) {
      if (terms.contains(term)) continue;
      if (term == Term::kStribeckExponent && !terms.contains(Term::kStribeck)) continue;
      if ((term == Term::kTorqueOffset || term == Term::kViscousAsymmetry) && !data.both_directions) continue;
      result.push_back(term);
    }
    return result;
  }
  static Terms with(Terms terms, Term term) {
    terms.insert(term);
    return terms;
  }
  static Terms without(Terms terms, Term term) {
    terms.erase(term);
    if (term == Term::kStribeck) terms.erase(Term::kStribeckExponent);
    return terms;
  }

  const Fitted& fitted(const Terms& terms) {
    const auto [at, is_new] = fitted_.try_emplace(terms);
    if (!is_new) return at->second;
    const StaticFit fit = fit_static(map_, form_of(terms, data_),
                                     {.profile = false, .exclude_outliers = false, .left_out = left_out_});
    if (fit.ok())
      at->second = {fit.leave_one_out_percent, !driving_velocity_rad_per_s(fit, top_speed_rad_per_s_)};
    return at->second;
  }
  /// Whether the reported error falls by what `rich` has more than `simple`, and friction still brakes.
  bool serves(const Terms& rich, const Terms& simple) {
    return fitted(rich).brakes && fitted(rich).held_out_percent < fitted(simple).held_out_percent;
  }

  /// How often data made from `simple` gain as much by one of `richer` as the measured ones did.
  double chance_of(double gain, const Family& simple, const std::vector<Family>& richer) {
    const Candidate& fit = simple.best(data_.y);
    const Eigen::VectorXd expected = fit.Q * (fit.Q.transpose() * data_.y);
    const Eigen::VectorXd noise = ((data_.y - expected).array() / (1 - fit.leverage.array()).sqrt()).matrix();
    std::uniform_int_distribution<Eigen::Index> draw(0, noise.size() - 1);
    Eigen::VectorXd made(noise.size());
    int as_good = 0;
    for (int repetition = 0; repetition < options_.repetitions; ++repetition) {
      for (Eigen::Index i = 0; i < made.size(); ++i)
        made[i] = expected[i] + ((random_() >> 63U) != 0 ? 1.0 : -1.0) * noise[draw(random_)];
      const double before = simple.held_out(made);
      double most = 0;
      for (const Family& family : richer) most = std::max(most, 1 - family.held_out(made) / before);
      as_good += most >= gain ? 1 : 0;
    }
    return (1.0 + as_good) / (1.0 + options_.repetitions);
  }

  bool add_one(Terms& terms, std::vector<ChoiceStep>& steps) {
    const Family simple(terms, data_);
    if (!simple.usable()) return false;
    const double before = simple.held_out(data_.y);
    std::vector<Family> families;
    std::vector<std::pair<double, Term>> candidates;  // by their error
    for (const Term term : addable(terms, data_)) {
      Family family(with(terms, term), data_);
      if (!family.usable()) continue;
      candidates.emplace_back(family.held_out(data_.y), term);
      families.push_back(std::move(family));
    }
    if (families.empty() || !(before > 0)) return false;
    std::ranges::sort(candidates);
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
    for (const Term term : asked) {
      if (term == Term::kCoulomb && (terms.contains(Term::kStribeck) || !terms.contains(Term::kViscous)))
        continue;
      if (term == Term::kViscous && !terms.contains(Term::kCoulomb)) continue;
      if (!steps.empty() && steps.back().added && steps.back().term == term) continue;
      if (term == Term::kStribeck && terms.contains(Term::kStribeckExponent)) continue;
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

/// The speeds of a map, weighted as a fit with all terms would, without its outliers.
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

const char* term_name(Term term) noexcept {
  switch (term) {
    case Term::kCoulomb: return "coulomb";
    case Term::kViscous: return "viscous";
    case Term::kTorqueOffset: return "torque offset or direction asymmetry";
    case Term::kViscousAsymmetry: return "viscous asymmetry";
    case Term::kQuadratic: return "quadratic drag";
    case Term::kStribeck: return "stribeck";
    case Term::kStribeckExponent: return "stribeck exponent";
  }
  return "?";
}

ModelChoice choose_model(const StaticMap& map, const ChoiceOptions& options) {
  ModelChoice choice;
  StaticForm rich{.law = "kfm",
                  .torque_offset = true,
                  .viscous_asymmetry = true,
                  .quadratic = true,
                  .fixed = {{"stribeck_exponent", 1.0}}};
  const StaticFitOptions quick{.profile = false, .leave_one_out = false};
  StaticFit all = fit_static(map, rich, quick);
  if (!all.ok()) {
    choice.verdicts.emplace_back(
        "too few speeds to choose terms from; Coulomb and viscous friction are assumed");
    choice.terms = {Term::kCoulomb, Term::kViscous};
    choice.form.law = "stiction";
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
