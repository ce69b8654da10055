#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <memory>
#include <utility>

#include "analysis/model_header.h"
#include "analysis/robot.h"
#include "analysis/robot_tables.h"
#include "identification/robot_gap/base_subject.h"
#include "runtime/configuration/base_file.h"

namespace analysis {
namespace {

namespace fs = std::filesystem;
using identification::robot_gap::BaseRecording;
using identification::robot_gap::BaseSubject;
using identification::robot_gap::Part;

std::string wheel_quantity(std::size_t wheel) { return fmt::format("wheel_{}", wheel + 1); }
std::string load_quantity(std::size_t wheel) { return fmt::format("wheel_{}_load", wheel + 1); }
std::string wheel_torque_quantity(std::size_t wheel) { return fmt::format("wheel_{}_torque_Nm", wheel + 1); }

runtime::ColumnMap base_columns(const runtime::BaseFile& robot, const std::string& name) {
  runtime::ColumnMap map;
  map.name = name;
  const runtime::BaseFile::Columns& columns = robot.columns;
  const auto add = [&](std::string quantity, const std::string& column, double factor) {
    if (!column.empty()) map.columns.push_back({std::move(quantity), column, factor});
  };
  add("run", columns.run, 1);
  if (!columns.run.empty()) map.run = "run";
  add("steering_rad", columns.steering, columns.steering_factor);
  for (std::size_t w = 0; w < columns.wheels.size(); ++w) {
    const runtime::BaseFile::Columns::Wheel& wheel = columns.wheels[w];
    add(wheel_quantity(w), wheel.position.empty() ? wheel.speed : wheel.position, wheel.factor);
    add(load_quantity(w), wheel.load, 1);
    add(wheel_torque_quantity(w), wheel.torque, wheel.torque_factor);
  }
  add("x_m", columns.x, columns.position_factor);
  add("y_m", columns.y, columns.mirrored ? -columns.position_factor : columns.position_factor);
  add("heading_rad", columns.heading, columns.heading_factor);
  return map;
}

BaseRecording base_recording(const runtime::BaseFile& robot, const RobotTable& table) {
  const identification::Recording& read = table.recording;
  BaseRecording recording;
  recording.name = table.name;
  recording.floor = robot.floor_of(table.path.stem().string());
  const auto copy = [&](const char* quantity) {
    const auto values = read.column(quantity);
    return std::vector<double>(values.begin(), values.end());
  };
  recording.time_s = copy("time_s");
  if (read.has("run")) recording.run = copy("run");
  if (read.has("steering_rad")) recording.steering_rad = copy("steering_rad");
  const auto rows = static_cast<Eigen::Index>(read.rows());
  const auto wheels = static_cast<Eigen::Index>(robot.base.wheels.size());
  recording.wheel.resize(wheels, rows);
  const bool is_loaded =
      std::ranges::none_of(robot.columns.wheels, [](const auto& wheel) { return wheel.load.empty(); });
  for (std::size_t w = 0; w < robot.base.wheels.size(); ++w) {
    const auto row = static_cast<Eigen::Index>(w);
    recording.is_speed.push_back(robot.columns.wheels[w].position.empty());
    const auto values = read.column(wheel_quantity(w));
    recording.wheel.row(row) = Eigen::Map<const Eigen::RowVectorXd>(values.data(), rows);
    if (!robot.columns.wheels[w].torque.empty()) {
      if (recording.torque_Nm.size() == 0) recording.torque_Nm = Eigen::MatrixXd::Zero(wheels, rows);
      const auto torque_Nm = read.column(wheel_torque_quantity(w));
      recording.torque_Nm.row(row) = Eigen::Map<const Eigen::RowVectorXd>(torque_Nm.data(), rows);
    }
    if (!is_loaded) continue;
    if (recording.load.size() == 0) recording.load = Eigen::MatrixXd::Zero(wheels, rows);
    const auto load = read.column(load_quantity(w));
    recording.load.row(row) = Eigen::Map<const Eigen::RowVectorXd>(load.data(), rows).cwiseAbs();
  }
  const auto x_m = read.column("x_m");
  const auto y_m = read.column("y_m");
  const auto heading_rad = read.column("heading_rad");
  for (std::size_t i = 0; i < read.rows(); ++i) recording.pose.push_back({x_m[i], y_m[i], heading_rad[i]});
  return recording;
}

std::string base_model_text(const runtime::BaseFile& given, const BaseSubject& subject,
                            const RobotFindings& findings) {
  runtime::BaseFile robot = given;
  robot.base = subject.changed(findings.result.changes);
  return runtime::base_file_text(robot, robot_header(findings), robot_remarks(findings));
}

/// Whole runs, by the given model and by the new one.
std::vector<PathGap> paths_of(const BaseSubject& subject,
                              const identification::robot_gap::RobotResult& result) {
  std::vector<PathGap> paths;
  const Eigen::VectorXd none = Eigen::VectorXd::Zero(result.changes.size());
  for (const Part part : {Part::kSearched, Part::kHeldOut}) {
    const auto before = subject.path_errors(part, {none, result.delay_s});
    const auto after = subject.path_errors(part, {result.changes, result.delay_s});
    for (std::size_t i = 0; i < before.size(); ++i)
      paths.push_back({.recording = before[i].recording,
                       .run = before[i].run,
                       .held_out = part == Part::kHeldOut,
                       .length_m = before[i].length_m,
                       .before = {before[i].rms_m, before[i].end_m, before[i].end_heading_rad},
                       .after = {after[i].rms_m, after[i].end_m, after[i].end_heading_rad}});
  }
  return paths;
}

}  // namespace

OpenedRobot open_base(const RobotGapOptions& options) {
  runtime::BaseFile base = runtime::read_base_file(options.model);
  std::vector<BaseRecording> data;
  std::vector<BaseRecording> held_out;
  OpenedRobot opened;
  opened.warnings = read_robot_tables(
      options, base_columns(base, options.model.string()), base.columns.time, [&](const RobotTable& table) {
        (table.is_searched ? data : held_out).push_back(base_recording(base, table));
      });
  for (const BaseRecording& recording : data) opened.findings.data.push_back(recording.name);
  for (std::size_t f = 0; f < base.base.floors.size(); ++f) {
    const auto on = [f](const BaseRecording& one) { return one.floor == static_cast<int>(f); };
    if (std::ranges::none_of(data, on) && std::ranges::none_of(held_out, on))
      opened.warnings.push_back(fmt::format("{}: no recording begins with a name of [[floor]] '{}'",
                                            options.model.string(), base.base.floors[f].name));
  }
  auto subject =
      std::make_unique<BaseSubject>(base.base, std::move(data), std::move(held_out), base.window_s);
  opened.findings.name = base.name;
  opened.findings.channel_word = "component";
  const auto* const efforts = subject->efforts();
  opened.findings.metric = fmt::format(
      "rms residual of the displacement in {:.3g} s, and of the change of heading in {:.3g} s{}, held-out",
      subject->place_window_s(), subject->heading_window_s(),
      efforts == nullptr ? "" : fmt::format(", and of the mean forces in {:.3g} s", efforts->window_s()));
  opened.findings.comparison = fmt::format(
      "The gap is the displacement over windows of {:.3g} s, and the change of heading over windows of "
      "{:.3g} "
      "s, that the model does not predict from the wheels, in the axes of the tracked body, rms on held-out "
      "recordings. The noise floor is the scatter of the "
      "measured poses, the steps of the wheels' encoders, and slip that comes and goes from sample to "
      "sample.",
      subject->place_window_s(), subject->heading_window_s());
  if (efforts != nullptr)
    opened.findings.comparison += fmt::format(
        " Forces are means over windows of {:.3g} s in which every wheel turns: what the torques of the "
        "wheels "
        "push, less what the model needs for the motion of the wheels. Their noise floor is the noise of the "
        "torques and of the wheels' angles or speeds.",
        efforts->window_s());
  opened.complete = [own = subject.get()](RobotFindings& findings) {
    findings.paths = paths_of(*own, findings.result);
    findings.result.delay_s += own->assumed_delay_s();
    findings.result.notes.insert(findings.result.notes.end(), own->notes().begin(), own->notes().end());
  };
  opened.model_text = [base = std::move(base), own = subject.get()](const RobotFindings& findings,
                                                                    const fs::path& /*out*/) {
    return base_model_text(base, *own, findings);
  };
  opened.subject = std::move(subject);
  return opened;
}

}  // namespace analysis
