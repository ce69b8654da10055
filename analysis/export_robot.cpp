#include "analysis/export_robot.h"

#include <spdlog/fmt/fmt.h>

#include <optional>
#include <stdexcept>
#include <utility>

#include "analysis/export_account.h"
#include "analysis/export_arm.h"
#include "analysis/export_arm_parts.h"
#include "analysis/export_files.h"
#include "analysis/export_residual.h"
#include "analysis/robot_tables.h"
#include "analysis/sliding_fit.h"
#include "identification/robot_gap/measured_arm.h"
#include "runtime/configuration/base_file.h"
#include "runtime/configuration/robot_file.h"
#include "runtime/log.h"
#include "runtime/recording/made_paths.h"
#include "runtime/recording/output_directory.h"

namespace analysis {
namespace {

using identification::robot_gap::MeasuredArm;
using runtime::RobotFile;

struct RobotTarget {
  ArmTarget target;
  const char* file;
  const char* name;  // in messages
};
std::vector<RobotTarget> targets_of(ExportFormat format) {
  switch (format) {
    case ExportFormat::kMujoco:
      return {{ArmTarget::kMujoco, "robot.xml", "MuJoCo"},
              {ArmTarget::kPlainMujoco, "robot_plain.xml", "the plain file"}};
    case ExportFormat::kUrdf: return {{ArmTarget::kUrdf, "robot.urdf", "URDF"}};
    case ExportFormat::kResidual: break;
  }
  return {};
}

void refuse_options_of_drives(const ExportOptions& options) {
  const auto refuse = [](const char* option, const char* why) {
    throw std::invalid_argument(fmt::format("{} is for a drive model; {}", option, why));
  };
  if (!options.inputs.joint.empty()) refuse("--joint", "a robot file is about all joints");
  if (!options.inputs.columns.empty()) refuse("--columns", "a robot file names the columns itself");
}

std::optional<MeasuredArm> measured(const RobotFile& robot, const ExportOptions& options) {
  if (options.inputs.data.empty()) return std::nullopt;
  RobotGapOptions read;
  read.model = options.inputs.model;
  read.data = options.inputs.data;
  const ArmRecordings recordings = read_arm_recordings(robot, read);
  for (const std::string& warning : recordings.warnings) spdlog::warn("{}", warning);
  return MeasuredArm(robot.arm, recordings.data, robot.band_Hz);
}

ArmOperation operation_of(const RobotFile& robot, const std::optional<MeasuredArm>& data,
                          double top_rad_per_s) {
  ArmOperation operation;
  if (data) operation.mean_load_Nm = data->mean_load_Nm(robot.arm);
  for (std::size_t j = 0; j < robot.arm.drives.size(); ++j) {
    std::vector<double> speeds;
    if (data) speeds = data->speeds_rad_per_s(static_cast<Eigen::Index>(j));
    operation.speeds_rad_per_s.push_back(speeds_to_fit_rad_per_s(std::move(speeds), top_rad_per_s));
  }
  return operation;
}

std::vector<std::string> account_of(const RobotFile& robot, const RobotTarget& target, const HeldArm& held,
                                    const ArmOperation& operation, const std::optional<MeasuredArm>& data) {
  std::vector<std::string> lines;
  const double whole_Nm = data ? data->gap_Nm(robot.arm) : 0;
  for (const Carriage& one : body_carriages(robot.arm, target.target))
    lines.push_back(account_line(one, std::nullopt));
  for (const ArmCarriage& one : arm_carriages(robot.arm, target.target, operation)) {
    std::optional<Cost> cost;
    if (data && one.carriage.as.empty()) cost = {data->gap_Nm(one.without), whole_Nm};
    lines.push_back(account_line(one.carriage, cost));
  }
  lines.insert(lines.end(), held.changes.begin(), held.changes.end());
  std::optional<Cost> cost;
  if (data) cost = {data->gap_Nm(held.arm), whole_Nm};
  lines.push_back(account_end(target.name, cost));
  return lines;
}

/// Gives the arm the springs and rotors that the file has: they may be other than its gears.
void hold_shafts(HeldArm& held, double timestep_s) {
  const std::vector<double> lightest = lightest_inertias(held.arm);
  for (std::size_t j = 0; j < held.arm.drives.size(); ++j) {
    control::ArmDrive& drive = held.arm.drives[j];
    if (drive.compliance_rad_per_Nm == 0) continue;
    const bool slides = held.arm.arm.links[j].slides;
    const ElasticShaft shaft = elastic_shaft(drive, lightest[j], timestep_s);
    std::string line = fmt::format("{} elasticity: {:.4g} {}", drive.joint, shaft.stiffness_Nm_per_rad,
                                   slides ? "N/m" : "N·m/rad");
    constexpr double kSame = 0.999;
    if (shaft.stiffness_Nm_per_rad * drive.compliance_rad_per_Nm < kSame)
      line += fmt::format(" in place of {:.4g}, which needs a shorter --timestep",
                          1 / drive.compliance_rad_per_Nm);
    line += fmt::format("; damping of our choice: {:.3g} {}", shaft.damping_Nm_s_per_rad,
                        slides ? "N·s/m" : "N·m·s/rad");
    if (drive.rotor_inertia_kg_m2 == 0)
      line += fmt::format(
          "; no rotor_inertia_kg_m2 is given: a rotor of {:.3g} {} is added, which keeps the "
          "simulation stable",
          shaft.rotor_kg_m2, slides ? "kg" : "kg·m²");
    held.changes.push_back(std::move(line));
    drive.compliance_rad_per_Nm = 1 / shaft.stiffness_Nm_per_rad;
    drive.rotor_inertia_kg_m2 = shaft.rotor_kg_m2;
  }
}

ExportedFile file_of(const RobotFile& robot, const RobotTarget& target,
                     const std::optional<MeasuredArm>& data, const ExportOptions& options) {
  const ArmOperation operation = operation_of(robot, data, options.top_speed_rad_per_s);
  HeldArm held = held_by(robot.arm, target.target, operation);
  const ArmNames names{robot.name, robot.base, robot.tip};
  if (target.target != ArmTarget::kUrdf) {
    hold_shafts(held, options.timestep_s);
    if (const std::string base = mujoco_base(held.arm, names); base != names.base)
      held.changes.push_back(
          fmt::format("base: its body is named {}, as MuJoCo has a body {} of its own", base, names.base));
  }
  ExportedFile file{target.file, {}, account_of(robot, target, held, operation, data)};
  if (target.target == ArmTarget::kUrdf) {
    file.text = arm_urdf_text(held.arm, names, export_remarks(options, file.account));
    return file;
  }
  file.text = arm_mujoco_text(held.arm, names, options.timestep_s, export_remarks(options, file.account));
  return file;
}

}  // namespace

void export_robot(const ExportOptions& options) {
  refuse_options_of_drives(options);
  if (runtime::describes_base(options.inputs.model))
    throw std::invalid_argument(fmt::format(
        "{} describes a base: its rollers, slip and tracker have no place in these formats; an arm "
        "can be exported",
        options.inputs.model.string()));
  const RobotFile robot = runtime::read_robot_file(options.inputs.model);
  const std::optional<MeasuredArm> data = measured(robot, options);
  std::vector<std::string> names;
  for (const RobotTarget& target : targets_of(options.format)) names.emplace_back(target.file);
  runtime::require_no_results(options.out, names);
  runtime::MadePaths made(runtime::make_output_directory(options.out));
  if (options.format == ExportFormat::kResidual) {
    runtime::require_empty(options.out);
    names = write_residuals(robot.name, robot.arm, *data, options.out);
    made.keep();
    print_residuals(options, names, data->gap_Nm(robot.arm));
    return;
  }
  std::vector<ExportedFile> files;
  for (const RobotTarget& target : targets_of(options.format))
    files.push_back(file_of(robot, target, data, options));
  for (const ExportedFile& file : files) {
    write_exported(options, file);
    made.keep();
  }
}

}  // namespace analysis
