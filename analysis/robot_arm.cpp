#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <iterator>
#include <memory>
#include <system_error>
#include <utility>

#include "analysis/model_header.h"
#include "analysis/robot.h"
#include "analysis/robot_tables.h"
#include "identification/robot_gap/arm_motion.h"
#include "identification/robot_gap/arm_subject.h"
#include "identification/robot_gap/body_places.h"

namespace analysis {
namespace {

namespace fs = std::filesystem;
using identification::robot_gap::ArmRecording;
using identification::robot_gap::ArmSubject;
using identification::robot_gap::CutRecording;

/// In a warning.
constexpr std::size_t kListedStretches = 5;

std::string position_quantity(std::size_t joint) { return fmt::format("joint_{}_position_rad", joint + 1); }
std::string torque_quantity(std::size_t joint) { return fmt::format("joint_{}_torque_Nm", joint + 1); }

runtime::ColumnMap arm_columns(const runtime::RobotFile& robot, const std::string& name) {
  runtime::ColumnMap map;
  map.name = name;
  for (std::size_t j = 0; j < robot.arm.drives.size(); ++j) {
    const runtime::RobotFile::Columns& columns = robot.columns;
    map.columns.push_back({position_quantity(j), columns.position[j], columns.position_factor[j]});
    map.columns.push_back({torque_quantity(j), columns.torque[j], columns.torque_factor[j]});
  }
  return map;
}

Eigen::MatrixXd gathered(const identification::Recording& recording, std::size_t joints,
                         std::string (*quantity)(std::size_t)) {
  Eigen::MatrixXd result(static_cast<Eigen::Index>(joints), static_cast<Eigen::Index>(recording.rows()));
  for (std::size_t j = 0; j < joints; ++j) {
    const auto values = recording.column(quantity(j));
    for (std::size_t i = 0; i < values.size(); ++i)
      result(static_cast<Eigen::Index>(j), static_cast<Eigen::Index>(i)) = values[i];
  }
  return result;
}

std::string arm_model_text(const runtime::RobotFile& base, const ArmSubject& subject,
                           const RobotFindings& findings, const fs::path& out) {
  runtime::RobotFile robot = base;
  robot.arm = subject.changed(findings.result.changes);
  std::error_code error;
  fs::path urdf = fs::proximate(base.urdf, out, error);
  if (error) urdf = fs::absolute(base.urdf);
  return runtime::robot_file_text(robot, urdf, base.arm, robot_header(findings), robot_remarks(findings));
}

/// "arm.csv: cut at its pauses into 2 parts; 0 to 0.5 s is left out, shorter than the 2 s that ..."
std::string cut_text(const std::string& name, const CutRecording& cut, double band_Hz) {
  std::string text = fmt::format("{}: cut at its pauses into {} part{}", name, cut.parts.size(),
                                 cut.parts.size() == 1 ? "" : "s");
  if (cut.left_out.empty()) return text;
  const std::size_t listed = std::min(cut.left_out.size(), kListedStretches);
  for (std::size_t i = 0; i < listed; ++i)
    text += fmt::format("{}{:.3f} to {:.3f} s", i == 0 ? "; " : ", ", cut.left_out[i].from_s,
                        cut.left_out[i].to_s);
  if (listed < cut.left_out.size()) text += fmt::format(" and {} more", cut.left_out.size() - listed);
  return text + fmt::format(" {} left out, shorter than the {:.3g} s that a band of {:.3g} Hz needs",
                            cut.left_out.size() == 1 ? "is" : "are",
                            identification::robot_gap::shortest_recording_s(band_Hz), band_Hz);
}

/// Replaces recordings with pauses by their parts.
void cut_at_pauses(ArmRecordings& recordings, double band_Hz) {
  for (const std::vector<ArmRecording>* list : {&recordings.data, &recordings.held_out})
    band_Hz = identification::robot_gap::usable_band_Hz(*list, band_Hz);
  for (std::vector<ArmRecording>* list : {&recordings.data, &recordings.held_out}) {
    std::vector<ArmRecording> parts;
    for (const ArmRecording& whole : *list) {
      CutRecording cut = identification::robot_gap::cut_at_pauses(whole, band_Hz);
      if (cut.parts.size() + cut.left_out.size() > 1)
        recordings.warnings.push_back(cut_text(whole.name, cut, band_Hz));
      std::ranges::move(cut.parts, std::back_inserter(parts));
    }
    *list = std::move(parts);
  }
}

}  // namespace

ArmRecordings read_arm_recordings(const runtime::RobotFile& robot, const RobotGapOptions& options) {
  ArmRecordings result;
  const std::size_t joints = robot.arm.drives.size();
  result.warnings = read_robot_tables(
      options, arm_columns(robot, options.model.string()), robot.columns.time, [&](const RobotTable& table) {
        const auto time_s = table.recording.column("time_s");
        ArmRecording recording{table.name,
                               {time_s.begin(), time_s.end()},
                               gathered(table.recording, joints, &position_quantity),
                               gathered(table.recording, joints, &torque_quantity)};
        (table.is_searched ? result.data_files : result.held_out_files).push_back(table.name);
        (table.is_searched ? result.data : result.held_out).push_back(std::move(recording));
      });
  cut_at_pauses(result, robot.band_Hz);
  return result;
}

OpenedRobot open_arm(const RobotGapOptions& options) {
  runtime::RobotFile base = runtime::read_robot_file(options.model);
  ArmRecordings recordings = read_arm_recordings(base, options);
  OpenedRobot opened;
  opened.findings.data = std::move(recordings.data_files);
  opened.warnings = std::move(recordings.warnings);
  auto subject =
      std::make_unique<ArmSubject>(base.arm, std::move(recordings.data), std::move(recordings.held_out),
                                   identification::robot_gap::ArmOptions{
                                       .band_Hz = base.band_Hz, .ripples_per_rev = base.ripples_per_rev});
  opened.findings.name = base.name;
  opened.findings.channel_word = "joint";
  opened.findings.metric =
      fmt::format("rms torque residual over all joints up to {:.4g} Hz, held-out", subject->band_Hz());
  opened.findings.comparison = fmt::format(
      "The gap is the torque that the model does not predict from the measured motion, rms on held-out "
      "recordings, up to {:.4g} Hz. The noise floor is the scatter of torque and position sensors.",
      subject->band_Hz());
  if (subject->band_Hz() < base.band_Hz)
    opened.warnings.push_back(fmt::format(
        "torques are compared up to {:.3g} Hz, not {:.3g}: the slowest recording has no more samples",
        subject->band_Hz(), base.band_Hz));
  opened.complete = [files = std::move(recordings.held_out_files), given = base.arm,
                     arm = subject.get()](RobotFindings& findings) {
    if (!files.empty()) findings.result.held_out = files;
    std::ranges::move(
        identification::robot_gap::implausible_places(given, arm->changed(findings.result.changes)),
        std::back_inserter(findings.result.notes));
  };
  opened.model_text = [base = std::move(base), arm = subject.get()](const RobotFindings& findings,
                                                                    const fs::path& out) {
    return arm_model_text(base, *arm, findings, out);
  };
  opened.subject = std::move(subject);
  return opened;
}

}  // namespace analysis
