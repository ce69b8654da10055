#include "operation/teleop_page.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <vector>

#include "hal/seconds.h"
#include "operation/path_plot.h"
#include "operation/report.h"
#include "operation/run_page.h"
#include "operation/teleop_measures.h"
#include "operation/teleop_measures_page.h"

namespace operation {
namespace {

using control::TeleopPhase;
using report::Style;

/// A joint this close to an end stop is listed.
constexpr double kNearStop_rad = 2 * std::numbers::pi / 180;

double magnitude(const std::array<double, 3>& v) noexcept { return std::hypot(v[0], v[1], v[2]); }

/// The set-point of the end effector has a meaning.
bool has_setpoint(TeleopPhase phase) noexcept {
  return phase == TeleopPhase::kApproaching || phase == TeleopPhase::kStiffening ||
         phase == TeleopPhase::kOperating || phase == TeleopPhase::kLetGo;
}

struct Extent {
  double lowest = TeleopRecord::kNaN;
  double highest = TeleopRecord::kNaN;
  void add(double value) noexcept {
    lowest = std::fmin(lowest, value);
    highest = std::fmax(highest, value);
  }
};

class TeleopReport final : public RunReport<TeleopRecord, TeleopSummary> {
 public:
  TeleopReport(const control::Teleoperation::Config& config, const hal::Robot& robot)
      : config_(config),
        joints_(robot.joints().begin(), robot.joints().end()),
        ranges_(control::RobotModel().ranges()),
        measures_(config),
        common_(std::chrono::nanoseconds(std::llround(1e9 * config.period_s)), limits()) {}

  void add(const TeleopRecord& record) override {
    std::array<double, kChannels> values{};
    values[kHandCommand] = magnitude(record.grip_force_H_N);
    values[kHandHeld] = magnitude(record.held_force_H_N);
    values[kSpring] = magnitude(record.spring_W_N);
    values[kWrench] = std::hypot(record.wrench_W[0], record.wrench_W[1], record.wrench_W[2]);
    values[kContact] = magnitude(record.contact_force_W_N);
    const bool has_point = has_setpoint(record.phase);
    const std::array<double, 3>& at = record.tip_p_WT_m;
    const std::array<double, 3>& wanted = record.setpoint_p_WT_m;
    values[kDistance] =
        has_point ? std::hypot(at[0] - wanted[0], at[1] - wanted[1], at[2] - wanted[2]) : kNaN;
    values[kTank] = record.tank_J;
    values[kPort] = record.port_energy_J;
    values[kWithheld] = record.withheld_N;
    values[kStiffness] = record.stiffness_N_per_m;
    add_joints(record, values);
    measures_.add(record);
    trace_.add(hal::seconds(record.time), values);

    base_.add({record.base_W[0], record.base_W[1], 0});
    tip_.add(Eigen::Vector3d(at.data()));
    setpoint_.add(has_point ? Eigen::Vector3d(wanted.data()) : Eigen::Vector3d::Constant(kNaN));
    touched_[0] = is_at_limit(values[kHandCommand], config_.feedback.force_limit_N);
    touched_[1] = record.withheld_N > 0;
    touched_[2] = record.protecting;
    touched_[3] = record.rate_control;
    common_.add(record.time, control::name(record.phase), record.limited, touched_,
                {record.wake_up, record.step});
  }

  report::Page page(const TeleopSummary& summary) const override {
    report::Page page(fmt::format(
        "Teleoperation of {:.1f} s: up to {:.2f} N on the hand, end effector within {:.0f} mm of its "
        "set-point{}",
        common_.duration_s(), summary.largest_grip_force_N, 1e3 * summary.largest_tip_error_m,
        RunPage::end_in_title(summary)));
    RunPage::add_end(page, summary);
    add_summary(page, summary);
    add_tasks(page, summary);
    add_measures(page, measures_, summary.tasks);
    add_paths(page);
    const std::vector<report::Span> spans = spans_of(summary);
    add_forces(page, spans);
    add_joint_sections(page, spans);
    common_.add_rest(page, summary);
    return page;
  }

 private:
  static constexpr std::size_t kJoints = TeleopRecord::kJoints;
  static constexpr std::size_t kFirstArmJoint = control::Teleoperation::kFirstArmJoint;
  static constexpr double kNaN = TeleopRecord::kNaN;
  /// Channels of the trace.
  enum Channel : std::size_t {
    kHandCommand,
    kHandHeld,
    kSpring,
    kWrench,
    kContact,
    kDistance,
    kTank,
    kPort,
    kWithheld,
    kStiffness,
    kPosition,                                       // arm, share of the range
    kArmMeasured = kPosition + control::kArmJoints,  // share of the limit, as all torques
    kArmCommand = kArmMeasured + control::kArmJoints,
    kWheelMeasured = kArmCommand + control::kArmJoints,
    kWheelCommand = kWheelMeasured + kFirstArmJoint,
    kChannels = kWheelCommand + kFirstArmJoint,
  };

  static constexpr std::size_t kGeneralLimits = 4;

  std::vector<RunPage::Limit> limits() const {
    std::vector<RunPage::Limit> limits{{"force on the hand at its limit"},
                                       {"force withheld from the hand by the energy tank"},
                                       {"arm protected near an end stop or itself"},
                                       {"handle at its boundary: rate control"}};
    for (const hal::JointInfo& joint : joints_) {
      limits.push_back({joint.name + " at its torque limit", /*only_if_touched=*/true});
      limits.push_back({joint.name + " within 2° of an end stop", /*only_if_touched=*/true});
    }
    return limits;
  }

  /// At which the control limits its commands.
  double torque_limit_Nm(std::size_t i) const {
    return i < kFirstArmJoint ? config_.robot.base.torque_limit_Nm
                              : config_.robot.arm_torque_limit_Nm[i - kFirstArmJoint];
  }

  void add_joints(const TeleopRecord& record, std::array<double, kChannels>& values) {
    const bool arm_in_torque =
        record.arm_mode == static_cast<std::uint8_t>(control::TeleopOutput::Arm::kTorque);
    for (std::size_t i = 0; i < std::min(kJoints, joints_.size()); ++i) {
      const bool is_arm = i >= kFirstArmJoint;
      const std::size_t of_group = is_arm ? i - kFirstArmJoint : i;
      const double command_Nm = !is_arm || arm_in_torque ? record.command[i] : kNaN;
      values[(is_arm ? kArmCommand : kWheelCommand) + of_group] = command_Nm / torque_limit_Nm(i);
      values[(is_arm ? kArmMeasured : kWheelMeasured) + of_group] =
          record.torque_measured_Nm[i] / torque_limit_Nm(i);
      torque_Nm_[i].add(std::abs(record.torque_measured_Nm[i]));
      touched_[kGeneralLimits + 2 * i] = is_at_limit(command_Nm, torque_limit_Nm(i));
      if (!is_arm) continue;
      const auto [lower_rad, upper_rad] = ranges_[of_group];
      const double position_rad = record.position_rad[i];
      values[kPosition + of_group] = (position_rad - lower_rad) / (upper_rad - lower_rad);
      position_rad_[of_group].add(position_rad);
      touched_[kGeneralLimits + 2 * i + 1] =
          std::min(position_rad - lower_rad, upper_rad - position_rad) < kNearStop_rad;
    }
  }

  /// Phases, with the operator's tasks in place of the phase in which they do them.
  std::vector<report::Span> spans_of(const TeleopSummary& summary) const {
    std::vector<report::Span> spans = common_.spans(summary);
    const auto operates = [](const report::Span& span) {
      return span.name == control::name(TeleopPhase::kOperating) ||
             span.name == control::name(TeleopPhase::kLetGo);
    };
    const auto first = std::ranges::find_if(spans, operates);
    if (summary.tasks.empty() || first == spans.end()) return spans;
    double begin_s = first->from;
    std::vector<report::Span> tasks;
    for (const TaskReport& task : summary.tasks) {
      const double end_s = begin_s + hal::seconds(task.outcome.duration);
      if (task.outcome.result != sim::TaskResult::kNotBegun) tasks.push_back({task.name, begin_s, end_s});
      begin_s = end_s;
    }
    spans.erase(std::remove_if(first, spans.end(), operates), spans.end());
    spans.insert(spans.end(), tasks.begin(), tasks.end());
    std::ranges::stable_sort(spans, {}, &report::Span::from);
    return spans;
  }

  void add_summary(report::Page& page, const TeleopSummary& summary) const {
    page.heading("Summary");
    page.table(
        {{"what"}, {"value"}, {"meaning"}},
        {summary_row("robot", summary.robot, summary.virtual_time ? "in virtual time" : "in real time"),
         summary_row("haptic device", summary.master, "with which the hand moves the robot"),
         summary_row("force on the hand", fmt::format("{:.2f} N", summary.largest_grip_force_N), "maximum"),
         summary_row("energy given to the hand", fmt::format("{:.1f} mJ", 1e3 * summary.most_energy_given_J),
                     "maximum of the net energy since the start"),
         summary_row("base", fmt::format("{:.2f} m", summary.furthest_base_m),
                     "maximum distance from its start"),
         summary_row("end effector", fmt::format("{:.0f} mm", 1e3 * summary.largest_tip_error_m),
                     "maximum distance from its set-point while the hand moved the robot")});
  }

  void add_tasks(report::Page& page, const TeleopSummary& summary) const {
    if (summary.tasks.empty()) return;
    page.heading("Tasks of the simulated operator");
    std::vector<report::Row> rows;
    for (const TaskReport& task : summary.tasks)
      rows.push_back({task.name, std::string(result_text(task.outcome.result)),
                      hal::seconds(task.outcome.duration), task.outcome.largest_force_N,
                      1e3 * task.outcome.mean_path_error_m, 1e3 * task.outcome.largest_path_error_m});
    page.table({{"task"},
                {"result"},
                {"duration", "s", 1},
                {"felt, maximum", "N", 2},
                {"off the path, mean", "mm", 1},
                {"off the path, maximum", "mm", 1}},
               rows, "A dash: the task has no path");
  }

  void add_paths(report::Page& page) const {
    page.heading("Path");
    const auto paths = [this](Eigen::Index up) {
      return std::vector<report::Series>{base_.series("base", up, Style::kLine),
                                         tip_.series("end effector", up, Style::kLine),
                                         setpoint_.series("its set-point", up, Style::kDashed)};
    };
    report::Plot above = path_plot("From above", 1, paths(1));
    above.note = "In the frame of the start: x forward, y to the left.";
    add_base_limits(above, config_.workspace);
    add_end_effector_limits(above, 1, config_.workspace);
    report::Plot side = path_plot("From the right side", 2, paths(2));
    side.note = "x forward, z up.";
    add_end_effector_limits(side, 2, config_.workspace);
    page.plots({std::move(above), std::move(side)});
  }

  void add_forces(report::Page& page, const std::vector<report::Span>& spans) const {
    page.heading("Forces and energy");
    std::vector<report::Series> robot{trace_.series("spring to the set-point", kSpring, 3),
                                      trace_.series("commanded", kWrench, 3)};
    if (report::Series contact = trace_.series("contact, true", kContact, 3);
        std::ranges::any_of(contact.y, [](double y) { return std::isfinite(y); }))
      robot.push_back(std::move(contact));
    page.plots(
        {over_time("Force on the hand", {"force", "N"},
                   {trace_.series("felt", kHandHeld, 3),
                    trace_.series("commanded", kHandCommand, 3, 1, Style::kDashed)},
                   spans,
                   fmt::format("Magnitudes; felt is what the device held. Limited to {:g} N.",
                               config_.feedback.force_limit_N)),
         over_time(
             "Force on the end effector", {"force", "N"}, std::move(robot), spans,
             fmt::format("Magnitudes; commanded is limited to {:g} N.", config_.robot.spring.force_limit_N)),
         over_time(
             "Distance of the end effector from its set-point", {"distance", "mm"},
             {trace_.series("distance", kDistance, 2, 1e3)}, spans,
             fmt::format("More than {:g} mm stops the robot.", 1e3 * config_.setpoint_distance_limit_m)),
         over_time("Stiffness of the coupling", {"stiffness", "N/m"},
                   {trace_.series("stiffness", kStiffness, 1)}, spans),
         over_time(
             "Energy", {"energy", "mJ"},
             {trace_.series("in the tank", kTank, 4, 1e3),
              trace_.series("given to the hand, net", kPort, 4, 1e3)},
             spans,
             "An empty tank withholds force from the hand, so that it gets no more energy than it gave."),
         over_time("Force withheld from the hand", {"force", "N"},
                   {trace_.series("withheld by the energy tank", kWithheld, 3)}, spans)});
  }

  void add_joint_sections(report::Page& page, const std::vector<report::Span>& spans) const {
    page.heading("Joints");
    constexpr double kPercent = 100;
    const auto group = [&](std::size_t channel, std::size_t first, std::size_t count) {
      std::vector<report::Series> series;
      for (std::size_t i = 0; i < count && first + i < joints_.size(); ++i)
        series.push_back(trace_.series(joints_[first + i].name, channel + i, 2, kPercent));
      return series;
    };
    std::vector<report::Row> rows;
    for (std::size_t i = 0; i < std::min(kJoints, joints_.size()); ++i) {
      const bool is_arm = i >= kFirstArmJoint;
      const std::size_t k = is_arm ? i - kFirstArmJoint : 0;
      rows.push_back({joints_[i].name, is_arm ? position_rad_[k].lowest : kNaN,
                      is_arm ? position_rad_[k].highest : kNaN, is_arm ? ranges_[k].lower_rad : kNaN,
                      is_arm ? ranges_[k].upper_rad : kNaN, torque_Nm_[i].highest, torque_limit_Nm(i)});
    }
    page.table({{"joint"},
                {"position from", "rad", 3},
                {"to", "rad", 3},
                {"end stops from", "rad", 3},
                {"to", "rad", 3},
                {"largest torque", "N·m", 2},
                {"torque limit", "N·m", 2}},
               rows, "Measured, and the limits; a wheel has no end stop");
    const report::Axis share{.label = "share of the limit", .unit = "%"};
    const auto torques = [&](const char* title, std::vector<report::Series> series) {
      return over_time(title, share, std::move(series), spans);
    };
    page.plots(
        {over_time("Arm, between the end stops",
                   {.label = "share of the range", .unit = "%", .from = 0, .to = 100},
                   group(kPosition, kFirstArmJoint, control::kArmJoints), spans,
                   "The lower edge is one end stop, the upper edge the other."),
         torques("Arm torque, measured", group(kArmMeasured, kFirstArmJoint, control::kArmJoints)),
         over_time("Arm torque, commanded", share, group(kArmCommand, kFirstArmJoint, control::kArmJoints),
                   spans, "Only while the arm is controlled by torque."),
         torques("Wheel torque, measured", group(kWheelMeasured, 0, kFirstArmJoint)),
         torques("Wheel torque, commanded", group(kWheelCommand, 0, kFirstArmJoint))});
  }

  control::Teleoperation::Config config_;
  std::vector<hal::JointInfo> joints_;
  std::array<control::JointRange, control::kArmJoints> ranges_;
  TeleopMeasures measures_;
  RunPage common_;
  TimeTrace trace_{kChannels};
  Track base_;
  Track tip_;
  Track setpoint_;
  std::vector<bool> touched_ = std::vector<bool>(kGeneralLimits + 2 * joints_.size());
  std::array<Extent, kJoints> torque_Nm_{};
  std::array<Extent, control::kArmJoints> position_rad_{};
};

}  // namespace

std::unique_ptr<RunReport<TeleopRecord, TeleopSummary>> teleop_report(
    const control::Teleoperation::Config& config, const hal::Robot& robot) {
  return std::make_unique<TeleopReport>(config, robot);
}

}  // namespace operation
