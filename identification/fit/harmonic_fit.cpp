#include "identification/fit/harmonic_fit.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>

namespace identification::fit {
namespace {

constexpr double kTurn_rad = 2 * std::numbers::pi;
constexpr int kStretches = 12;

void require_usable(const PositionMap& map) {
  if (map.position_rad.size() != map.value.size())
    throw std::invalid_argument("harmonic fit: as many positions as values are needed");
  for (const auto* column : {&map.position_rad, &map.value})
    for (const double number : *column)
      if (!std::isfinite(number)) throw std::invalid_argument("harmonic fit: a value is not a number");
}

double within_turn(double position_rad) {
  const double rest = std::fmod(position_rad, kTurn_rad);
  return rest < 0 ? rest + kTurn_rad : rest;
}

Eigen::MatrixXd columns(const std::vector<double>& position_rad, const std::vector<int>& orders) {
  Eigen::MatrixXd A(static_cast<Eigen::Index>(position_rad.size()),
                    1 + 2 * static_cast<Eigen::Index>(orders.size()));
  A.col(0).setOnes();
  for (Eigen::Index i = 0; i < A.rows(); ++i)
    for (std::size_t k = 0; k < orders.size(); ++k) {
      const double angle = orders[k] * position_rad[static_cast<std::size_t>(i)];
      A(i, 1 + 2 * static_cast<Eigen::Index>(k)) = std::cos(angle);
      A(i, 2 + 2 * static_cast<Eigen::Index>(k)) = std::sin(angle);
    }
  return A;
}

Eigen::VectorXd solved(const Eigen::MatrixXd& A, const Eigen::VectorXd& y) {
  return (A.transpose() * A).ldlt().solve(A.transpose() * y);
}

/// Sum of squares of each stretch of the turn predicted from the others.
double held_out(const Eigen::MatrixXd& A, const Eigen::VectorXd& y, const std::vector<int>& stretch) {
  const Eigen::MatrixXd whole = A.transpose() * A;
  const Eigen::VectorXd right = A.transpose() * y;
  double sum = 0;
  for (int s = 0; s < kStretches; ++s) {
    Eigen::MatrixXd part = whole;
    Eigen::VectorXd part_right = right;
    for (Eigen::Index i = 0; i < A.rows(); ++i)
      if (stretch[static_cast<std::size_t>(i)] == s) {
        part.noalias() -= A.row(i).transpose() * A.row(i);
        part_right -= y[i] * A.row(i).transpose();
      }
    const Eigen::VectorXd x = part.ldlt().solve(part_right);
    for (Eigen::Index i = 0; i < A.rows(); ++i)
      if (stretch[static_cast<std::size_t>(i)] == s) {
        const double error = y[i] - A.row(i).dot(x);
        sum += error * error;
      }
  }
  return sum;
}

/// The order that takes most from `residual`.
int strongest(const std::vector<double>& position_rad, const Eigen::VectorXd& residual, int highest,
              const std::vector<int>& taken) {
  int best = 0;
  double most = -1;
  for (int order = 1; order <= highest; ++order) {
    if (std::find(taken.begin(), taken.end(), order) != taken.end()) continue;
    double c = 0;
    double s = 0;
    for (std::size_t i = 0; i < position_rad.size(); ++i) {
      const double r = residual[static_cast<Eigen::Index>(i)];
      c += r * std::cos(order * position_rad[i]);
      s += r * std::sin(order * position_rad[i]);
    }
    if (const double power = c * c + s * s; power > most) {
      most = power;
      best = order;
    }
  }
  return best;
}

}  // namespace

double Harmonic::amplitude() const { return std::hypot(cosine, sine); }

double HarmonicFit::at(double position_rad) const {
  double value = mean;
  for (const Harmonic& h : harmonics)
    value += h.cosine * std::cos(h.per_turn * position_rad) + h.sine * std::sin(h.per_turn * position_rad);
  return value;
}

double HarmonicFit::r_squared_on(const PositionMap& map) const {
  require_usable(map);
  if (map.value.empty()) throw std::invalid_argument("harmonic fit: the map to predict is empty");
  Eigen::VectorXd measured(static_cast<Eigen::Index>(map.value.size()));
  Eigen::VectorXd predicted = measured;
  for (std::size_t i = 0; i < map.value.size(); ++i) {
    measured[static_cast<Eigen::Index>(i)] = map.value[i];
    predicted[static_cast<Eigen::Index>(i)] = at(map.position_rad[i]);
  }
  return fit::r_squared(measured, predicted);
}

HarmonicFit fit_harmonics(const PositionMap& map, const HarmonicFitOptions& options) {
  require_usable(map);
  const std::size_t n = map.value.size();
  if (n < 16)
    throw std::invalid_argument("harmonic fit: at least 16 points are needed, there are " +
                                std::to_string(n));
  const Eigen::VectorXd y = Eigen::Map<const Eigen::VectorXd>(map.value.data(), static_cast<Eigen::Index>(n));

  std::vector<int> stretch(n);
  std::vector<int> per_stretch(kStretches, 0);
  for (std::size_t i = 0; i < n; ++i) {
    stretch[i] =
        std::min(kStretches - 1, static_cast<int>(within_turn(map.position_rad[i]) / kTurn_rad * kStretches));
    ++per_stretch[static_cast<std::size_t>(stretch[i])];
  }
  const auto [least, most] = std::minmax_element(map.position_rad.begin(), map.position_rad.end());
  const double turns = std::max(1.0, (*most - *least) / kTurn_rad);
  HarmonicFit fit;
  fit.mean = y.mean();
  if (*std::min_element(per_stretch.begin(), per_stretch.end()) == 0) {
    fit.verdicts.emplace_back("not every twelfth of a turn was measured: harmonics are not identifiable");
    return fit;
  }
  const int highest =
      std::min(options.highest_per_turn, static_cast<int>(static_cast<double>(n) / turns / 2) - 1);
  const int wanted = options.harmonics > 0 ? options.harmonics : options.most_harmonics;

  std::vector<int> orders;
  Eigen::MatrixXd A = columns(map.position_rad, orders);
  Eigen::VectorXd x = solved(A, y);
  double error = held_out(A, y, stretch);
  const double without = error;
  while (static_cast<int>(orders.size()) < std::min(wanted, highest) && 4 * (orders.size() + 2) < n) {
    std::vector<int> more = orders;
    more.push_back(strongest(map.position_rad, y - A * x, highest, orders));
    Eigen::MatrixXd B = columns(map.position_rad, more);
    const double next = held_out(B, y, stretch);
    if (options.harmonics == 0 && !(next < error * (1 - options.least_gain))) break;
    orders = std::move(more);
    A = std::move(B);
    x = solved(A, y);
    error = next;
  }

  const Eigen::VectorXd residual = A * x - y;
  const Eigen::MatrixXd covariance =
      block_covariance(A, residual, std::min(n, std::max(n / 8, 4 * orders.size() + 4)));
  fit.mean = x[0];
  for (std::size_t k = 0; k < orders.size(); ++k) {
    const auto c = 1 + 2 * static_cast<Eigen::Index>(k);
    Harmonic h{.per_turn = orders[k], .cosine = x[c], .sine = x[c + 1]};
    const Eigen::Vector2d direction = Eigen::Vector2d(h.cosine, h.sine) / std::max(h.amplitude(), 1e-300);
    h.amplitude_ci95 = student_975(static_cast<double>(A.rows() - A.cols())) *
                       std::sqrt(direction.dot(covariance.block<2, 2>(c, c) * direction));
    fit.harmonics.push_back(h);
  }
  fit.r_squared = fit::r_squared(y, A * x);
  fit.held_out_r_squared = 1 - error / (y.array() - y.mean()).square().sum();
  if (orders.empty() && without > 0)
    fit.verdicts.emplace_back("no harmonic predicts one part of the turn from the others");
  return fit;
}

}  // namespace identification::fit
