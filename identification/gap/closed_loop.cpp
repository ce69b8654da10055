#include "identification/gap/closed_loop.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>
#include <numeric>
#include <stdexcept>
#include <utility>

#include "identification/gap/parallel.h"
#include "model/effects/effect_chain.h"
#include "model/servo_law_keys.h"
#include "sim/model_drive.h"

namespace identification::gap {
namespace {

/// The servo's loop runs faster than it is recorded.
constexpr double kServoStep_s = 1e-3;
constexpr double kNoGoal = std::numeric_limits<double>::quiet_NaN();
constexpr double kStretch_s = 1;
/// Of the least squares, in scales of the parameters.
constexpr double kSlopeStep = 0.01;
constexpr double kMaxServoStep = 0.3;
constexpr int kMaxServoRounds = 12;
constexpr int kMaxServoAttempts = 5;
/// Relative change of the sum of squares that ends it.
constexpr double kSettled = 1e-3;
constexpr std::string_view kPrefix = "servo.";

bool has_torque(const Source& source) {
  return source.recording.has("torque_measured_Nm") || source.recording.has("torque_command_Nm");
}
bool has_goal(const Source& source) {
  return source.recording.has("position_command_rad") || source.recording.has("velocity_command_rad_per_s");
}

std::vector<double> column_or(const Recording& recording, const char* name, double otherwise) {
  if (!recording.has(name)) return std::vector<double>(recording.rows(), otherwise);
  const auto values = recording.column(name);
  return {values.begin(), values.end()};
}

/// Between the neighbouring rows.
std::vector<double> rate_of(const std::vector<double>& values, const std::vector<double>& time_s) {
  std::vector<double> rate(values.size());
  for (std::size_t i = 0; i < values.size() && values.size() > 1; ++i) {
    const std::size_t from = i > 0 ? i - 1 : 0;
    const std::size_t to = std::min(i + 1, values.size() - 1);
    rate[i] = (values[to] - values[from]) / (time_s[to] - time_s[from]);
  }
  return rate;
}

}  // namespace

model::ServoLaw law_of(const Source& source, const model::ServoLaw& law) {
  model::ServoLaw own = law;
  for (const auto& [key, text] : source.recording.comments) {
    if (!key.starts_with(kPrefix)) continue;
    const std::string name = key.substr(kPrefix.size());
    double value = kNoGoal;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    const auto known = std::ranges::find(model::kServoKeys, name, &model::ServoKey::name);
    if (known == model::kServoKeys.end())
      throw std::invalid_argument(source.name + ": comment " + key + ": the servo has " +
                                  model::servo_keys());
    if (error != std::errc() || end != text.data() + text.size() ||
        !(value >= known->lower && value <= known->upper))
      throw std::invalid_argument(source.name + ": comment " + key + " is '" + text +
                                  "', which is not a number within its bounds");
    own.*(known->member) = value;
  }
  return own;
}

std::vector<ServoRun> servo_runs(const std::vector<Source>& sources, const model::ServoLaw& law) {
  std::vector<ServoRun> runs;
  for (const Source& source : sources) {
    if (!has_goal(source) || !source.recording.has("position_rad") || source.recording.rows() < 2) continue;
    const Recording& recording = source.recording;
    ServoRun run{.name = source.name,
                 .law = law_of(source, law),
                 .time_s = column_or(recording, "time_s", 0),
                 .goal_rad = column_or(recording, "position_command_rad", kNoGoal),
                 .goal_rad_per_s = column_or(recording, "velocity_command_rad_per_s", kNoGoal),
                 .position_rad = column_or(recording, "position_rad", 0),
                 .velocity_rad_per_s = {},
                 .enabled = column_or(recording, "servo_enabled", 1)};
    run.velocity_rad_per_s = rate_of(run.position_rad, run.time_s);
    const auto finite = [](double value) { return std::isfinite(value); };
    if (!std::ranges::all_of(run.time_s, finite) || !std::ranges::all_of(run.position_rad, finite)) continue;
    runs.push_back(std::move(run));
  }
  return runs;
}

std::size_t add_servo_torques(std::vector<Source>& sources, const model::ServoLaw& law) {
  std::size_t added = 0;
  for (Source& source : sources) {
    if (has_torque(source)) continue;
    if (!has_goal(source))
      throw std::invalid_argument(source.name +
                                  ": has no torque, and no set-point from which the model's servo could give "
                                  "one; it needs torque_measured_Nm, torque_command_Nm, position_command_rad "
                                  "or velocity_command_rad_per_s");
    const std::vector<Source> one{source};
    const std::vector<ServoRun> runs = servo_runs(one, law);
    if (runs.empty()) continue;  // what it lacks is reported where all recordings are checked
    const ServoRun& run = runs.front();
    model::Servo servo(run.law);
    std::vector<double> torque(run.time_s.size());
    for (std::size_t i = 0; i < torque.size(); ++i) {
      const double step_s = i > 0 ? run.time_s[i] - run.time_s[i - 1] : 0;
      if (run.enabled[i] == 0) servo.reset();
      torque[i] = run.enabled[i] == 0
                      ? 0
                      : servo.torque_Nm({run.goal_rad[i], run.goal_rad_per_s[i]}, run.position_rad[i],
                                        run.velocity_rad_per_s[i], step_s);
    }
    source.recording.columns.push_back({"torque_measured_Nm", std::move(torque)});
    ++added;
  }
  return added;
}

std::vector<double> closed_loop_position_rad(const model::effects::DriveModel& model, const ServoRun& run) {
  const double period_s =
      (run.time_s.back() - run.time_s.front()) / static_cast<double>(run.time_s.size() - 1);
  const int steps = std::max(1, static_cast<int>(std::ceil(period_s / kServoStep_s)));
  const double step_s = period_s / steps;
  sim::ModelDrive drive(model, step_s);
  // The recording has what the encoder reports.
  const model::effects::EffectChain::Motion motion =
      model::effects::EffectChain(model.effects)
          .motion_behind({run.position_rad.front(), run.velocity_rad_per_s.front(), 0});
  drive.set_position(motion.position_rad);
  drive.set_velocity(motion.velocity_rad_per_s);
  model::Servo servo(run.law);
  std::vector<double> position;
  double now_s = run.time_s.front();
  for (std::size_t i = 0; i < run.time_s.size(); ++i) {
    position.push_back(drive.position_rad());
    if (i + 1 == run.time_s.size()) break;
    // Steps are of one length, so that delays keep theirs; rows come at their own times.
    for (; now_s < run.time_s[i + 1] - 0.5 * step_s; now_s += step_s) {
      if (run.enabled[i] == 0) servo.reset();
      drive.step(run.enabled[i] == 0
                     ? 0
                     : servo.torque_Nm({run.goal_rad[i], run.goal_rad_per_s[i]}, drive.position_rad(),
                                       drive.velocity_rad_per_s(), step_s));
    }
  }
  return position;
}

std::vector<double> closed_loop_squares(const model::effects::DriveModel& model, const ServoRun& run) {
  const std::vector<double> position = closed_loop_position_rad(model, run);
  const auto stretches = static_cast<std::size_t>(
      std::max(1.0, std::round((run.time_s.back() - run.time_s.front()) / kStretch_s)));
  std::vector<double> squares(stretches, 0);
  for (std::size_t i = 0; i < position.size(); ++i)
    squares[i * stretches / position.size()] += std::pow(position[i] - run.position_rad[i], 2);
  for (double& square : squares)
    square *= static_cast<double>(stretches) / static_cast<double>(position.size());
  for (double& square : squares)
    if (!std::isfinite(square)) square = std::numeric_limits<double>::infinity();
  return squares;
}

FittedModel refined_in_closed_loop(const FittedModel& fitted, const Rows& rows,
                                   const std::vector<ServoRun>& runs) {
  std::vector<Eigen::Index> first{0};
  for (const ServoRun& run : runs)
    first.push_back(first.back() + static_cast<Eigen::Index>(run.time_s.size()));
  const auto errors = [&](const FittedModel& trial) {
    Eigen::VectorXd all(first.back());
    for (std::size_t k = 0; k < runs.size(); ++k) {
      const std::vector<double> position = closed_loop_position_rad(trial.model, runs[k]);
      for (std::size_t i = 0; i < position.size(); ++i)
        all[first[k] + static_cast<Eigen::Index>(i)] = runs[k].position_rad[i] - position[i];
    }
    return all;
  };
  FittedModel current = fitted;
  Eigen::VectorXd left = errors(current);
  double damping = 1e-3;
  for (int round = 0; round < kMaxServoRounds && left.allFinite(); ++round) {
    std::vector<FreeParameter> parameters = free_parameters(current, rows);
    std::erase_if(parameters, [](const FreeParameter& p) {
      return p.kind != FreeParameter::Kind::kEffect && p.kind != FreeParameter::Kind::kInertia;
    });
    Eigen::MatrixXd jacobian(left.size(), static_cast<Eigen::Index>(parameters.size()));
    in_parallel(parameters.size(), [&](std::size_t k) {
      const FreeParameter& p = parameters[k];
      const double up = std::min(p.value + kSlopeStep * p.scale, p.upper);
      const double down = std::max(p.value - kSlopeStep * p.scale, p.lower);
      const Eigen::VectorXd change =
          errors(with_value(current, p, down)) - errors(with_value(current, p, up));
      jacobian.col(static_cast<Eigen::Index>(k)) = up > down && change.allFinite()
                                                       ? Eigen::VectorXd(change * (p.scale / (up - down)))
                                                       : Eigen::VectorXd::Zero(change.size());
    });
    const Eigen::MatrixXd gram = jacobian.transpose() * jacobian;
    const Eigen::VectorXd product = jacobian.transpose() * left;
    const double before = left.squaredNorm();
    bool improved = false;
    for (int attempt = 0; attempt < kMaxServoAttempts && !improved; ++attempt) {
      Eigen::MatrixXd damped = gram;
      // In units of each parameter's scale, also for those that this motion does not show.
      damped.diagonal().array() += damping * gram.diagonal().mean();
      const Eigen::VectorXd step =
          damped.ldlt().solve(product).cwiseMax(-kMaxServoStep).cwiseMin(kMaxServoStep);
      FittedModel moved = current;
      for (std::size_t k = 0; k < parameters.size(); ++k)
        moved = with_value(moved, parameters[k],
                           parameters[k].value + parameters[k].scale * step[static_cast<Eigen::Index>(k)]);
      const Eigen::VectorXd trial = errors(moved);
      if (trial.allFinite() && trial.squaredNorm() < before) {
        current = std::move(moved);
        left = trial;
        improved = true;
        damping = std::max(0.2 * damping, 1e-6);
      } else {
        damping *= 8;
      }
    }
    if (!improved || before - left.squaredNorm() < kSettled * before) break;
  }
  return current;
}

ClosedLoopError closed_loop_error(const model::effects::DriveModel& model, const ServoRun& run) {
  const std::vector<double> position = closed_loop_position_rad(model, run);
  ClosedLoopError error{.recording = run.name};
  for (std::size_t i = 0; i < position.size(); ++i) {
    const double off = std::abs(position[i] - run.position_rad[i]);
    error.mean_rad += off / static_cast<double>(position.size());
    error.rms_rad += off * off / static_cast<double>(position.size());
  }
  error.rms_rad = std::sqrt(error.rms_rad);
  return error;
}

}  // namespace identification::gap
