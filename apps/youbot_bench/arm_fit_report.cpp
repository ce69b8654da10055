#include "apps/youbot_bench/arm_fit_report.h"

#include <spdlog/fmt/fmt.h>

#include <nlohmann/json.hpp>

#include "runtime/program/build_info.h"
#include "runtime/program/wording.h"

namespace youbot_bench {
namespace {

using identification::robot_gap::ExcitationPlan;
using identification::robot_gap::FittedNumber;
using identification::robot_gap::ResidualOfJoint;
using identification::robot_gap::Residuals;
using ArmJson = nlohmann::ordered_json;

constexpr double kPlotStep_s = 0.05;

ArmJson numbers_json(const std::vector<FittedNumber>& numbers) {
  ArmJson list = ArmJson::array();
  for (const FittedNumber& one : numbers)
    list.push_back({{"name", one.name},
                    {"given", one.given},
                    {"value", one.value},
                    {"ci95", {one.value - one.half_interval, one.value + one.half_interval}}});
  return list;
}

ArmJson residuals_json(const Residuals& residuals) {
  ArmJson joints = ArmJson::array();
  for (const ResidualOfJoint& joint : residuals.joints)
    joints.push_back({{"joint", joint.joint},
                      {"before_Nm", joint.given},
                      {"after_Nm", joint.fitted},
                      {"noise_floor_Nm", joint.noise_floor}});
  return {{"before_Nm", residuals.given_Nm}, {"after_Nm", residuals.fitted_Nm}, {"joints", joints}};
}

std::string residual_rows(const Residuals& residuals) {
  std::string text;
  for (const ResidualOfJoint& joint : residuals.joints)
    text += fmt::format("  {:<14} {:>9.4f} -> {:>7.4f}, noise floor {:.4f} N·m\n", joint.joint, joint.given,
                        joint.fitted, joint.noise_floor);
  return text;
}

std::vector<report::Row> number_rows(const std::vector<FittedNumber>& numbers) {
  std::vector<report::Row> rows;
  for (const FittedNumber& one : numbers) rows.push_back({one.name, one.given, one.value, one.half_interval});
  return rows;
}

report::Plot motion_plot(const identification::experiments::FourierMotion& motion, std::size_t number) {
  report::Plot plot{.title = fmt::format("Motion {}", number),
                    .x = {.label = "time", .unit = "s", .link = "time"},
                    .y = {"angle", "rad"},
                    .series = {}};
  for (Eigen::Index j = 0; j < motion.joints(); ++j) {
    report::Series series{.name = fmt::format("arm-{}", j + 1), .x = {}, .y = {}};
    for (double t = 0; t <= motion.duration_s; t += kPlotStep_s) {
      series.x.push_back(t);
      series.y.push_back(motion.at(j, t).position_rad);
    }
    plot.series.push_back(std::move(series));
  }
  return plot;
}

std::string rivals_text(const RivalGaps& rivals) {
  const bool first = rivals.model_Nm < rivals.against_Nm;
  return fmt::format("rivals: {} leaves {:.4g} N·m, {} leaves {:.4g} N·m: {} predicts these motions better",
                     rivals.model, rivals.model_Nm, rivals.against, rivals.against_Nm,
                     first ? rivals.model : rivals.against);
}

std::string gap_text(const ArmFindings& findings) {
  const Residuals& held_out = findings.fit.held_out;
  return fmt::format("{:.4g} -> {:.4g} N·m", held_out.given_Nm, held_out.fitted_Nm);
}

}  // namespace

std::string arm_plan_text(const ExcitationPlan& plan, double seconds) {
  std::string text =
      fmt::format("{} planned in {:.1f} s",
                  runtime::count_text(static_cast<long long>(plan.motions.size()), "motion"), seconds);
  text += fmt::format("; {} tries were beyond a limit\n", plan.refused);
  for (std::size_t m = 0; m < plan.motions.size(); ++m) {
    const identification::experiments::FourierMotion& motion = plan.motions[m];
    text += fmt::format("  motion {}: {:.0f} s around", m + 1, motion.duration_s);
    for (const double centre_rad : motion.centre_rad) text += fmt::format(" {:.2f}", centre_rad);
    text += fmt::format(" rad, worth {:.4g}\n", plan.worth[m] - (m > 0 ? plan.worth[m - 1] : 0));
  }
  return text;
}

std::string arm_fit_text(const ArmFindings& findings) {
  const identification::robot_gap::ArmFit& fit = findings.fit;
  std::string text = fmt::format("held-out torque residual ({}), up to {:.3g} Hz: {}\n", findings.held_out,
                                 fit.band_Hz, gap_text(findings));
  text += residual_rows(fit.held_out);
  for (const FittedNumber& one : fit.drives)
    text +=
        fmt::format("  {}: {:.4g} -> {:.4g} ± {:.2g}\n", one.name, one.given, one.value, one.half_interval);
  if (findings.rivals) text += rivals_text(*findings.rivals) + "\n";
  return text;
}

std::string arm_fit_json(const ArmFindings& findings) {
  const identification::robot_gap::ArmFit& fit = findings.fit;
  ArmJson json{{"format", "youbot-arm-fit/1"},
               {"software", runtime::build_version()},
               {"robot", findings.robot},
               {"model", findings.model},
               {"seed", findings.seed},
               {"fitted", findings.fitted},
               {"held_out", findings.held_out},
               {"band_Hz", fit.band_Hz},
               {"torque_lag_s", fit.lag_s},
               {"gap", residuals_json(fit.held_out)},
               {"gap_of_fitted", residuals_json(fit.searched)},
               {"drives", numbers_json(fit.drives)},
               {"base_parameters", numbers_json(fit.base)}};
  if (findings.rivals)
    json["rivals"] = {{"model", findings.rivals->model},
                      {"against", findings.rivals->against},
                      {"model_Nm", findings.rivals->model_Nm},
                      {"against_Nm", findings.rivals->against_Nm}};
  return json.dump(2) + "\n";
}

report::Page arm_fit_page(const ArmFindings& findings) {
  const identification::robot_gap::ArmFit& fit = findings.fit;
  report::Page page("Arm identified: torque residual " + gap_text(findings));
  page.text(fmt::format(
      "Computed motions of {}, fitted to {}; {} is held out. The residual is the torque that the model does "
      "not "
      "predict from the measured motion, rms up to {:.3g} Hz while the joint moves. Before: {}.",
      findings.robot, runtime::list_text(findings.fitted), findings.held_out, fit.band_Hz, findings.model));
  if (findings.rivals) page.text(rivals_text(*findings.rivals));
  std::vector<report::Row> residuals;
  for (const ResidualOfJoint& joint : fit.held_out.joints)
    residuals.push_back({joint.joint, joint.given, joint.fitted, joint.noise_floor});
  residuals.push_back({"all", fit.held_out.given_Nm, fit.held_out.fitted_Nm, std::string("–")});
  page.table({{"joint"}, {"before", "N·m"}, {"after", "N·m"}, {"noise floor", "N·m"}}, residuals,
             "Torque residual of the held-out motion");
  const std::vector<report::Column> columns{{"parameter"}, {"given"}, {"fitted"}, {"half 95 % interval"}};
  page.table(columns, number_rows(fit.drives), "Friction and offsets");
  page.table(columns, number_rows(fit.base),
             "Base parameters: the combinations of inertial parameters that act on torques");
  std::vector<report::Plot> plots;
  for (std::size_t m = 0; m < findings.plan.motions.size(); ++m)
    plots.push_back(motion_plot(findings.plan.motions[m], m + 1));
  page.plots(plots);
  return page;
}

std::string arm_fit_model_text(const ArmFindings& findings, const runtime::RobotFile& given,
                               const std::filesystem::path& urdf) {
  runtime::RobotFile robot = given;
  robot.arm = findings.fit.arm;
  const std::vector<std::string> header{
      "written by youbot-bench arm-excitation " + std::string(runtime::build_version()),
      fmt::format("base: {}; seed {}", findings.model, findings.seed),
      "fitted: " + runtime::list_text(findings.fitted) + "; held out: " + findings.held_out,
      "held-out torque residual " + gap_text(findings)};
  return runtime::robot_file_text(robot, urdf, given.arm, header, {});
}

}  // namespace youbot_bench
