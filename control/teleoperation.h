/// @file
/// Haptic teleoperation of base and arm (thesis chapter 3): turns samples of haptic device and robot into
/// commands for both, with a start-up sequence without sudden motion of either side.
///
///   Off → Centring → Unfolding → Approaching → Stiffening → Operating ⇄ LetGo
///   Centring → Off,   any later one → Stopping → Lowering → Off,   any → Faulted
///
/// - Centring: a weak spring brings the handle to its origin.
/// - Unfolding: the arm moves to its unfolded pose; all joints take the same time.
/// - Approaching: the end effector moves softly to a pose in front of the robot. When it rests near there,
///   the set-point moves to it until the spring between them is slack.
/// - Stiffening: handle and end effector are coupled; the spring becomes stiff, and its force fades in on the
///   hand.
/// - Operating, until the hand is found to have released the handle.
/// - LetGo: the set-point holds and the force is off until a button is pressed.
/// - Stopping: base braked, arm held, force off.
/// - Lowering: the arm sinks slowly under its own weight (without power it would fall), then the drives are
///   switched off. The next start begins with Centring.
#pragma once
#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <optional>
#include <stdexcept>

#include "control/energy_tank.h"
#include "control/force_feedback.h"
#include "control/hand_presence.h"
#include "control/haptic_mapping.h"
#include "control/point_spring.h"
#include "control/setpoint_limiter.h"
#include "control/setpoint_smoothing.h"
#include "control/speed_proof.h"
#include "control/whole_body_controller.h"
#include "control/workspace.h"

namespace control {

enum class TeleopPhase : std::uint8_t {
  kOff,
  kCentring,
  kUnfolding,
  kApproaching,
  kStiffening,
  kOperating,
  kLetGo,
  kStopping,
  kLowering,
  kFaulted,
};
/// "approaching"
const char* name(TeleopPhase phase) noexcept;

/// Reason for a stop.
enum class TeleopEnd : std::uint8_t {
  kNone,
  kRequested,
  kNotCentred,            ///< the handle did not reach its origin in time
  kNotUnfolded,           ///< the arm did not reach its pose in time
  kNotArrived,            ///< the end effector did not come to rest in front of the robot in time
  kMasterFault,           ///< no force on the haptic device and no data from it
  kStalled,               ///< the loop that calls step() did not run
  kNotHomed,              ///< the arm's angles are not known
  kRobotFault,            ///< the drives are already off
  kWheelTooFast,          ///< the drives are switched off at once
  kJointTooFast,          ///< likewise
  kJointOutside,          ///< likewise: the measured position is beyond an end stop
  kSetpointTooFar,        ///< the end effector is further from its set-point than allowed
  kSetpointTurnedTooFar,  ///< likewise in rotation
  kTipOutside,            ///< the end effector left its workspace
  kBaseOutside,           ///< likewise the base
  kJointBehind,           ///< during unfolding, an arm joint is further from its set-point than allowed
};
/// For an end caused by a limit: the value that exceeded it.
struct TeleopExcess {
  int joint = -1;      ///< indices of hal::Robot: wheels, then arm; -1: the end effector
  double value = 0.0;  ///< rad/s, m or rad
  double limit = 0.0;
};

struct TeleopInput {
  // Robot.
  bool drives_obey = false;
  bool robot_fault = false;
  std::optional<double> robot_elapsed_s{};  ///< since the last sample, as in BaseDrive::sense()
  SampleBounds robot_taken{};               ///< when the sample was taken
  WheelVector wheel_position_rad = WheelVector::Zero();
  ArmVector arm_position_rad = ArmVector::Zero();
  std::optional<ArmVector> arm_torque_Nm{};  ///< commanded since the last sample; empty: by position
  bool arm_homed = false;                    ///< its angles are relative to its end stops
  // Haptic device.
  bool master_ready = false;  ///< it has a position and accepts a force
  bool grip_fresh = false;    ///< this is a new sample
  bool master_fault = false;  ///< zero force until disabled once
  /// The loop paused before this sample: the change of the handle's speed is not that of one period.
  bool grip_after_pause = false;
  Grip grip;
  std::uint32_t buttons = 0;
  Eigen::Vector3d held_H_N = Eigen::Vector3d::Zero();  ///< force on the hand since the last sample
  bool released = false;                               ///< known from elsewhere: no hand holds the handle
  std::optional<Eigen::Vector3d> felt_H_N{};  ///< on a hand far away, as late as its motion; else empty
};

struct TeleopOutput {
  TeleopPhase phase = TeleopPhase::kOff;
  // Robot.
  bool enable_drives = false;
  WheelVector wheel_torque_Nm = WheelVector::Zero();
  enum class Arm : std::uint8_t { kPosition, kTorque };
  Arm arm = Arm::kPosition;
  ArmVector arm_target = ArmVector::Zero();  ///< rad or N·m
  bool move_gripper = false;
  double gripper_opening_m = 0.0;
  // Haptic device.
  bool enable_master = false;
  Eigen::Vector3d force_H_N = Eigen::Vector3d::Zero();
  // For logs and recordings.
  TipSetpoint setpoint;
  HapticMapping::Mode mode = HapticMapping::Mode::kPosition;
  bool clutched = false;
  CartesianStiffness stiffness;
  Wrench wrench_W = Wrench::Zero();                      ///< on the end effector
  Eigen::Vector3d spring_W_N = Eigen::Vector3d::Zero();  ///< part of it from the spring between set-point and
                                                         ///< end effector
  double tank_J = 0.0;
  double withheld_N = 0.0;  ///< from the hand, by the energy tank
  bool limited = false;
  bool setpoint_limited = false;  ///< in speed, acceleration or jerk
  bool at_wall = false;           ///< the set-point is held at a workspace limit
  bool protecting = false;
};

/// What the operator may change during operation (thesis 3.5); otherwise as in Teleoperation::Config.
struct TeleopTuning {
  CartesianStiffness stiff{};
  double force_scale = 0.0;
  bool force_feedback = false;
  double contact_share = 0.0;
  double motion_scale = 0.0;
  double rate_speed_m_per_s = 0.0;
};

/// The end effector cannot start at `start_p_WT_m` with `start_pitch_rad`.
struct UnreachableStart : std::invalid_argument {
  using std::invalid_argument::invalid_argument;
};

/// One thread. Cycle: step(), tune() and the requests; nothing allocates, locks or throws. Time is counted in
/// cycles.
class Teleoperation {
 public:
  struct Config {
    double period_s = 1e-3;
    WholeBodyController::Config robot;
    HapticMapping::Config mapping;
    SetpointSmoothing::Config smoothing;
    ForceFeedback feedback;
    bool force_feedback = true;
    EnergyTank::Config tank;
    HandPresence::Config presence;
    bool detect_release = true;

    PointSpring centring;  ///< 40 N/m
    bool master_has_force = true;
    double centred_within_m = 0.01;
    ArmVector unfolded_rad = (ArmVector() << 2.94961, 1.13446, -2.54818, 1.78896, 2.92343)
                                 .finished();  ///< 169, 65, -146, 102.5, 167.5°
    double unfolding_speed_rad_per_s = 0.4;    ///< of the joint with the longest way, on average
    double unfolded_within_rad = 0.0349;       ///< 2°; the thesis uses 10°
    Eigen::Vector3d start_p_WT_m{0.35, 0.0, 0.35};
    double start_pitch_rad = 2.0944;  ///< from upright, forward and down: 120°
    double approach_s = 8.0;
    double arrived_within_m = 0.01;
    double arrived_within_rad = 0.05236;
    CartesianStiffness soft{100, 10};
    double slack_N = 0.1;                 ///< of the spring
    double resting_speed_m_per_s = 0.01;  ///< of end effector and handle
    CartesianStiffness stiff{700, 30};
    CartesianStiffness stiffening_per_s{100, 5};
    double feedback_fade_s = 2.0;

    int gripper_button = 0;  ///< -1: none
    int clutch_button = 1;
    double gripper_closed_m = 0.010;
    double gripper_open_m = 0.020;

    double centring_timeout_s = 15.0;
    double unfolding_timeout_s = 30.0;
    double approach_timeout_s = 60.0;
    double stop_timeout_s = 2.0;
    double lowering_s = 3.0;  ///< until none of the arm's weight is supported
    double wheel_speed_limit_rad_per_s = 16.0;
    double joint_speed_limit_rad_per_s = 3.0;
    /// For the joint with the longest way during unfolding; it determines the duration.
    SetpointLimits joint_setpoint = kArmJointLimits;
    /// During unfolding, a joint that is further from its set-point for 0.2 s stops the motion. The boards'
    /// ramps lag by up to 0.24 rad.
    double joint_following_error_rad = 0.4;
    double setpoint_distance_limit_m = 0.25;  ///< end effector to set-point
    Workspace workspace;
    double setpoint_turn_limit_rad = 2.0944;  ///< likewise; less than half a turn
  };

  /// @throws UnreachableStart; std::invalid_argument naming the value out of range.
  explicit Teleoperation(const Config& config);

  static constexpr int kFirstArmJoint = 4;  ///< after the wheels

  /// From off or faulted: starts with the next step.
  void request_start() noexcept { start_ = true; }
  /// Comes to rest, then switches off.
  void request_stop(TeleopEnd why = TeleopEnd::kRequested) noexcept;
  /// Drives off with the next step: the arm falls.
  void switch_off() noexcept;
  /// Before the first step after a pause of the loop: comes to rest, with velocity estimates restarted.
  void stop_after_gap(const TeleopInput& input) noexcept;

  /// Values in the ranges of Config. The stiffness follows by `stiffening_per_s`; feedback, force scale and
  /// rate speed within `feedback_fade_s`; the motion scale at once, without a jump of the set-point.
  void tune(const TeleopTuning& tuning) noexcept { tuning_ = tuning; }
  static TeleopTuning tuning_of(const Config& config) noexcept;

  const TeleopOutput& step(const TeleopInput& input) noexcept;

  TeleopPhase phase() const noexcept { return phase_; }
  TeleopEnd end() const noexcept { return end_; }
  const TeleopExcess& excess() const noexcept { return excess_; }
  /// Off or faulted after a start.
  bool finished() const noexcept {
    return end_ != TeleopEnd::kNone && (phase_ == TeleopPhase::kOff || phase_ == TeleopPhase::kFaulted);
  }
  const WholeBodyController::State& robot() const noexcept { return robot_.state(); }

 private:
  void begin(const TeleopInput& input) noexcept;
  void enter(TeleopPhase phase) noexcept;
  void stop(TeleopEnd end) noexcept;
  void fail(TeleopEnd end) noexcept;
  void check(const TeleopInput& input) noexcept;
  void keep_in_range(ArmVector& position_rad) const noexcept;
  void check_range(const ArmVector& position_rad) noexcept;
  void restart_speeds() noexcept;
  void prove_speeds(const TeleopInput& input) noexcept;
  void check_speeds() noexcept;
  void check_tip() noexcept;
  void check_workspace() noexcept;
  bool arm_is_behind(const ArmVector& position_rad) noexcept;
  void centre(const TeleopInput& input) noexcept;
  void unfold(const TeleopInput& input) noexcept;
  void approach(const TeleopInput& input) noexcept;
  void operate(const TeleopInput& input) noexcept;
  void follow_tuning(const Grip& grip) noexcept;
  void wait_for_hand(const TeleopInput& input) noexcept;
  void come_to_rest() noexcept;
  void lower_arm() noexcept;
  void take_hold(const TeleopInput& input) noexcept;
  /// Stores into the output; returns the spring's force.
  double keep(const WholeBodyController::Output& robot) noexcept;
  void command_master(const TeleopInput& input) noexcept;
  void command_gripper(const TeleopInput& input) noexcept;
  static bool is_down(int button, const TeleopInput& input) noexcept;
  TipPose tip() const noexcept;
  bool for_long(bool condition, double duration_s) noexcept;

  Config config_;
  TeleopTuning tuning_;
  double hand_force_gain_ = 0.0;  // 1/force_scale
  double contact_share_ = 0.0;
  double rate_speed_m_per_s_ = 0.0;
  WholeBodyController robot_;
  HapticMapping mapping_;
  SetpointSmoothing smoothing_;
  EnergyTank tank_;
  HandPresence presence_;
  RobotModel path_model_;  // for the way to the start
  ArmVector start_posture_rad_;

  TeleopPhase phase_ = TeleopPhase::kOff;
  TeleopEnd end_ = TeleopEnd::kNone;
  TeleopExcess excess_;
  bool start_ = false;
  std::array<SpeedProof, kFirstArmJoint + kArmJoints> speed_proofs_;
  double in_phase_s_ = 0.0;
  ArmVector hold_rad_ = ArmVector::Zero();  // arm position at the start of the phase
  double condition_held_s_ = 0.0;
  CartesianStiffness stiffness_;
  double feedback_share_ = 0.0;  // of the force feedback
  double rim_share_ = 0.0;       // of the boundary spring
  double centring_share_ = 0.0;  // of the centring spring
  double withheld_N_ = 0.0;
  // Part of the commands one and two steps ago that came from fixed springs.
  Eigen::Vector3d fixed_last_H_N_ = Eigen::Vector3d::Zero();
  Eigen::Vector3d fixed_before_H_N_ = Eigen::Vector3d::Zero();
  bool clutched_ = false;
  bool grip_seen_ = false;        // since the start
  bool button_was_up_ = false;    // since the release
  bool gripper_blocked_ = false;  // until its button is up
  ArmVector unfold_from_rad_ = ArmVector::Zero();
  double unfold_s_ = 0.0;
  double behind_s_ = 0.0;  // time for which a joint has been behind while unfolding
  ArmVector approach_from_rad_ = ArmVector::Zero();
  bool arrived_ = false;  // near enough
  TeleopOutput output_;
};

/// Posture in which the approach to the start ends. `model`: gives the geometry alone. Setup.
/// @throws UnreachableStart, or std::invalid_argument if the unfolded arm is beyond the range of a joint
ArmVector start_posture(const Teleoperation::Config& config, RobotModel& model);

}  // namespace control
