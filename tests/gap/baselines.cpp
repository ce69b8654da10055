#include "tests/gap/baselines.h"

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <string_view>

#include "identification/gap/candidates.h"
#include "identification/gap/diagnosis.h"
#include "identification/gap/fitted_model.h"
#include "identification/gap/prediction.h"
#include "identification/gap/signals.h"

namespace gap_test {
namespace {

using identification::gap::Rows;
using identification::gap::Signals;
using identification::gap::Source;
using Indices = std::vector<Eigen::Index>;

constexpr std::string_view kInertia = "inertia";
constexpr Eigen::Index kFolds = 8;
/// Of a column of unit rms: as much as makes near copies of one shape share their amplitude.
constexpr double kRidge = 1e-6;
constexpr int kHarmonics = 2;  // of a ripple
constexpr int kMaxRounds = 20;
constexpr int kThresholds = 16;
constexpr double kMinThreshold = 0.02;  // of what the given model leaves, rms
constexpr double kMaxThreshold = 0.9;

/// Torque columns of unit rms over the rows to learn from, and whose they are; the given model's own
/// parameters come first and have no name.
struct Problem {
  Eigen::MatrixXd columns;
  std::vector<std::string_view> effect;
  std::vector<std::size_t> candidate;  // columns of one shape have one number
  /// Of the given inertia, by which one of the first column's amplitude changes it: a few per cent are no
  /// effect, as in the search.
  double inertia_share = 0;
  Eigen::VectorXd target;  // what the given model leaves
  Indices learn;
  Indices held_out;
};

/// sin(N·θ), cos(N·θ) for the N with which least squares removes most of `left`: a spectrum resolves it to
/// one in the total number of turns. Empty: the joint does not turn far enough.
Eigen::MatrixXd sharpest_ripple(const Eigen::VectorXd& left, const Rows& rows, const Indices& learn) {
  constexpr int kTrials = 20;  // on each side
  const Eigen::VectorXd position = rows.means([](const Signals& s) { return s.position_rad; });
  const double periods = identification::gap::ripple_periods_per_rev(left(learn), position(learn));
  if (!(periods > 0)) return {};
  const double width = 2 * std::numbers::pi / (position.maxCoeff() - position.minCoeff());
  Eigen::MatrixXd best;
  double most = 0;
  for (int i = -kTrials; i <= kTrials; ++i) {
    const double tried = periods + width * i / kTrials;
    Eigen::MatrixXd columns(rows.count(), 2);
    for (const int quarter : {0, 1})
      columns.col(quarter) = rows.column([&](const Signals& s) {
        std::vector<double> ripple = s.position_rad;
        for (double& value : ripple) value = std::sin(tried * value + quarter * std::numbers::pi / 2);
        return ripple;
      });
    const Eigen::Vector2d product = columns(learn, Eigen::all).transpose() * left(learn);
    const Eigen::Matrix2d gram = columns(learn, Eigen::all).transpose() * columns(learn, Eigen::all);
    const double taken = product.dot(gram.ldlt().solve(product));
    if (taken <= most) continue;
    most = taken;
    best = std::move(columns);
  }
  return best;
}

Problem make_problem(const Case& gap_case) {
  namespace gap = identification::gap;
  gap::Diagnosed data = gap::diagnose(gap_case.data, gap_case.base);
  gap::Diagnosed held_out = gap::diagnose(gap_case.held_out, gap_case.base);
  const std::size_t to_learn = data.sources.size();
  std::vector<Source> sources = std::move(data.sources);
  sources.insert(sources.end(), held_out.sources.begin(), held_out.sources.end());
  const gap::Band band = gap::choose_band(sources, gap_case.base);
  std::vector<Signals> signals;
  for (const Source& source : sources) signals.push_back(gap::make_signals(source, band));
  const Rows rows(signals);

  Problem problem;
  for (Eigen::Index i = 0; i < rows.count(); ++i)
    (rows.recording(i) < to_learn ? problem.learn : problem.held_out).push_back(i);
  const gap::FittedModel given = gap::refined(
      {.model = gap_case.base, .given_inertia_kg_m2 = gap_case.base.inertia_kg_m2}, rows, problem.learn);
  problem.target = rows.torque_Nm() - gap::predicted_rows(given, rows);
  const std::vector<gap::FreeParameter> free = gap::free_parameters(given, rows);
  const Eigen::MatrixXd own = gap::prediction_jacobian(given, rows, free);
  const gap::Dictionary dictionary = gap::make_dictionary(given, rows);

  std::vector<Eigen::VectorXd> columns;
  const auto add = [&](const Eigen::VectorXd& column, std::string_view effect, std::size_t candidate) {
    const double rms =
        std::sqrt(column(problem.learn).squaredNorm() / static_cast<double>(problem.learn.size()));
    if (!(rms > 0)) return 0.0;
    columns.emplace_back(column / rms);
    problem.effect.push_back(effect);
    problem.candidate.push_back(candidate);
    return 1 / rms;
  };
  for (std::size_t k = 0; k < free.size(); ++k)
    if (free[k].kind == gap::FreeParameter::Kind::kInertia)
      problem.inertia_share = add(own.col(static_cast<Eigen::Index>(k)), "", 0) / given.given_inertia_kg_m2;
  for (std::size_t k = 0; k < free.size(); ++k)
    if (free[k].kind != gap::FreeParameter::Kind::kInertia) add(own.col(static_cast<Eigen::Index>(k)), "", 0);
  std::size_t number = 0;
  for (const gap::Candidate& candidate : dictionary.candidates) {
    ++number;
    if (candidate.effect == kInertia) continue;
    for (const Eigen::Index k : candidate.columns) add(dictionary.columns.col(k), candidate.effect, number);
  }
  Eigen::VectorXd left = problem.target;
  for (int harmonic = 0; harmonic < kHarmonics; ++harmonic) {
    const Eigen::MatrixXd ripple = sharpest_ripple(left, rows, problem.learn);
    if (ripple.cols() == 0) break;
    for (Eigen::Index k = 0; k < ripple.cols(); ++k) add(ripple.col(k), "cogging", number + 1);
    const Eigen::MatrixXd learnt = ripple(problem.learn, Eigen::all);
    left -= ripple * learnt.householderQr().solve(Eigen::VectorXd(left(problem.learn)));
  }
  problem.columns.resize(rows.count(), static_cast<Eigen::Index>(columns.size()));
  for (std::size_t k = 0; k < columns.size(); ++k)
    problem.columns.col(static_cast<Eigen::Index>(k)) = columns[k];
  return problem;
}

/// Normal equations of some rows.
struct Normal {
  Eigen::MatrixXd gram;
  Eigen::VectorXd product;
  double square = 0;
  double rows = 0;
};
Normal normal_of(const Problem& problem, const Indices& rows) {
  const Eigen::MatrixXd columns = problem.columns(rows, Eigen::all);
  const Eigen::VectorXd target = problem.target(rows);
  return {columns.transpose() * columns, columns.transpose() * target, target.squaredNorm(),
          static_cast<double>(rows.size())};
}
Normal difference(const Normal& all, const Normal& part) {
  return {all.gram - part.gram, all.product - part.product, all.square - part.square, all.rows - part.rows};
}

Eigen::MatrixXd with_ridge(const Normal& normal, const Indices& active) {
  Eigen::MatrixXd gram = normal.gram(active, active);
  gram.diagonal().array() += kRidge * normal.rows;
  return gram;
}
/// Zero where not active.
Eigen::VectorXd solved(const Normal& normal, const Indices& active) {
  Eigen::VectorXd result = Eigen::VectorXd::Zero(normal.product.size());
  const Eigen::VectorXd product = normal.product(active);
  result(active) = Eigen::VectorXd(with_ridge(normal, active).ldlt().solve(product));
  return result;
}
double square_left(const Normal& normal, const Eigen::VectorXd& amplitudes) {
  return normal.square - 2 * amplitudes.dot(normal.product) + amplitudes.dot(normal.gram * amplitudes);
}

Indices all_columns(const Problem& problem) {
  Indices all;
  for (Eigen::Index k = 0; k < problem.columns.cols(); ++k) all.push_back(k);
  return all;
}

/// The given model's own columns always stay.
Eigen::VectorXd thresholded(const Problem& problem, const Normal& normal, double threshold_Nm) {
  Indices active = all_columns(problem);
  Eigen::VectorXd amplitudes = solved(normal, active);
  for (int round = 0; round < kMaxRounds; ++round) {
    const std::size_t before = active.size();
    std::erase_if(active, [&](Eigen::Index k) {
      return !problem.effect[static_cast<std::size_t>(k)].empty() && std::abs(amplitudes[k]) < threshold_Nm;
    });
    amplitudes = solved(normal, active);
    if (active.size() == before) break;
  }
  return amplitudes;
}

BaselineAnswer answer_of(const Problem& problem, const Eigen::VectorXd& amplitudes,
                         const std::vector<bool>& named) {
  BaselineAnswer answer;
  for (std::size_t k = 0; k < named.size(); ++k) {
    const std::string name(problem.effect[k]);
    if (named[k] && !name.empty() && std::ranges::find(answer.named, name) == answer.named.end())
      answer.named.push_back(name);
  }
  if (std::abs(problem.inertia_share * amplitudes[0]) > identification::gap::kInertiaTolerance)
    answer.named.emplace_back(kInertia);
  const Eigen::VectorXd left = (problem.target - problem.columns * amplitudes)(problem.held_out);
  answer.gap_after_Nm = std::sqrt(left.squaredNorm() / static_cast<double>(left.size()));
  return answer;
}

BaselineAnswer sparse(const Problem& problem, const Normal& normal) {
  std::vector<Normal> folds;
  for (Eigen::Index fold = 0; fold < kFolds; ++fold) {
    Indices rows;
    const auto count = static_cast<Eigen::Index>(problem.learn.size());
    for (Eigen::Index i = fold * count / kFolds; i < (fold + 1) * count / kFolds; ++i)
      rows.push_back(problem.learn[static_cast<std::size_t>(i)]);
    folds.push_back(normal_of(problem, rows));
  }
  const double all_Nm = std::sqrt(normal.square / normal.rows);
  double best = 0;
  double least = std::numeric_limits<double>::infinity();
  for (int i = 0; i < kThresholds; ++i) {
    const double share =
        kMinThreshold * std::pow(kMaxThreshold / kMinThreshold, static_cast<double>(i) / (kThresholds - 1));
    double left = 0;
    for (const Normal& fold : folds)
      left += square_left(fold, thresholded(problem, difference(normal, fold), share * all_Nm));
    if (left < least) {
      least = left;
      best = share * all_Nm;
    }
  }
  const Eigen::VectorXd amplitudes = thresholded(problem, normal, best);
  std::vector<bool> named;
  for (const double amplitude : amplitudes) named.push_back(amplitude != 0);
  return answer_of(problem, amplitudes, named);
}

BaselineAnswer all_parameters(const Problem& problem, const Normal& normal) {
  Indices own;
  for (std::size_t k = 0; k < problem.effect.size(); ++k)
    if (problem.effect[k].empty()) own.push_back(static_cast<Eigen::Index>(k));
  struct Shape {
    double left = std::numeric_limits<double>::infinity();
    Indices columns{};
  };
  std::map<std::string_view, Shape> shapes;
  for (std::size_t k = own.size(); k < problem.effect.size();) {
    Shape shape;
    std::size_t to = k;
    for (; to < problem.effect.size() && problem.candidate[to] == problem.candidate[k]; ++to)
      shape.columns.push_back(static_cast<Eigen::Index>(to));
    Indices tried = own;
    tried.insert(tried.end(), shape.columns.begin(), shape.columns.end());
    shape.left = square_left(normal, solved(normal, tried));
    Shape& known = shapes[problem.effect[k]];
    if (shape.left < known.left) known = shape;
    k = to;
  }
  Indices active = own;
  for (const auto& [effect, shape] : shapes)
    active.insert(active.end(), shape.columns.begin(), shape.columns.end());

  const Eigen::VectorXd amplitudes = solved(normal, active);
  const auto count = static_cast<Eigen::Index>(active.size());
  const Eigen::MatrixXd inverse =
      with_ridge(normal, active).ldlt().solve(Eigen::MatrixXd::Identity(count, count));
  const double variance = square_left(normal, amplitudes) / (normal.rows - static_cast<double>(count));
  std::vector<bool> named(problem.effect.size(), false);
  for (Eigen::Index k = 0; k < count; ++k) {
    const Eigen::Index column = active[static_cast<std::size_t>(k)];
    named[static_cast<std::size_t>(column)] =
        std::abs(amplitudes[column]) > 1.96 * std::sqrt(variance * inverse(k, k));
  }
  return answer_of(problem, amplitudes, named);
}

}  // namespace

BaselineAnswers baseline_answers(const Case& gap_case) {
  const Problem problem = make_problem(gap_case);
  const Normal normal = normal_of(problem, problem.learn);
  return {.could_name_all = std::ranges::all_of(gap_case.spec.hidden,
                                                [&](Hidden hidden) {
                                                  return name_of(hidden) == kInertia ||
                                                         std::ranges::find(problem.effect, name_of(hidden)) !=
                                                             problem.effect.end();
                                                }),
          .sparse = sparse(problem, normal),
          .all_parameters = all_parameters(problem, normal)};
}

bool is_right(const BaselineAnswer& answer, const CaseSpec& spec) {
  if (spec.kind == CaseKind::kOutside) return answer.named.empty();
  return answer.named.size() == spec.hidden.size() && std::ranges::all_of(spec.hidden, [&](Hidden hidden) {
           return std::ranges::find(answer.named, name_of(hidden)) != answer.named.end();
         });
}

}  // namespace gap_test
