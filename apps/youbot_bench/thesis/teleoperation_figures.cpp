// Teleoperation: start-up, the released handle that flips, and the measures of 3.2.3.
#include <spdlog/fmt/fmt.h>

#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <memory>
#include <numbers>
#include <stdexcept>
#include <string>
#include <vector>

#include "apps/youbot_bench/haptic_hold.h"
#include "apps/youbot_bench/thesis/chapters.h"
#include "apps/youbot_bench/thesis/teleop_rig.h"
#include "apps/youbot_bench/transparency.h"
#include "hal/seconds.h"
#include "operation/run_trace.h"
#include "operation/teleop_demo.h"
#include "operation/teleop_measures.h"
#include "operation/teleop_measures_page.h"
#include "operation/teleop_session.h"
#include "runtime/program/exit_code.h"
#include "runtime/program/stop_on_signals.h"
#include "runtime/program/wording.h"
#include "runtime/recording/recording_reader.h"

namespace youbot_bench::thesis {
namespace {

using namespace std::chrono_literals;
using control::TeleopPhase;
using Eigen::Vector3d;
using operation::TeleopRecord;
using operation::vector_of;
using report::Plot;
using report::Series;

/// Phases as spans of time.
class PhaseSpans {
 public:
  void add(const TeleopRecord& record) {
    const char* const name = control::name(record.phase);
    const double now_s = hal::seconds(record.time);
    if (spans_.empty() || spans_.back().name != name) spans_.push_back({name, now_s, now_s});
    spans_.back().to = now_s;
  }
  const std::vector<report::Span>& spans() const { return spans_; }

 private:
  std::vector<report::Span> spans_;
};

/// `youbot-bench haptic-hold` until the pulled pen is back.
Figure first_haptic_test(const Workshop& workshop) {
  workshop.begin("figure-35");
  const std::filesystem::path out = workshop.directory() / "figure-35";
  const int code = haptic_hold(
      {.haptic = "loopback", .duration_s = 7.0, .out = out.string(), .virtual_time = true, .quiet = true},
      runtime::stop_requested);
  Workshop::go_on();
  if (code != runtime::kExitOk) throw std::runtime_error("figure-35: haptic-hold failed");
  const identification::Recording recording = runtime::read_recording(out / "haptic.csv").recording;
  const auto time_s = recording.column("time_s");
  Series distance{.name = "distance", .x = {}, .y = {}};
  Series force{.name = "force", .x = {}, .y = {}};
  for (std::size_t i = 0; i < time_s.size(); i += 10) {
    const auto size = [&](const char* x, const char* y, const char* z) {
      return std::hypot(recording.column(x)[i], recording.column(y)[i], recording.column(z)[i]);
    };
    distance.x.push_back(time_s[i]);
    distance.y.push_back(1e3 * size("position_x_m", "position_y_m", "position_z_m"));
    force.x.push_back(time_s[i]);
    force.y.push_back(size("force_x_N", "force_y_N", "force_z_N"));
  }
  Figure figure{
      .number = "Figure 35",
      .caption = "The first haptic test: a spring holds the pen at the device's origin",
      .text =
          "The thesis' figure is a drawing of the messages; this is what the test does. A simulated hand "
          "pulls the pen away and lets it go, and a spring of 200 N/m brings it back. The thesis prints no "
          "stiffness here."};
  figure.compared = {compare("hold/equilibrium", distance.y.back())};
  const report::Axis time{.label = "time", .unit = "s", .link = "figure 35"};
  figure.plots = {{.title = "Pen from the origin", .x = time, .y = {"distance", "mm"}, .series = {distance}},
                  {.title = "Force on the pen", .x = time, .y = {"force", "N"}, .series = {force}}};
  return figure;
}

Figure start_up(const Workshop& workshop) {
  workshop.begin("section-3.4.4");
  const control::Teleoperation::Config config = usual_teleoperation();
  TeleopRig rig(config, true);
  rig.hand().hold_at({0.03, 0.03, 0.02});  // a hand that does not let the spring centre it, for a while
  PhaseSpans phases;
  operation::TimeTrace trace(3);
  double centring_N_per_m = std::nan("");
  Vector3d approach_end_m = Vector3d::Constant(std::nan(""));
  std::vector<double> stiffness;  // of each cycle from the coupling on
  double slack_N = std::nan("");  // vertical force of the spring in the last cycle before it
  const auto keep = [&](const TeleopRecord& record) {
    phases.add(record);
    trace.add(hal::seconds(record.time),
              std::array{record.stiffness_N_per_m, vector_of(record.held_force_H_N).norm(),
                         std::hypot(record.wrench_W[0], record.wrench_W[1], record.wrench_W[2])});
    const double off_m = vector_of(record.grip_p_HD_m).norm();
    if (record.phase == TeleopPhase::kCentring && record.time > 2s && record.time < 3s)
      centring_N_per_m = vector_of(record.held_force_H_N).norm() / off_m;
    if (record.time > 3s && rig.hand().holds() && record.phase == TeleopPhase::kCentring)
      rig.hand().hold_at(Vector3d::Zero());
    if (record.phase == TeleopPhase::kApproaching) {
      approach_end_m = vector_of(record.setpoint_p_WT_m);
      slack_N = std::abs(record.spring_W_N[2]);
    }
    if (record.phase >= TeleopPhase::kStiffening) stiffness.push_back(record.stiffness_N_per_m);
  };
  rig.run_until(TeleopPhase::kOperating, 90s, keep);
  // The hand draws the end effector, whose springs then stretch, and rests.
  rig.hand().move_to({-0.03, 0.0, 0.0}, 500ms);
  double scale = std::nan("");
  for (int n = 0; n < 4000; ++n) {
    const TeleopRecord& record = rig.step();
    keep(record);
    const double hand_N = vector_of(record.grip_force_H_N).norm();
    if (hand_N > 0.2 && vector_of(record.grip_v_HD_m_per_s).norm() < 1e-3)
      scale = vector_of(record.spring_W_N).norm() / hand_N;
  }
  Figure figure{.number = "Section 3.4.4",
                .caption = "Start-up: pen to its origin, arm unfolded, in front of the robot, then stiff",
                .text =
                    "The simulated robot and a simulated hand, which first holds the pen 47 mm off its "
                    "origin. Measured in the run: the pull on the pen, the set-point at the end of the "
                    "approach, the spring's vertical force then, the rise of the stiffness, and the force on "
                    "the robot over that on the hand "
                    "when the hand rests 30 mm ahead."};
  const auto full =
      static_cast<double>(std::ranges::count_if(stiffness, [&](double k) { return k < stiffness.back(); }));
  figure.compared = {
      compare("start/centring", centring_N_per_m),
      compare("start/x", approach_end_m.x(),
              "At the end of the approach the set-point moves to where the end effector rests."),
      compare("start/z", approach_end_m.z(), "As above."),
      compare("start/slack", slack_N),
      compare("start/soft", stiffness.empty() ? std::nan("") : stiffness.front()),
      compare("start/stiff", stiffness.empty() ? std::nan("") : stiffness.back()),
      compare("start/rise", stiffness.empty() ? std::nan("") : (stiffness.back() - stiffness.front()) / full),
      compare("start/turning stiff", config.stiff.rotation_Nm_per_rad),
      compare("start/turning rise", 1e-3 * config.stiffening_per_s.rotation_Nm_per_rad),
      compare("start/scale", scale),
      compare("gripper/closed", config.gripper_closed_m),
      compare("gripper/open", config.gripper_open_m)};
  const auto degrees = [](double angle_rad) { return 180 / std::numbers::pi * angle_rad; };
  for (Eigen::Index i = 0; i < config.unfolded_rad.size(); ++i)
    figure.compared.push_back(
        compare(fmt::format("start/unfolded {}", i + 1), degrees(config.unfolded_rad[i])));
  figure.compared.push_back(compare("start/unfolded within", degrees(config.unfolded_within_rad),
                                    "Ours waits until every joint is nearer, before torques hold the arm."));
  const report::Axis time{.label = "time", .unit = "s", .link = "start-up"};
  figure.plots = {{.title = "Stiffness of the coupling",
                   .x = time,
                   .y = {"stiffness", "N/m"},
                   .series = {trace.series("stiffness", 0, 1)},
                   .spans = phases.spans()},
                  {.title = "Forces",
                   .x = time,
                   .y = {"force", "N"},
                   .series = {trace.series("on the hand", 1, 3), trace.series("on the end effector", 2, 3)},
                   .spans = phases.spans()}};
  return figure;
}

/// What a released pen did after it flipped.
struct Flip {
  std::string name;
  double tip_way_mm = 0;
  double pen_speed_m_per_s = 0;
  double given_mJ = 0;
  std::string end{};  ///< phase
  operation::TimeTrace trace{3};
};

Flip flip(const std::string& name, bool protect, bool arm_alone) {
  control::Teleoperation::Config config = usual_teleoperation();
  config.approach_s = 4.0;
  config.stiffening_per_s = {6000, 300};
  config.feedback_fade_s = 0.2;
  config.tank.active = config.detect_release = protect;
  if (arm_alone) {
    config.robot.base.wrench_limits = {0, 0};
    config.robot.base.compensate_friction = false;
  }
  TeleopRig rig(config, !arm_alone);
  Flip seen{.name = name};
  if (!rig.run_until(TeleopPhase::kOperating, 90s)) {
    seen.end = "no start";
    return seen;
  }
  for (int n = 0; n < 1000; ++n) rig.step();
  rig.hand().let_go();
  rig.hand().flip(Eigen::Quaterniond(Eigen::AngleAxisd(std::numbers::pi / 2, Vector3d::UnitY())), 500ms);
  const Vector3d start_m = vector_of(rig.step().true_tip_p_WT_m);
  double energy_J = 0;
  double least_J = 0;
  for (int n = 0; n < 12000 && !rig.finished(); ++n) {
    const TeleopRecord& record = rig.step();
    const double way_mm = 1e3 * (vector_of(record.true_tip_p_WT_m) - start_m).norm();
    const double speed = vector_of(record.grip_v_HD_m_per_s).norm();
    seen.tip_way_mm = std::max(seen.tip_way_mm, way_mm);
    seen.pen_speed_m_per_s = std::max(seen.pen_speed_m_per_s, speed);
    energy_J = record.port_energy_J;
    least_J = n == 0 ? energy_J : std::min(least_J, energy_J);
    seen.given_mJ = std::max(seen.given_mJ, 1e3 * (energy_J - least_J));
    seen.trace.add(n * 1e-3, std::array{way_mm, speed, vector_of(record.held_force_H_N).norm()});
  }
  seen.end = control::name(rig.phase());
  return seen;
}

Figure released_pen(const Workshop& workshop) {
  workshop.begin("section-3.4.5");
  std::vector<Flip> all;
  for (const bool arm_alone : {true, false})
    for (const bool protect : {false, true})
      all.push_back(flip(std::string(arm_alone ? "arm alone" : "base and arm") +
                             (protect ? ", protected" : ", without protection"),
                         protect, arm_alone));
  Figure figure{.number = "Section 3.4.5",
                .caption = "The released pen whose orientation flips: with and without protection",
                .text =
                    "The danger that the thesis leaves open: the pen is let go and tips over by 90 degrees "
                    "in 0.5 s. The arm moves to match the orientation, the pen is pulled after it, and the "
                    "loop can run away: without protection the pen is thrown about, with the arm alone as "
                    "in the thesis and with the base. Protected, an energy tank gives the hand no more "
                    "energy than it gave (a reserve of 5 mJ), and a released handle is detected: the force "
                    "goes off and the set-point holds. The thesis found no cure in software and prints no "
                    "number here."};
  FigureTable table{.caption = "Twelve seconds after the flip",
                    .columns = {{"case"},
                                {"end effector from its place, largest", "mm", 1},
                                {"speed of the pen, largest", "m/s", 3},
                                {"energy given to the pen, largest", "mJ", 2},
                                {"phase at the end"}},
                    .rows = {}};
  const report::Axis time{.label = "time since the flip", .unit = "s", .link = "flip"};
  Plot way{.title = "End effector from its place", .x = time, .y = {"distance", "mm"}, .series = {}};
  Plot speed{.title = "Speed of the released pen", .x = time, .y = {"speed", "m/s"}, .series = {}};
  Plot force{.title = "Force on the released pen", .x = time, .y = {"force", "N"}, .series = {}};
  for (const Flip& each : all) {
    table.rows.push_back({each.name, each.tip_way_mm, each.pen_speed_m_per_s, each.given_mJ, each.end});
    way.series.push_back(each.trace.series(each.name, 0, 2));
    speed.series.push_back(each.trace.series(each.name, 1, 4));
    force.series.push_back(each.trace.series(each.name, 2, 3));
  }
  figure.tables = {table};
  figure.plots = {way, speed, force};
  return figure;
}

Figure two_port_measures(const Workshop& workshop) {
  workshop.begin("section-3.2.3.1");
  TransparencyPlan plan{.control = usual_teleoperation(), .hand = soft_hand()};
  const TransparencyCondition condition{.feedback = Feedback::kPositionError,
                                        .stiffness_N_per_m = printed_value("start/stiff")};
  const auto result = measure_transparency(
      plan, condition,
      [](const hal::Clock& clock, std::chrono::nanoseconds period) {
        runtime::RobotOptions options;
        options.ethercat.kind = hal::YoubotKind::kBaseAndArm;
        return runtime::open_robot(options, clock, period);
      },
      [](double) { return !runtime::stop_requested.load(std::memory_order_relaxed); });
  if (!result) throw Stopped();
  Figure figure{.number = "Section 3.2.3.1",
                .caption = "Quantitative measures of the teleoperator",
                .text =
                    "Measured as `youbot-bench transparency` does, forward, at 700 N/m with the thesis' "
                    "position-error feedback. The thesis defines the measures and prints the ideal values, "
                    "but measured none."};
  if (!result->measures) {
    figure.text += " Too few frequencies were coherent.";
    return figure;
  }
  const auto& measures = *result->measures;
  figure.compared = {
      compare(
          "ideal/position", measures.position.low_frequency_gain,
          "The set-point follows the hand; the gain at low frequency is that of the lowest measured octave."),
      compare(
          "ideal/force", measures.force.low_frequency_gain,
          "The force on the hand is that on the robot over 10 by choice, less the friction of the joints."),
      compare("ideal/product", measures.scaling_product,
              "The product of the two: power is scaled down on purpose."),
      compare("human/bandwidth", measures.force.bandwidth_Hz.value_or(std::nan("")),
              "Of force tracking. The robot's joints and the spring between are slower than a hand: "
              "vibrations of a contact are not felt."),
      compare("human/stiffness", 1e-2 * condition.stiffness_N_per_m / plan.control.feedback.force_scale,
              "700 N/m over the force scale: a wall feels soft, as the thesis says of its own in 3.4.5."),
      compare("human/force", plan.force_limit_N, "The omega.6 itself has 12 N.")};
  FigureTable table{
      .caption = "Felt environments",
      .columns = {{"environment"}, {"transparency error, ideal 0", "", 2}, {"fidelity, ideal 1", "", 4}},
      .rows = {}};
  for (const auto& felt : measures.environments)
    table.rows.push_back({felt.name, felt.transparency_error, felt.fidelity});
  figure.tables = {table};
  Series position{.name = "position", .x = {}, .y = {}};
  Series force{.name = "force", .x = {}, .y = {}};
  for (const auto& point : result->points) {
    if (!point.ok) continue;
    position.x.push_back(point.frequency_Hz);
    position.y.push_back(std::abs(point.H(1, 0)));
    force.x.push_back(point.frequency_Hz);
    force.y.push_back(std::abs(point.H(0, 1)));
  }
  figure.plots = {{.title = "Tracking over frequency",
                   .x = {.label = "frequency", .unit = "Hz", .log = true},
                   .y = {.label = "gain", .unit = "", .log = true},
                   .series = {position, force}}};
  return figure;
}

Figure qualitative_measures(const Workshop& workshop) {
  workshop.begin("section-3.2.3.2");
  operation::Config config;
  config.robot.ethercat.kind = hal::YoubotKind::kBaseAndArm;
  config.teleoperation = usual_teleoperation();
  config.teleoperated = true;
  config.robot.scene.walls.push_back({.p_W_m = {1.08, 0, 0}, .normal_W = {-1, 0, 0}});
  const auto measures = std::make_shared<operation::TeleopMeasures>(config.teleoperation);
  PhaseSpans phases;
  operation::TimeTrace trace(4);
  operation::TeleopOptions options;
  options.virtual_time = true;
  options.tasks = operation::demo_tasks();
  options.after_cycle = [&](const TeleopRecord& record) {
    measures->add(record);
    phases.add(record);
    trace.add(hal::seconds(record.time),
              std::array{vector_of(record.held_force_H_N).norm(), vector_of(record.spring_W_N).norm(),
                         record.setpoint_p_WT_m[0], record.tip_p_WT_m[0]});
  };
  const operation::TeleopSummary summary =
      operation::run_teleop_session(config, options, runtime::stop_requested);
  Workshop::go_on();
  Figure figure{.number = "Section 3.2.3.2",
                .caption = "Qualitative measures of a teleoperation",
                .text =
                    "A simulated operator reaches, follows a square, drives far, touches a wall 1.08 m ahead "
                    "and lets go, as with apps/youbotd/teleop.toml. The thesis names the measures and prints "
                    "no values. The page of every recorded teleoperation has them, with the match of the "
                    "workspaces and the human limits of 3.2.3.4."};
  figure.compared = {
      compare("human/resolution", measures->largest_force_step_N(),
              "A rule for the design of a device. Ours is the largest step of the force on the "
              "hand from one millisecond to the next.")};
  figure.more = [measures, tasks = summary.tasks](report::Page& page) {
    operation::add_measure_tables(page, *measures, tasks);
  };
  const report::Axis time{.label = "time", .unit = "s", .link = "qualitative"};
  figure.plots = {
      {.title = "Forces",
       .x = time,
       .y = {"force", "N"},
       .series = {trace.series("on the hand", 0, 3), trace.series("of the spring to the robot", 1, 3)},
       .spans = phases.spans()},
      {.title = "Forward position of the end effector",
       .x = time,
       .y = {"x", "m"},
       .series = {trace.series("set-point", 2, 4), trace.series("end effector", 3, 4)},
       .spans = phases.spans()}};
  return figure;
}

}  // namespace

std::vector<Figure> teleoperation(const Workshop& workshop) {
  return {two_port_measures(workshop), qualitative_measures(workshop), first_haptic_test(workshop),
          start_up(workshop), released_pen(workshop)};
}

}  // namespace youbot_bench::thesis
