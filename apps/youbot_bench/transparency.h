/// @file
/// `youbot-bench transparency`: how the robot feels and follows through teleoperation, measured.
///
/// The hand's force on the simulated pen is swept by many sines at once, about the place where the operator
/// has just taken over: with nothing at the tip, then with a known spring there. From velocity and force at
/// either end comes the two-port's hybrid matrix (identification/two_port/hybrid_matrix.h), and from that its
/// measures. Both ends in the robot's directions (W), N and m/s. All in virtual time.
#pragma once
#include <atomic>
#include <chrono>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "apps/youbot_bench/subcommand.h"
#include "control/teleoperation.h"
#include "hal/clock.h"
#include "identification/two_port/excitation.h"
#include "identification/two_port/hybrid_matrix.h"
#include "identification/two_port/measures.h"
#include "runtime/open_robot.h"
#include "sim/hand.h"

namespace youbot_bench {

enum class Feedback : std::uint8_t { kPositionError, kNone };
/// "position-error"
const char* name_of(Feedback feedback) noexcept;
/// @throws std::invalid_argument naming those there are.
Feedback feedback_from(const std::string& name);

/// One way to couple hand and tip.
struct TransparencyCondition {
  Feedback feedback = Feedback::kPositionError;
  double stiffness_N_per_m = 700.0;
};

struct TransparencyPlan {
  int axis = 0;  ///< of W: 0 forward, 1 left, 2 up
  /// Large enough to keep joints and wheels sliding, small enough for the pen to stay inside rate control's
  /// boundary.
  identification::two_port::ExcitationShape excitation{
      .period_s = 10.0, .lowest_Hz = 0.3, .highest_Hz = 15.0, .lines = 28, .peak_N = 2.4};
  int realizations = 4;            ///< each has one period to settle, and one that counts
  double tether_N_per_m = 1000.0;  ///< the known spring and damper at the tip
  double tether_N_s_per_m = 10.0;
  /// Its stiffness and feedback are the condition's; whether the pen is let go of is not looked for, as a
  /// hand that gives way like this one might be taken for none.
  control::Teleoperation::Config control;
  sim::HandParameters hand;  ///< see soft_hand()
  double force_limit_N = 8.0;
  double slew_N_per_s = 200.0;  ///< of the force on the hand
};

/// Gives way, so that the pen moves and the device is felt; what it is itself does not count, as force and
/// velocity are taken where it meets the grip.
sim::HandParameters soft_hand();

struct TransparencyResult {
  TransparencyCondition condition;
  std::vector<identification::two_port::HybridPoint> points;
  /// Empty with fewer than three points that are ok.
  std::optional<identification::two_port::TwoPortMeasures> measures;
  std::string fault;  ///< what ended teleoperation early; empty: nothing
  // Of the cycles that were measured.
  double passive_share = 0.0;  ///< the energy tank changed the force on the hand
  double limited_share = 0.0;  ///< a force or torque on the robot was cut
  double rate_share = 0.0;     ///< the pen was outside, under rate control
  double furthest_pen_m = 0.0;
  double furthest_tip_m = 0.0;
};

/// A simulated robot with an arm.
using RobotMaker =
    std::function<runtime::OpenedRobot(const hal::Clock& clock, std::chrono::nanoseconds period)>;

/// From switching on through the whole start-up to the last period. `tell(done)` is called now and then with
/// the share that is done; false from it ends the measurement, without a result.
/// @throws std::invalid_argument for a value that no part accepts.
std::optional<TransparencyResult> measure_transparency(const TransparencyPlan& plan,
                                                       const TransparencyCondition& condition,
                                                       const RobotMaker& make_robot,
                                                       const std::function<bool(double done)>& tell = {});

struct TransparencyOptions {
  std::string config{};  ///< TOML as youbotd's; empty: defaults, and the base may pull as in teleop.toml
  std::string robot{};   ///< empty: the configuration's
  std::string haptic{};  ///< likewise
  std::vector<double> stiffness_N_per_m{200.0, 700.0};
  std::vector<std::string> feedback{"position-error", "none"};
  std::string axis = "x";
  identification::two_port::ExcitationShape excitation = TransparencyPlan{}.excitation;
  int realizations = TransparencyPlan{}.realizations;
  std::string out{};  ///< directory for a CSV file of each condition, and report.html
  bool quiet = false;
};

/// Largest value that --stiffness takes.
inline constexpr double kMostCoupling_N_per_m = 5000.0;

/// The exit code. Set `stop` to end it early. @throws runtime::ConfigError, std::invalid_argument,
/// hal::SetupError.
int transparency(const TransparencyOptions& options, const std::atomic<bool>& stop);

Subcommand add_transparency(CLI::App& app);

}  // namespace youbot_bench
