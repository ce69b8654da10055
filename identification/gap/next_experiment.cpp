#include "identification/gap/next_experiment.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <utility>

#include "identification/gap/confirmation.h"
#include "identification/gap/parallel.h"
#include "identification/gap/regression.h"
#include "sim/model_drive.h"

namespace identification::gap {
namespace {

constexpr double kPeriod_s = 1e-3;
/// Minimum separation of two models, in standard deviations, for an experiment to be worthwhile.
constexpr double kClearly = 5;
/// Relative to the noise, rms: smaller differences are within the error of any model, however often repeated.
constexpr double kVisible = 0.2;
constexpr double kLongest_s = 600;
/// Relative to its set-point, briefly.
constexpr double kOvershoot = 1.2;
/// A stretch at rest.
constexpr double kRest_s = 0.5;

/// Factor by which data in motion leave the stiffness at rest undetermined.
constexpr double kOpen = 2;

/// PI control of the speed, as fast as a drive's own with a wheel on it.
class SpeedLoop {
 public:
  SpeedLoop(double inertia_kg_m2, double limit_Nm)
      : proportional_(25 * inertia_kg_m2), integral_(5 * proportional_), limit_Nm_(limit_Nm) {}
  double torque_Nm(double error_rad_per_s) {
    sum_Nm_ = std::clamp(sum_Nm_ + integral_ * error_rad_per_s * kPeriod_s, -limit_Nm_, limit_Nm_);
    return std::clamp(proportional_ * error_rad_per_s + sum_Nm_, -limit_Nm_, limit_Nm_);
  }

 private:
  double proportional_;
  double integral_;
  double limit_Nm_;
  double sum_Nm_ = 0;
};

/// A rival with the information of the available data on its parameters.
struct Contender {
  FittedModel truth;
  FittedModel model;
  std::vector<FreeParameter> free;
  std::vector<Bounds> bounds;  ///< of a step
  Eigen::MatrixXd known;       ///< J₀ᵀ·J₀
};

/// Positions of another drive under the same torque.
std::vector<double> positions_under(const model::effects::DriveModel& model, double start_rad,
                                    std::span<const double> command) {
  sim::ModelDrive drive(model, kPeriod_s);
  drive.set_position(start_rad);
  std::vector<double> position;
  position.reserve(command.size());
  for (const double torque : command) {
    position.push_back(drive.position_rad());
    drive.step(torque);
  }
  return position;
}

/// An experiment, prepared for the comparison.
class Trial {
 public:
  Trial(const Source& experiment, const AtHand& at_hand)
      : command_(experiment.recording.column("torque_command_Nm")),
        at_hand_(at_hand),
        signals_{make_signals(experiment, at_hand.band)},
        rows_(signals_),
        length_(static_cast<std::size_t>(kRest_s / kPeriod_s)),
        start_rad_(experiment.recording.column("position_rad").front()) {
    const auto position = experiment.recording.column("position_rad");
    for (std::size_t first = 0; first + length_ <= position.size(); first += length_)
      if (rests(position.subspan(first, length_))) rests_.push_back(first);
  }

  double separation(const Contender& rival) const { return std::sqrt(in_motion(rival) + at_rest(rival)); }

 private:
  double in_motion(const Contender& rival) const {
    if (rows_.count() == 0) return 0;
    const Eigen::MatrixXd jacobian = prediction_jacobian(rival.model, rows_, rival.free);
    const Eigen::MatrixXd gram = jacobian.transpose() * jacobian + rival.known;
    const Eigen::VectorXd difference =
        predicted_rows(rival.truth, rows_) - predicted_rows(rival.model, rows_);
    const Eigen::VectorXd product = jacobian.transpose() * difference;
    const Eigen::VectorXd step = bounded_solution(gram, product, rival.bounds);
    const double square = difference.squaredNorm() - 2 * step.dot(product) + step.dot(gram * step);
    const double noise_square = at_hand_.noise_Nm * at_hand_.noise_Nm;
    const double least_square = kVisible * kVisible * noise_square * static_cast<double>(rows_.count());
    return square > least_square ? square / noise_square : 0;
  }
  double at_rest(const Contender& rival) const {
    const double step = at_hand_.band.resolution_rad;
    if (rests_.empty() || !(step > 0)) return 0;
    const std::vector<double> one = positions_under(rival.truth.model, start_rad_, command_);
    const std::vector<double> other = positions_under(rival.model.model, start_rad_, command_);
    const auto row = std::max<std::size_t>(1, static_cast<std::size_t>(at_hand_.rows.length_s() / kPeriod_s));
    double square = 0;
    double product = 0;
    double other_square = 0;
    for (const std::size_t first : rests_) {
      if (!rests(std::span(one).subspan(first, length_)) || !rests(std::span(other).subspan(first, length_)))
        continue;
      for (std::size_t i = first; i < first + length_; i += row) {
        const double a = one[i] - one[first];
        const double b = other[i] - other[first];
        square += a * a;
        product += a * b;
        other_square += b * b;
      }
    }
    // The rival's stiffness adapts, if it has one and the available data leave it undetermined.
    const bool soft = std::ranges::any_of(
        rival.model.model.effects, [](const auto& effect) { return gives(model::effects::name_of(effect)); });
    const double scale =
        soft && other_square > 0 ? std::clamp(product / other_square, 1 / kOpen, kOpen) : 1.0;
    square += scale * (scale * other_square - 2 * product);
    return std::max(0.0, square) / (step * step);
  }
  bool rests(std::span<const double> angles) const {
    const auto [low, high] = std::ranges::minmax(angles);
    return high - low < at_hand_.band.slowest_rad_per_s * kRest_s;
  }

  std::span<const double> command_;
  const AtHand& at_hand_;
  std::vector<Signals> signals_;
  Rows rows_;
  std::size_t length_;
  double start_rad_;
  std::vector<std::size_t> rests_;  // the first sample of each
};

std::vector<Contender> contenders(const std::vector<Pair>& question, const AtHand& at_hand) {
  std::vector<Contender> result;
  for (const Pair& pair : question) {
    Contender contender{pair.truth, pair.rival, free_parameters(pair.rival, at_hand.rows), {}, {}};
    const Eigen::MatrixXd jacobian =
        prediction_jacobian(pair.rival, at_hand.rows, contender.free)(at_hand.use, Eigen::all);
    contender.known = jacobian.transpose() * jacobian;
    for (const FreeParameter& p : contender.free)  // a parameter outside its range may return
      contender.bounds.push_back({std::min(0.0, p.lower - p.value), std::max(0.0, p.upper - p.value)});
    result.push_back(std::move(contender));
  }
  return result;
}

}  // namespace

DriveLimits limits_of(std::span<const Signals> signals) {
  DriveLimits limits;
  double lowest_rad = std::numeric_limits<double>::infinity();
  double highest_rad = -lowest_rad;
  for (const Signals& s : signals) {
    for (const double torque : s.raw_torque_Nm)
      limits.torque_Nm = std::max(limits.torque_Nm, std::abs(torque));
    for (const double velocity : s.velocity_rad_per_s)
      limits.speed_rad_per_s = std::max(limits.speed_rad_per_s, std::abs(velocity));
    const auto [low, high] = std::ranges::minmax(s.position_rad);
    limits.travel_rad = std::max(limits.travel_rad, high - low);
    lowest_rad = std::min(lowest_rad, low);
    highest_rad = std::max(highest_rad, high);
  }
  if (limits.travel_rad > kEndlessTravel_rad)
    limits.travel_rad = std::numeric_limits<double>::infinity();
  else if (highest_rad >= lowest_rad)
    limits.middle_rad = 0.5 * (lowest_rad + highest_rad);
  return limits;
}

std::optional<Source> carried_out(const model::effects::DriveModel& model,
                                  experiments::JointExperiment& experiment, const DriveLimits& limits,
                                  const BenchStops& stops) {
  sim::ModelDrive drive(model, kPeriod_s);
  drive.set_position(limits.middle_rad);
  SpeedLoop loop(model.inertia_kg_m2, limits.torque_Nm);
  std::vector<double> time_s;
  std::vector<double> command_Nm;
  std::vector<double> torque_Nm;
  std::vector<double> position_rad;
  double lowest = limits.middle_rad;
  double highest = limits.middle_rad;
  experiments::Reading reading{.position_rad = limits.middle_rad, .command_Nm = 0};
  for (int measurement = 0; measurement < experiment.measurement_count(); ++measurement) {
    reading.time_s = 0;
    const double begin_rad = drive.position_rad();
    experiment.begin(measurement, reading);
    while (!experiment.finished()) {
      const hal::JointCommand command = experiment.step(reading).command;
      const double torque = command.mode == hal::CommandMode::kTorque
                                ? command.target
                                : loop.torque_Nm(command.target - drive.velocity_rad_per_s());
      time_s.push_back(static_cast<double>(time_s.size()) * kPeriod_s);
      command_Nm.push_back(torque);
      position_rad.push_back(drive.position_rad());
      drive.step(torque);
      torque_Nm.push_back(drive.reported_Nm());
      lowest = std::min(lowest, drive.position_rad());
      highest = std::max(highest, drive.position_rad());
      if (std::abs(torque) > limits.torque_Nm || highest - lowest > limits.travel_rad ||
          std::abs(drive.velocity_rad_per_s()) >
              std::min(kOvershoot * limits.speed_rad_per_s, stops.speed_rad_per_s) ||
          std::abs(drive.position_rad() - begin_rad) > stops.travel_rad || time_s.back() > kLongest_s)
        return {};
      reading = {.time_s = reading.time_s + kPeriod_s,
                 .position_rad = drive.position_rad(),
                 .velocity_rad_per_s = drive.velocity_rad_per_s(),
                 .torque_Nm = torque_Nm.back(),
                 .command_Nm = command.mode == hal::CommandMode::kTorque ? torque : experiments::kUnknown};
    }
  }
  Source source;
  source.recording.sample_rate_Hz = 1 / kPeriod_s;
  source.recording.columns = {{"time_s", std::move(time_s)},
                              {"torque_command_Nm", std::move(command_Nm)},
                              {"torque_measured_Nm", std::move(torque_Nm)},
                              {"position_rad", std::move(position_rad)}};
  return source;
}

double separation(const Pair& pair, const Source& experiment, const AtHand& at_hand) {
  return Trial(experiment, at_hand).separation(contenders({pair}, at_hand).front());
}

std::vector<std::optional<NextExperiment>> next_experiments(const model::effects::DriveModel& drive,
                                                            const std::vector<std::vector<Pair>>& questions,
                                                            const AtHand& at_hand,
                                                            const DriveLimits& limits) {
  std::vector<std::optional<NextExperiment>> best(questions.size());
  if (questions.empty()) return best;
  std::vector<std::vector<Contender>> asked;
  for (const std::vector<Pair>& question : questions) asked.push_back(contenders(question, at_hand));
  const std::vector<BenchExperiment> bench = bench_experiments(drive, limits);
  std::vector<std::vector<NextExperiment>> answers(bench.size());  // by experiment, by question
  in_parallel(bench.size(), [&](std::size_t i) {
    std::unique_ptr<experiments::JointExperiment> experiment;
    try {
      experiment = bench[i].make(kPeriod_s);
    } catch (const std::invalid_argument&) {
      return;  // youbot-bench has no options that large or small
    }
    std::optional<Source> source = carried_out(drive, *experiment, limits, bench[i].stops);
    if (!source) return;
    const double duration_s = static_cast<double>(source->recording.rows()) * kPeriod_s;
    // The new recording has the quality of the available ones.
    if (at_hand.rows.signals().front().torque_is_command)
      std::erase_if(source->recording.columns,
                    [](const Recording::Column& column) { return column.name == "torque_measured_Nm"; });
    const Trial trial(*source, at_hand);
    for (const std::vector<Contender>& question : asked) {
      double least = std::numeric_limits<double>::infinity();
      for (const Contender& rival : question) least = std::min(least, trial.separation(rival));
      answers[i].push_back({bench[i].name, bench[i].settings, duration_s, least});
    }
  });
  const auto per_s = [](const NextExperiment& e) { return e.separation / e.duration_s; };
  for (const std::vector<NextExperiment>& answer : answers)
    for (std::size_t q = 0; q < answer.size(); ++q)
      if (answer[q].separation >= kClearly && (!best[q] || per_s(answer[q]) > per_s(*best[q])))
        best[q] = answer[q];
  return best;
}

}  // namespace identification::gap
