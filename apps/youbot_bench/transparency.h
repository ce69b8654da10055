/// @file
/// `youbot-bench transparency`: measures transparency and tracking of teleoperation.
///
/// A multisine force of the hand excites the simulated handle, around the pose where the operator has just
/// taken over: first with a free end effector, then with a known spring on it. Velocity and force at both
/// ends give the two-port's hybrid matrix (identification/two_port/hybrid_matrix.h) and its measures. Both
/// ends in the robot's directions (W), N and m/s. All in virtual time.
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

enum class Feedback : std::uint8_t {
  kPositionError,
  kContact,  ///< force from the torques of the arm
  kMixed,    ///< half of each
  kNone
};
/// "position-error"
const char* name_of(Feedback feedback) noexcept;
/// @throws std::invalid_argument listing the known ones.
Feedback feedback_from(const std::string& name);

/// One coupling between hand and end effector.
struct TransparencyCondition {
  Feedback feedback = Feedback::kPositionError;
  double stiffness_N_per_m = 700.0;
};

struct TransparencyPlan {
  int axis = 0;  ///< of W: 0 forward, 1 left, 2 up
  /// Large enough to keep joints and wheels sliding, small enough that the handle stays inside rate control's
  /// boundary.
  identification::two_port::ExcitationShape excitation{
      .period_s = 10.0, .lowest_Hz = 0.3, .highest_Hz = 15.0, .lines = 28, .peak_N = 2.4};
  int realizations = 4;            ///< each has one settling period and one measured period
  double tether_N_per_m = 1000.0;  ///< the known spring and damper at the end effector
  double tether_N_s_per_m = 10.0;
  /// Stiffness and feedback are taken from the condition; release detection is off, because a yielding hand
  /// like this one might count as released.
  control::Teleoperation::Config control;
  sim::HandParameters hand;  ///< see soft_hand()
  double force_limit_N = 8.0;
  double slew_N_per_s = 200.0;  ///< of the force on the hand
};

/// Yields, so that the handle moves and the device is felt; its own properties do not matter, because force
/// and velocity are measured at the handle.
sim::HandParameters soft_hand();

struct TransparencyResult {
  TransparencyCondition condition;
  std::vector<identification::two_port::HybridPoint> points;
  /// Empty with fewer than three points that are ok.
  std::optional<identification::two_port::TwoPortMeasures> measures;
  std::string fault;  ///< cause of an early end of teleoperation; empty: none
  // Shares of the measured cycles.
  double passive_share = 0.0;  ///< the energy tank changed the force on the hand
  double limited_share = 0.0;  ///< a force or torque on the robot was limited
  double rate_share = 0.0;     ///< the handle was outside, under rate control
  double furthest_pen_m = 0.0;
  double furthest_tip_m = 0.0;
};

/// A simulated robot with an arm.
using RobotMaker =
    std::function<runtime::OpenedRobot(const hal::Clock& clock, std::chrono::nanoseconds period)>;

/// From enabling through the whole start-up to the last period. `tell(done)` is called occasionally with the
/// completed share; if it returns false, the measurement ends without a result.
/// @throws std::invalid_argument for an invalid value.
std::optional<TransparencyResult> measure_transparency(const TransparencyPlan& plan,
                                                       const TransparencyCondition& condition,
                                                       const RobotMaker& make_robot,
                                                       const std::function<bool(double done)>& tell = {});

struct TransparencyOptions {
  std::string config{};  ///< TOML as for youbotd; empty: defaults, with the pull of the base as in
                         ///< teleop.toml
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

/// Maximum value of --stiffness.
inline constexpr double kMaxCoupling_N_per_m = 5000.0;

/// Returns the exit code. Set `stop` to end it early. @throws runtime::ConfigError, std::invalid_argument,
/// hal::SetupError.
int transparency(const TransparencyOptions& options, const std::atomic<bool>& stop);

Subcommand add_transparency(CLI::App& app);

}  // namespace youbot_bench
