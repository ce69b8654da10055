#include "identification/gap/structure.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <bit>
#include <cmath>
#include <complex>
#include <functional>
#include <memory>
#include <numbers>
#include <numeric>
#include <string>
#include <unsupported/Eigen/FFT>
#include <utility>

#include "identification/gap/candidates.h"
#include "identification/gap/chance_data.h"
#include "identification/gap/regression.h"

namespace identification::gap {
namespace {

constexpr int kStructureFolds = 8;
constexpr double kBurstWindow_s = 0.3;
/// Squared residual of a stretch relative to a usual one.
constexpr double kBurst = 12;
/// Minimum share of the squared residual to be listed.
constexpr double kMinStructureShare = 0.05;
constexpr std::size_t kMaxJudgingBlocks = 32;
constexpr std::size_t kRowsToJudgeBy = 5;

using Samples = std::vector<double>;

/// Triangles that add up to one: any piecewise linear function of `x` between its 1 % and 99 % quantiles.
Eigen::MatrixXd hats(const Eigen::VectorXd& x, int count) {
  std::vector<double> sorted(x.data(), x.data() + x.size());
  std::ranges::sort(sorted);
  const double low = sorted[sorted.size() / 100];
  const double high = sorted[sorted.size() - 1 - sorted.size() / 100];
  Eigen::MatrixXd result = Eigen::MatrixXd::Zero(x.size(), count);
  if (!(high > low)) return result;
  for (Eigen::Index i = 0; i < x.size(); ++i) {
    const double at = std::clamp((x[i] - low) / (high - low), 0.0, 1.0) * (count - 1);
    const auto k = std::min(static_cast<Eigen::Index>(at), static_cast<Eigen::Index>(count) - 2);
    const double share = at - static_cast<double>(k);
    result(i, k) = 1 - share;
    result(i, k + 1) = share;
  }
  return result;
}

struct Coordinate {
  const char* name;
  std::function<Samples(const Signals&)> value;
  int nodes;
  bool by_direction;  ///< its function changes sign with the direction of motion
};

std::vector<Coordinate> coordinates() {
  return {{"velocity_rad_per_s", [](const Signals& s) { return s.velocity_rad_per_s; }, 14, false},
          {"acceleration_rad_per_s2", [](const Signals& s) { return s.acceleration_rad_per_s2; }, 9, false},
          {"position_rad", [](const Signals& s) { return s.position_rad; }, 24, false},
          {"time_since_reversal_s", [](const Signals& s) { return s.since_reversal_s; }, 8, true},
          {"running_time_s", [](const Signals& s) { return s.running_s; }, 8, true}};
}

/// Rows of `use` that belong to one recording, with all its excerpts.
struct OfRecording {
  Eigen::Index from;
  Eigen::Index count;
};
std::vector<OfRecording> by_recording(const Rows& rows, const std::vector<Eigen::Index>& use) {
  std::vector<OfRecording> result;
  const auto source_of = [&](Eigen::Index i) {
    return rows.signals()[rows.recording(use[static_cast<std::size_t>(i)])].source;
  };
  const auto count = static_cast<Eigen::Index>(use.size());
  for (Eigen::Index from = 0; from < count;) {
    Eigen::Index to = from;
    while (to < count && source_of(to) == source_of(from)) ++to;
    result.push_back({from, to - from});
    from = to;
  }
  return result;
}

/// Index of the row in its recording if none were left out.
std::size_t slot_in_recording(const Rows& rows, Eigen::Index row) {
  const Signals& s = rows.signals()[rows.recording(row)];
  const double before_s = s.time_s.front() - s.recorded_from_s;
  return rows.slot(row) + static_cast<std::size_t>(std::llround(before_s / rows.length_s()));
}

/// Dominant frequency of the residual in time, over all recordings; 0 if there is none.
double cycle_Hz(const Eigen::VectorXd& residual, const Rows& rows, const std::vector<Eigen::Index>& use) {
  constexpr std::size_t kMinBins = 1 << 13;
  std::size_t bins = kMinBins;
  for (const Eigen::Index row : use) bins = std::max(bins, std::bit_ceil(slot_in_recording(rows, row) + 1));
  std::vector<double> power(bins / 2, 0);
  Eigen::FFT<double> fft;
  for (const OfRecording& own : by_recording(rows, use)) {
    std::vector<double> series(bins, 0);
    for (Eigen::Index i = own.from; i < own.from + own.count; ++i)
      series[slot_in_recording(rows, use[static_cast<std::size_t>(i)])] = residual[i];
    std::vector<std::complex<double>> spectrum;
    fft.fwd(spectrum, series);
    for (std::size_t k = 0; k < power.size(); ++k) power[k] += std::norm(spectrum[k]);
  }
  // Periods above a few seconds are drift, which has its own coordinate.
  const double length_s = static_cast<double>(bins) * rows.length_s();
  const auto slowest = std::max<std::size_t>(1, static_cast<std::size_t>(0.3 * length_s));
  if (slowest >= power.size()) return 0;
  const auto best = std::max_element(power.begin() + static_cast<std::ptrdiff_t>(slowest), power.end());
  return static_cast<double>(best - power.begin()) / length_s;
}

/// Share that a sine and cosine of time remove in each recording: phases and fits of the recordings are
/// independent.
double cycle_gain(double frequency_Hz, const Rows& rows, const Training& training,
                  const Eigen::VectorXd& target) {
  if (frequency_Hz == 0) return 0;
  const std::vector<Eigen::Index> both{0, 1};
  const std::vector<Bounds> bounds(both.size());
  double left = 0;
  for (const OfRecording& own : by_recording(rows, training.rows)) {
    Eigen::MatrixXd columns(own.count, 2);
    for (Eigen::Index i = 0; i < own.count; ++i) {
      const double time_s = rows.time_s(training.rows[static_cast<std::size_t>(own.from + i)]);
      const double angle = 2 * std::numbers::pi * frequency_Hz * time_s;
      columns.row(i) << std::sin(angle), std::cos(angle);
    }
    const auto block = training.block.begin() + own.from;
    const BlockRegression regression(columns, {block, block + own.count}, kStructureFolds);
    left += regression.held_out(regression.target(target.segment(own.from, own.count)), both, bounds);
  }
  return 1 - left / target.squaredNorm();
}

/// Rows with the residual of a model.
struct Part {
  Part(Training blocks, const Eigen::VectorXd& of_all)
      : training(std::move(blocks)), residual(of_all(training.rows)) {}
  Training training;
  Eigen::VectorXd residual;
};

/// Short data have fewer blocks: a block of a row or two is useless.
Training in_blocks(const std::vector<Eigen::Index>& held_out) {
  const std::size_t blocks = std::clamp<std::size_t>(held_out.size() / kRowsToJudgeBy, 2, kMaxJudgingBlocks);
  Training result{.rows = held_out, .block = {}};
  for (std::size_t i = 0; i < held_out.size(); ++i)
    result.block.push_back(static_cast<int>(i * blocks / held_out.size()));
  return result;
}

/// A smooth function of one coordinate, over the rows of one part.
class Shape {
 public:
  Shape(const char* coordinate, Eigen::VectorXd x, Eigen::MatrixXd columns, const Part& part)
      : coordinate_(coordinate),
        x_(std::move(x)),
        columns_(std::move(columns)),
        regression_(columns_, part.training.block, kStructureFolds),
        all_(static_cast<std::size_t>(columns_.cols())),
        bounds_(all_.size()) {
    std::iota(all_.begin(), all_.end(), Eigen::Index{0});
  }
  Shape(const Shape&) = delete;
  Shape& operator=(const Shape&) = delete;

  Eigen::VectorXd coefficients(const Eigen::VectorXd& target) const {
    return regression_.fit(regression_.target(target), all_, bounds_).coefficients;
  }
  /// A function from other rows is tried unchanged, too.
  void carry(const Eigen::VectorXd& coefficients) { carried_ = columns_ * coefficients; }

  /// Predicted share of the square of `target`.
  double gain(const Eigen::VectorXd& target) const {
    return std::max(own_gain(target), carried_gain(target));
  }
  /// Where it is large.
  Where where(const Eigen::VectorXd& target) const {
    const Eigen::VectorXd shape =
        carried_gain(target) > own_gain(target) ? carried_ : columns_ * coefficients(target);
    const double most = shape.cwiseAbs().maxCoeff();
    Where result{.coordinate = coordinate_, .from = x_.maxCoeff(), .to = x_.minCoeff()};
    for (Eigen::Index i = 0; i < x_.size(); ++i) {
      if (std::abs(shape[i]) < 0.5 * most) continue;
      result.from = std::min(result.from, x_[i]);
      result.to = std::max(result.to, x_[i]);
    }
    return result;
  }

 private:
  double own_gain(const Eigen::VectorXd& target) const {
    return 1 - regression_.held_out(regression_.target(target), all_, bounds_) / target.squaredNorm();
  }
  double carried_gain(const Eigen::VectorXd& target) const {
    return carried_.size() == 0 ? -1 : 1 - (target - carried_).squaredNorm() / target.squaredNorm();
  }

  const char* coordinate_;
  Eigen::VectorXd x_;
  Eigen::MatrixXd columns_;
  BlockRegression regression_;
  std::vector<Eigen::Index> all_;
  std::vector<Bounds> bounds_;
  Eigen::VectorXd carried_;
};

/// A kind of structure in a residual: how much it predicts, and where.
struct Question {
  std::function<double(const Eigen::VectorXd& target)> gain;
  std::function<Where(const Eigen::VectorXd& target)> where;
};

Question shape_question(const std::shared_ptr<const Shape>& shape) {
  return {[shape](const Eigen::VectorXd& target) { return shape->gain(target); },
          [shape](const Eigen::VectorXd& target) { return shape->where(target); }};
}

/// A cycle in time at the dominant frequency of the target, or at `carried_Hz` from other rows.
Question cycle_question(const Rows& rows, const Part& part, double carried_Hz) {
  const auto best_Hz = [&rows, &part, carried_Hz](const Eigen::VectorXd& target) {
    const double own_Hz = cycle_Hz(target, rows, part.training.rows);
    const auto gain = [&](double frequency_Hz) {
      return cycle_gain(frequency_Hz, rows, part.training, target);
    };
    return carried_Hz > 0 && gain(carried_Hz) > gain(own_Hz) ? carried_Hz : own_Hz;
  };
  return {[&rows, &part, best_Hz](const Eigen::VectorXd& target) {
            return cycle_gain(best_Hz(target), rows, part.training, target);
          },
          [best_Hz](const Eigen::VectorXd& target) {
            const double frequency_Hz = best_Hz(target);
            return Where{.coordinate = "frequency_Hz", .from = frequency_Hz, .to = frequency_Hz};
          }};
}

/// Those that predict more of the residual than of any chance data, largest first.
std::vector<Unexplained> answered(const std::vector<Question>& questions, const Eigen::VectorXd& residual,
                                  const Options& options) {
  std::vector<Unexplained> found;
  for (const Question& question : questions) {
    const double own = question.gain(residual);
    if (own < kMinStructureShare) continue;
    ChanceData chance(residual, options.seed + 1);
    bool by_chance = false;
    for (int i = 0; i < options.repetitions && !by_chance; ++i)
      by_chance = question.gain(chance.draw()) >= own;
    if (!by_chance) found.push_back({.where = question.where(residual), .share = own});
  }
  std::ranges::sort(found, std::greater{}, &Unexplained::share);
  return found;
}

}  // namespace

std::vector<bool> bursts(const FittedModel& fitted, const Rows& rows) {
  const Dictionary dictionary = make_dictionary(fitted, rows);
  const auto parameters = free_parameters(fitted, rows);
  Eigen::MatrixXd all(rows.count(), dictionary.columns.cols() + static_cast<Eigen::Index>(parameters.size()));
  all << dictionary.columns, prediction_jacobian(fitted, rows, parameters);
  Eigen::MatrixXd gram = all.transpose() * all;
  const Eigen::VectorXd unit = gram.diagonal().cwiseSqrt().cwiseMax(1e-300).cwiseInverse();
  gram = unit.asDiagonal() * gram * unit.asDiagonal();
  gram.diagonal().array() += 1e-4;
  const Eigen::VectorXd residual = rows.torque_Nm() - predicted_rows(fitted, rows);
  const Eigen::VectorXd left =
      residual - all * unit.cwiseProduct(gram.ldlt().solve(unit.cwiseProduct(all.transpose() * residual)));

  const Eigen::VectorXd since = rows.means([](const Signals& s) { return s.since_reversal_s; });
  std::vector<bool> marked(static_cast<std::size_t>(rows.count()), false);
  const double row_s = 0.5 / rows.signals().front().band_Hz;
  const auto window = std::max<Eigen::Index>(3, std::llround(kBurstWindow_s / row_s));
  if (rows.count() < 4 * window) return marked;
  std::vector<double> energies;
  for (Eigen::Index at = 0; at + window <= rows.count(); at += window)
    energies.push_back(left.segment(at, window).squaredNorm());
  std::vector<double> sorted = energies;
  std::ranges::sort(sorted);
  const double usual = sorted[sorted.size() / 2];
  for (std::size_t w = 0; w < energies.size(); ++w) {
    const Eigen::Index at = static_cast<Eigen::Index>(w) * window;
    if (energies[w] < kBurst * usual || since.segment(at, window).minCoeff() < kBurstWindow_s) continue;
    const Eigen::Index from = std::max<Eigen::Index>(0, at - window);
    const Eigen::Index to = std::min(rows.count(), at + 2 * window);
    for (Eigen::Index i = from; i < to; ++i)
      if (rows.recording(i) == rows.recording(at)) marked[static_cast<std::size_t>(i)] = true;
  }
  return marked;
}

Structure structure(const FittedModel& fitted, const Rows& rows, const Training& training,
                    const std::vector<Eigen::Index>& held_out, const Options& options) {
  const Eigen::VectorXd residual = rows.torque_Nm() - predicted_rows(fitted, rows);
  const Part searched(training, residual);
  const Part judged(in_blocks(held_out), residual);
  const Eigen::VectorXd velocity = rows.means([](const Signals& s) { return s.velocity_rad_per_s; });
  std::vector<Question> of_searched;
  std::vector<Question> of_held_out;
  std::vector<Eigen::Index> both = training.rows;
  both.insert(both.end(), held_out.begin(), held_out.end());
  for (const Coordinate& coordinate : coordinates()) {
    const Eigen::VectorXd x = rows.means(coordinate.value)(both);
    Eigen::MatrixXd columns = hats(x, coordinate.nodes);
    if (coordinate.by_direction) columns = velocity(both).cwiseSign().asDiagonal() * columns;
    const Eigen::Index first = searched.residual.size();
    const Eigen::Index last = judged.residual.size();
    const auto own =
        std::make_shared<Shape>(coordinate.name, x.head(first), columns.topRows(first), searched);
    const auto other =
        std::make_shared<Shape>(coordinate.name, x.tail(last), columns.bottomRows(last), judged);
    other->carry(own->coefficients(searched.residual));
    of_searched.push_back(shape_question(own));
    of_held_out.push_back(shape_question(other));
  }
  const double carried_Hz = cycle_Hz(searched.residual, rows, training.rows);
  of_searched.push_back(cycle_question(rows, searched, 0));
  of_held_out.push_back(cycle_question(rows, judged, carried_Hz));
  return {.held_out = answered(of_held_out, judged.residual, options),
          .searched = answered(of_searched, searched.residual, options)};
}

}  // namespace identification::gap
