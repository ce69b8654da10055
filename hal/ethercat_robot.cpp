#include "hal/ethercat_robot.h"

#include <algorithm>
#include <array>
#include <bitset>
#include <cerrno>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <deque>
#include <optional>
#include <stdexcept>
#include <utility>
#include <vector>

#include "drivers/ethercat/pre_op_bus.h"
#include "drivers/ethercat/raw_socket_link.h"
#include "drivers/ethercat/simulated_bus.h"
#include "drivers/tmcl/client.h"
#include "drivers/tmcl/mailbox_transport.h"
#include "drivers/tmcl/youbot_topology.h"
#include "hal/ethercat/drive_channel.h"
#include "hal/ethercat/gripper_channel.h"
#include "hal/ethercat/loss_window.h"
#include "hal/newest_value.h"
#include "hal/seconds.h"
#include "hal/setup_error.h"

namespace hal {
namespace {

namespace ethercat = drivers::ethercat;
namespace tmcl = drivers::tmcl;
using std::chrono::nanoseconds;

std::size_t drives_of(YoubotKind kind) {
  return static_cast<std::size_t>(std::ranges::count_if(
      tmcl::youbot_boards(kind), [](const auto& board) { return board.kind != tmcl::BoardKind::kPower; }));
}

/// Sets up stall detection as the official driver does. Returns the error; empty if there is none.
std::string find_gripper(tmcl::Transport& transport, tmcl::Clock& clock) {
  try {
    tmcl::Client client(transport, clock, {.tries = 2});
    for (std::uint8_t bar = 0; bar < tmcl::kGripperBars; ++bar) {
      client.set(tmcl::gripper_parameter("stall_guard_threshold"), 50, bar);
      client.set(tmcl::gripper_parameter("stall_guard_filter_enable"), 1, bar);
    }
    return {};
  } catch (const drivers::SetupError& error) {
    return error.what();  // an arm without a gripper is complete
  }
}

/// Parameters to write for one joint. @throws std::invalid_argument for those that no drive accepts.
std::vector<tmcl::ParameterSetting> settings_of(const EthercatOptions& options, const std::string& joint) {
  std::vector<tmcl::ParameterSetting> settings;
  for (const EthercatOptions::Parameter& each : options.parameters) {
    if (each.joint != joint) continue;
    if (const std::string complaint = check(each); !complaint.empty())
      throw std::invalid_argument("parameter '" + each.name + "' of " + joint + " " + complaint);
    settings.push_back({tmcl::find_drive_parameter(each.name), each.value});
  }
  return settings;
}

/// Cycles without an answer that are bridged in addition to the tolerated ones.
int excused_cycles(const EthercatOptions& options, nanoseconds period, bool simulated) {
  if (!simulated || options.tolerated_cycles) return 0;
  const auto cycle = std::max(period, options.frame_timeout);  // duration of a cycle without an answer
  return std::max(0, static_cast<int>(kSimulatorPatience / cycle) - kToleratedCycles);
}

ethercat::PreOpBus::Options bus_options(const EthercatOptions& options) {
  ethercat::PreOpBus::Options bus{.distributed_clocks = options.distributed_clocks};
  bus.cyclic.frame_timeout = options.frame_timeout;
  return bus;
}

/// Why an interface takes no frames, with advice.
std::string link_text(const std::string& interface, int error) {
  const char* name = strerrorname_np(error);
  const std::string cause =
      std::string(" (") + (name != nullptr ? name : "unknown error") + ": " + std::strerror(error) + "): ";
  const std::string link = "the network interface " + interface;
  switch (error) {
    case ENETDOWN:
      return link + " went down" + cause + "'ip link set " + interface + " up', then enable again";
    case ENODEV:
    case ENXIO: return link + " is gone" + cause + "plug it in again, then restart this program";
    // The kernel's code for a missing carrier if the interface has no queue.
    case ENOBUFS: return link + " sends nothing" + cause + "is the cable in at both ends?";
    case ETIME:  // of a LockStepLink
      return "the simulation in lock-step on " + interface +
             " does not answer any more: start it again, then this program";
    case EMSGSIZE:
      return link + " takes no frames of this size" + cause + "'ip link set " + interface + " mtu 1500'";
    default: return link + " refuses frames" + cause + "see 'ip -s link show " + interface + "'";
  }
}

std::string number(double value) {
  std::array<char, 16> text{};
  std::snprintf(text.data(), text.size(), "%g", value);
  return text.data();
}

std::string percent(double share) { return number(100 * share) + " %"; }

/// The window is not reset by an enable: otherwise a robot could move on a bus that still loses frames, until
/// the window is full again.
std::string loss_text(int cycles, double limit, nanoseconds period) {
  return "too many frames were lost, came late or were damaged: " + std::to_string(cycles) +
         " of the last 1000 cycles had no whole answer, and ethercat.loss_fault allows " + percent(limit) +
         ": check the cables and the load of this machine; losses count for " +
         number(seconds(static_cast<int>(LossWindow::kCycles) * period)) +
         " s, and until then an enable is refused";
}

std::string losses_text(const BusLosses& losses) {
  return std::to_string(losses.cycles) +
         " of the last 1000 cycles were bridged: " + std::to_string(losses.lost) + " without an answer, " +
         std::to_string(losses.incomplete) + " with an incomplete one; " + std::to_string(losses.late) +
         " answers came late, " + std::to_string(losses.twice) + " twice, in " +
         std::to_string(losses.damaged) + " something damaged came";
}

/// Data for the reports, which another thread makes.
struct RobotState {
  ethercat::BusState bus;
  std::vector<DriveChannel::Failure> failures;  // of each drive
  std::bitset<kMaxJoints> without_hall;
  std::vector<GripperState> grippers;
  BusLosses losses;
  int lasting_gap = 0;  // current run of cycles without a complete answer, once it is longer than can be
                        // bridged
  int link_error = 0;   // errno, likewise
};

/// Time of the link: on an emulated bus it is not the machine's.
class LinkClock final : public tmcl::Clock {
 public:
  explicit LinkClock(ethercat::Link& link) : link_(link) {}
  std::chrono::nanoseconds now() noexcept override { return link_.now(); }
  void wait(std::chrono::nanoseconds duration) noexcept override { link_.wait(duration); }

 private:
  ethercat::Link& link_;
};

class EthercatRobot final : public Robot {
 public:
  using OpenLink = std::function<std::unique_ptr<ethercat::Link>()>;

  EthercatRobot(OpenLink open_link, const EthercatOptions& options, const Clock& clock, nanoseconds period)
      : open_link_(std::move(open_link)),
        options_(options),
        clock_(clock),
        period_(period),
        tolerated_cycles_(options.tolerated_cycles.value_or(kToleratedCycles)) {
    for (const tmcl::YoubotBoard& board : tmcl::youbot_boards(options.kind)) {
      if (board.kind == tmcl::BoardKind::kPower) continue;
      joints_.push_back(joint_info(joint_name(board), axis_of(board)));
      settings_.push_back(settings_of(options, joints_.back().name));
    }
    for (const EthercatOptions::Parameter& each : options.parameters)
      if (std::ranges::none_of(joints_, [&](const JointInfo& joint) { return joint.name == each.joint; }))
        throw std::invalid_argument("parameter '" + each.name + "': this robot has no joint '" + each.joint +
                                    "'");
  }
  ~EthercatRobot() override { deactivate(); }

  std::span<const JointInfo> joints() const noexcept override { return joints_; }
  void activate() override;
  void deactivate() noexcept override;
  CycleStatus exchange(const RobotCommand& command, RobotSample& sample) noexcept override;
  std::vector<std::string> notes() const override;
  std::string explain(const CycleStatus& status) const override;
  std::optional<BusLosses> losses() const override;
  std::vector<BusDevice> devices() const override;
  std::vector<std::string> device_faults() const override;
  std::vector<std::string> report() const override;

 private:
  void add_drive(ethercat::PreOpBus& setup, const tmcl::YoubotBoard& board, std::size_t slave);
  CycleStatus check_command(const RobotCommand& command) const noexcept;
  CycleStatus check_bus(const ethercat::CycleResult& result) noexcept;
  std::int8_t first_tampered() const noexcept;
  CycleStatus bridge(const ethercat::CycleResult& result) noexcept;
  bool gap_is_bridged() const noexcept;
  CycleStatus check_losses(const ethercat::CycleResult& result) noexcept;
  BusLosses judged_losses() const noexcept;
  CycleStatus check_drives() const noexcept;
  void repair() noexcept;
  void restore(std::size_t slave) noexcept;
  void prepare() noexcept;
  void switch_off(bool by_operator) noexcept;
  void stop_grippers() noexcept;
  nanoseconds time_by_frames() const noexcept;
  void copy_state() noexcept;
  const RobotState& newest_state() const noexcept;

  OpenLink open_link_;
  EthercatOptions options_;
  const Clock& clock_;
  nanoseconds period_;
  std::vector<JointInfo> joints_;
  std::vector<std::vector<tmcl::ParameterSetting>> settings_;  // of each joint
  std::string interface_;                                      // of the last activate()
  std::unique_ptr<ethercat::Link> link_;
  std::optional<ethercat::OpBus> bus_;
  // Neither may move in memory: others point to them.
  std::deque<DriveChannel> drives_;
  std::deque<GripperChannel> grippers_;
  std::size_t drives_left_off_ = 0;          // of an arm that is present but not requested
  std::vector<std::string> gripper_faults_;  // of each: why it counts as absent
  bool enabled_ = false;
  // A sample has been returned since: an earlier command may be wrong, because homing moves the zero.
  bool sampled_ = false;
  bool simulated_ = false;       // by youbot-sim, as its EEPROMs say
  bool goes_by_frames_ = false;  // simulated in lock-step
  nanoseconds begin_{};          // of the simulation's time, by the clock
  const int tolerated_cycles_;
  int excused_cycles_ = 0;  // if they have no answer
  int bad_cycles_ = 0;
  int unanswered_cycles_ = 0;  // of those
  LossWindow losses_;
  ethercat::FrameCounters counted_;  // after the last cycle
  CycleStatus latched_{};
  bool gripper_left_moving_ = false;  // by the last deactivate()
  RobotState state_;                  // the cycle's
  // Triple buffer from the cycle to the reporting thread, which caches the last value.
  mutable std::optional<NewestValue<RobotState>> states_;
  mutable RobotState reported_;
};

void EthercatRobot::activate() {
  deactivate();
  try {
    link_ = open_link_();
    interface_ = link_->name();
    ethercat::PreOpBus setup(*link_, options_.tap, bus_options(options_));
    const YoubotKind kind = options_.kind;
    // An arm that is present but not requested stays out of operation: its drives are sent nothing, so their
    // watchdogs do not make them hold it when this program ends.
    const YoubotKind around = tmcl::youbot_around(kind, setup.slaves().size());
    check_topology(setup.slaves(), tmcl::youbot_topology(around), link_->name());
    drives_left_off_ = drives_of(around) - drives_of(kind);
    tmcl::require_youbot_boards(setup.slaves());
    simulated_ = first_without(ethercat::kSimulatedMark, setup.slaves()) == nullptr;
    goes_by_frames_ = first_without(ethercat::kLockStepMark, setup.slaves()) == nullptr;
    excused_cycles_ = excused_cycles(options_, period_, simulated_);
    // The bus must not count a slave as lost while the robot still bridges its silence: it would stop the
    // slave, which would then move again without a new enable.
    setup.lose_no_sooner_than(tolerated_cycles_ + excused_cycles_);
    setup.enter_pre_op();
    const std::vector<tmcl::YoubotBoard> boards = tmcl::youbot_boards(kind);
    for (std::size_t slave = 0; slave < boards.size(); ++slave)
      if (boards[slave].kind != tmcl::BoardKind::kPower) add_drive(setup, boards[slave], slave);
    bus_.emplace(std::move(setup).start(boards.size()));
  } catch (const std::exception& error) {
    deactivate();
    throw SetupError("EtherCAT robot", "start up", error.what());
  }
  for (DriveChannel& drive : drives_) drive.attach(*bus_);
  bad_cycles_ = unanswered_cycles_ = 0;
  losses_.clear();
  copy_state();
  reported_ = state_;
  states_.emplace(state_);
  enabled_ = sampled_ = false;
  counted_ = bus_->counters();
  begin_ = clock_.now() - time_by_frames();
  latched_ = {};
}

/// Its firmware, its parameters, and the gripper behind it.
void EthercatRobot::add_drive(ethercat::PreOpBus& setup, const tmcl::YoubotBoard& board, std::size_t slave) {
  tmcl::SetupMailboxTransport transport(setup, slave);
  LinkClock clock(*link_);
  tmcl::Client client(transport, clock);
  const tmcl::FirmwareVersion version = client.version();
  const std::optional<tmcl::Firmware> firmware = tmcl::supported_firmware(version);
  if (!firmware)
    throw SetupError(transport.name(), "check its firmware",
                     "version " + std::to_string(version.version) + " is not supported, only 148 and 200");
  const ethercat::Slave& mapped = setup.slaves()[slave];
  if (mapped.inputs.bytes < tmcl::input_bytes(*firmware) || mapped.outputs.bytes < tmcl::kOutputBytes)
    throw SetupError(transport.name(), "check its process data",
                     "firmware " + std::to_string(version.version) + " has " +
                         std::to_string(tmcl::input_bytes(*firmware)) + " bytes of inputs and " +
                         std::to_string(tmcl::kOutputBytes) + " of outputs, its EEPROM maps " +
                         std::to_string(mapped.inputs.bytes) + " and " +
                         std::to_string(mapped.outputs.bytes));
  const std::vector<tmcl::ParameterSetting>& settings = settings_[drives_.size()];
  for (const tmcl::ParameterSetting& setting : settings) client.set(*setting.parameter, setting.value);
  DriveChannel& drive =
      drives_.emplace_back(DriveChannel::Setup{.board = board,
                                               .slave = slave,
                                               .firmware = *firmware,
                                               .parameters = settings,
                                               .home = options_.home_arms,
                                               .unsigned_current = options_.unsigned_current,
                                               .period = period_});
  if (board.kind == tmcl::BoardKind::kArmJoint && board.index == tmcl::kArmJoints - 1) {
    gripper_faults_.push_back(find_gripper(transport, clock));
    grippers_.emplace_back(drive, gripper_faults_.back().empty(), period_);
  }
}

void EthercatRobot::deactivate() noexcept {
  if (bus_) {
    stop_grippers();
    bus_->leave_op();
  }
  bus_.reset();
  grippers_.clear();
  gripper_faults_.clear();
  drives_.clear();
  link_.reset();
}

/// A moving gripper is stopped by telegrams, which need cycles; INIT alone would let it move on to its end.
void EthercatRobot::stop_grippers() noexcept {
  constexpr int kCycles = 200;
  constexpr nanoseconds kPause = std::chrono::milliseconds(1);
  const auto any_moves = [this] {
    return std::ranges::any_of(grippers_, [](const GripperChannel& gripper) {
      return gripper.sample().state == GripperState::kMoving;
    });
  };
  RobotSample sample;
  std::array<std::uint8_t, ethercat::kMaxFrameBytes> stray{};
  for (int i = 0; i < kCycles && any_moves(); ++i) {
    (void)exchange({}, sample);
    // Waits in the bus' own time, emulated or not; late frames are discarded.
    (void)link_->receive(stray, kPause);
  }
  gripper_left_moving_ = any_moves();
}

CycleStatus EthercatRobot::exchange(const RobotCommand& command, RobotSample& sample) noexcept {
  if (!bus_) {
    sample.enabled = false;
    return {Fault::kNotActive};
  }
  if (!command.enable) latched_ = {};
  if (latched_.ok()) latched_ = check_command(command);
  if (command.enable && latched_.ok())
    prepare();
  else
    switch_off(!command.enable);

  for (std::size_t i = 0; i < drives_.size(); ++i)
    drives_[i].drive(command.joints[i], enabled_ && sampled_, bus_->outputs(drives_[i].slave()));
  nanoseconds earliest = clock_.now();
  bus_->send(earliest);
  nanoseconds stamp = clock_.now();
  const ethercat::CycleResult result = bus_->receive();
  // The answer may have arrived before this thread was scheduled.
  const nanoseconds arrived = std::max(clock_.now() - result.answer_age, earliest);
  stamp = std::min(stamp, arrived);
  nanoseconds latest = arrived;
  if (simulated_) stamp = latest;  // youbot-sim advances until just before it answers
  if (goes_by_frames_) earliest = stamp = latest = begin_ + time_by_frames();

  bool all_fresh = true;
  for (DriveChannel& drive : drives_) {
    drive.serve_mailbox();
    const bool fresh = bus_->health(drive.slave()).inputs_fresh && drive.sense(bus_->inputs(drive.slave()));
    all_fresh = all_fresh && fresh;
  }
  const CycleStatus bus_status = check_bus(result);
  if (latched_.ok()) latched_ = bus_status;
  if (latched_.ok() && command.enable) latched_ = check_drives();
  if (!latched_.ok()) switch_off(!command.enable);
  if (!link_->may_lead_elsewhere() && !bus_->other_master_present()) repair();

  if (all_fresh) {
    sample.stamp = stamp;
    sample.earliest = earliest;
    sample.latest = latest;
    for (std::size_t i = 0; i < drives_.size(); ++i) sample.joints[i] = drives_[i].sample();
  }
  for (std::size_t i = 0; i < grippers_.size(); ++i) {
    grippers_[i].step(command.grippers[i], enabled_);
    sample.grippers[i] = grippers_[i].sample();
  }
  sample.enabled = enabled_;
  sampled_ = enabled_ && (sampled_ || all_fresh);
  copy_state();
  states_->publish(state_);
  return latched_;
}

/// In lock-step, simulated time follows the frames sent, even on the machine's clock.
nanoseconds EthercatRobot::time_by_frames() const noexcept {
  const ethercat::FrameCounters& frames = bus_->counters();
  return static_cast<std::int64_t>(frames.sent - frames.not_sent) * ethercat::kLockStepPeriod;
}

/// Cycle, after the first call: all sizes are then fixed.
void EthercatRobot::copy_state() noexcept {
  bus_->copy_state(state_.bus);
  state_.losses = judged_losses();
  state_.lasting_gap = gap_is_bridged() ? 0 : bad_cycles_;
  state_.link_error = gap_is_bridged() ? 0 : state_.bus.frames.link_error;
  state_.failures.resize(drives_.size());
  for (std::size_t i = 0; i < drives_.size(); ++i) {
    state_.failures[i] = drives_[i].failure();
    state_.without_hall[i] = drives_[i].without_hall();
  }
  state_.grippers.resize(grippers_.size());
  for (std::size_t i = 0; i < grippers_.size(); ++i) state_.grippers[i] = grippers_[i].sample().state;
}

const RobotState& EthercatRobot::newest_state() const noexcept {
  (void)states_->take(reported_);
  return reported_;
}

void EthercatRobot::switch_off(bool by_operator) noexcept {
  enabled_ = false;
  for (DriveChannel& drive : drives_) by_operator ? drive.stand_by() : drive.stop();
}

void EthercatRobot::prepare() noexcept {
  bool all_ready = true;
  for (DriveChannel& drive : drives_) {
    drive.prepare();
    all_ready = all_ready && drive.ready();
  }
  enabled_ = all_ready;
}

CycleStatus EthercatRobot::check_command(const RobotCommand& command) const noexcept {
  for (std::size_t i = 0; i < drives_.size(); ++i)
    if (!std::isfinite(command.joints[i].target))
      return {Fault::kBadCommand, static_cast<std::int8_t>(i),
              static_cast<std::uint32_t>(command.joints[i].mode)};
  for (std::size_t i = 0; i < grippers_.size(); ++i)
    if (command.grippers[i].move && !std::isfinite(command.grippers[i].opening_m))
      return {Fault::kBadCommand};
  return {};
}

/// The slave itself reports that it has left operation. This is never bridged: its outputs no longer act, and
/// the drive's state is lost.
bool has_left(const ethercat::SlaveHealth& health) noexcept {
  switch (health.condition) {
    case ethercat::SlaveCondition::kRestarting:
    case ethercat::SlaveCondition::kNeedsParameters:
    case ethercat::SlaveCondition::kForeign:
    case ethercat::SlaveCondition::kTampered: return true;
    default: break;
  }
  return health.al_error ||
         (health.state != ethercat::AlState::kOp && health.state != ethercat::AlState::kNone);
}

/// The first drive that another master has reconfigured; -1: none.
std::int8_t EthercatRobot::first_tampered() const noexcept {
  const auto found = std::ranges::find_if(drives_, [this](const DriveChannel& drive) {
    return bus_->health(drive.slave()).condition == ethercat::SlaveCondition::kTampered;
  });
  return found == drives_.end() ? std::int8_t{-1} : static_cast<std::int8_t>(found - drives_.begin());
}

/// Health is working counter, AL state and fresh inputs together; a short silence is bridged.
CycleStatus EthercatRobot::check_bus(const ethercat::CycleResult& result) noexcept {
  // A gap that began during another master's presence continues after it has left.
  const CycleStatus gap = bridge(result);
  if (bus_->other_master_present()) return {Fault::kOtherMaster, first_tampered()};
  const CycleStatus loss = check_losses(result);
  // An unbridged gap is a fault of its own; it is not counted again once the bus is back.
  if (!gap.ok()) losses_.clear();
  return gap.ok() ? loss : gap;
}

/// Each gap is short, but there are many.
CycleStatus EthercatRobot::check_losses(const ethercat::CycleResult& result) noexcept {
  const ethercat::FrameCounters before = std::exchange(counted_, bus_->counters());
  losses_.add({.lost = !result.answered,
               .damaged = counted_.malformed != before.malformed || counted_.foreign != before.foreign,
               .incomplete = result.answered && !result.all_operational,
               .late = static_cast<int>(counted_.late - before.late),
               .twice = static_cast<int>(counted_.duplicate - before.duplicate)});
  const BusLosses losses = judged_losses();
  if (losses.level != BusLosses::Level::kFault) return {};
  return {Fault::kFrameLoss, -1, static_cast<std::uint32_t>(losses.cycles)};
}

BusLosses EthercatRobot::judged_losses() const noexcept {
  BusLosses losses = losses_.counts();
  const auto reaches = [](int cycles, double share) {
    return cycles >= share * static_cast<double>(LossWindow::kCycles);
  };
  // Late answers of a simulator on a busy machine, however late, were not lost on a wire.
  const int excused = simulated_ ? std::min(losses.late, losses.lost) : 0;
  using enum BusLosses::Level;
  losses.level = reaches(losses.cycles - excused, options_.loss_fault) ? kFault
                 : reaches(losses.cycles, options_.loss_warning)       ? kWarning
                                                                       : kOk;
  return losses;
}

bool EthercatRobot::gap_is_bridged() const noexcept {
  return bad_cycles_ - std::min(unanswered_cycles_, excused_cycles_) <= tolerated_cycles_;
}

CycleStatus EthercatRobot::bridge(const ethercat::CycleResult& result) noexcept {
  if (result.all_operational) {
    bad_cycles_ = unanswered_cycles_ = 0;
    return {};
  }
  for (std::size_t i = 0; i < drives_.size(); ++i)
    if (has_left(bus_->health(drives_[i].slave())))
      return {Fault::kPartialBus, static_cast<std::int8_t>(i), result.working_counter};
  if (!result.answered) ++unanswered_cycles_;
  ++bad_cycles_;
  if (gap_is_bridged()) return {};
  if (const int error = bus_->counters().link_error; error != 0)
    return {Fault::kLinkDown, -1, static_cast<std::uint32_t>(error)};
  // Mostly silence; missing slaves behind one that answers are a different fault.
  if (simulated_ && 2 * unanswered_cycles_ > bad_cycles_) return {Fault::kSimulatorSilent};
  if (!result.answered) return {Fault::kFrameLost};
  for (std::size_t i = 0; i < drives_.size(); ++i)
    if (bus_->health(drives_[i].slave()).condition != ethercat::SlaveCondition::kOperational)
      return {Fault::kPartialBus, static_cast<std::int8_t>(i), result.working_counter};
  for (std::size_t i = 0; i < drives_.size(); ++i)
    if (!bus_->health(drives_[i].slave()).inputs_fresh)
      return {Fault::kPartialBus, static_cast<std::int8_t>(i), result.working_counter};
  return {Fault::kPartialBus, -1, result.working_counter};
}

CycleStatus EthercatRobot::check_drives() const noexcept {
  for (std::size_t i = 0; i < drives_.size(); ++i)
    if (const JointFault fault = drives_[i].joint_fault(); fault != JointFault::kNone)
      return {Fault::kJointFault, static_cast<std::int8_t>(i), static_cast<std::uint32_t>(fault)};
  return {};
}

/// Brings slaves back to OP with the motors stopped. The next enable restores everything else that a lost
/// drive forgot (counter, commutation, end stop, time-out flag).
void EthercatRobot::repair() noexcept {
  for (std::size_t slave = 0; slave < bus_->size(); ++slave) {
    const ethercat::SlaveCondition condition = bus_->health(slave).condition;
    if (condition == ethercat::SlaveCondition::kStopped || condition == ethercat::SlaveCondition::kTampered)
      bus_->resume(slave);
    if (condition == ethercat::SlaveCondition::kNeedsParameters) restore(slave);
  }
}

void EthercatRobot::restore(std::size_t slave) noexcept {
  for (DriveChannel& drive : drives_) {
    if (drive.slave() != slave) continue;
    if (!drive.restoring())
      for (GripperChannel& gripper : grippers_)
        if (gripper.slave() == slave) gripper.forget();
    if (!drive.restore()) return;
  }
  bus_->resume(slave);
}

std::vector<std::string> EthercatRobot::notes() const {
  std::vector<std::string> notes = sampling_notes(period_);
  if (drives_left_off_ > 0)
    notes.push_back("the bus has more drives than the configured kind: the " +
                    std::to_string(drives_left_off_) + " drives behind those of " + joints_.back().name +
                    ", and a gripper there, stay off");
  return notes;
}

std::string EthercatRobot::explain(const CycleStatus& status) const {
  if (status.fault == Fault::kLinkDown) return link_text(interface_, static_cast<int>(status.detail));
  if (status.fault == Fault::kFrameLoss)
    return loss_text(static_cast<int>(status.detail), options_.loss_fault, period_);
  if (status.fault == Fault::kOtherMaster && states_) return newest_state().bus.other_master.describe();
  return Robot::explain(status);
}

std::optional<BusLosses> EthercatRobot::losses() const {
  if (!bus_) return std::nullopt;
  const RobotState& state = newest_state();
  if (state.lasting_gap == 0) return state.losses;
  // The window restarts after such a gap; during the gap its length is reported.
  const int cycles = std::min(state.lasting_gap, static_cast<int>(LossWindow::kCycles));
  return BusLosses{.cycles = cycles, .lost = cycles, .level = BusLosses::Level::kFault};
}

std::vector<BusDevice> EthercatRobot::devices() const {
  if (!bus_) return {};
  const RobotState& state = newest_state();
  std::vector<BusDevice> devices;
  for (std::size_t i = 0; i < bus_->size(); ++i) {
    const ethercat::SlaveCondition condition = state.bus.health[i].condition;
    devices.push_back({.name = bus_->slave(i).label(),
                       .answers = condition != ethercat::SlaveCondition::kLost,
                       .works = condition == ethercat::SlaveCondition::kOperational});
  }
  return devices;
}

std::vector<std::string> EthercatRobot::device_faults() const {
  if (!bus_) return {};
  const RobotState& state = newest_state();
  std::vector<std::string> lines = bus_->device_faults(state.bus);
  if (state.link_error != 0) lines.insert(lines.begin(), "bus: " + link_text(interface_, state.link_error));
  if (state.losses.level != BusLosses::Level::kOk)
    lines.insert(lines.begin(), "bus: more than " + percent(options_.loss_warning) +
                                    " of the last 1000 cycles had no whole answer: check the cables and the "
                                    "load of this machine");
  for (std::size_t i = 0; i < joints_.size(); ++i)
    if (const std::string failure = describe(state.failures[i]); !failure.empty())
      lines.push_back(joints_[i].name + ": " + failure);
  return lines;
}

std::vector<std::string> EthercatRobot::report() const {
  if (!bus_) {
    if (!gripper_left_moving_) return {};
    return {"the gripper did not acknowledge its stop and may go on to its end: keep away from it"};
  }
  const RobotState& state = newest_state();
  std::vector<std::string> lines = bus_->findings(state.bus);
  for (std::size_t i = 0; i < joints_.size(); ++i)
    if (const std::string failure = describe(state.failures[i]); !failure.empty())
      lines.push_back(joints_[i].name + ": " + failure);
  for (std::size_t i = 0; i < joints_.size(); ++i)
    if (state.without_hall[i])
      lines.push_back(
          joints_[i].name +
          ": its drive refuses to report its Hall sensors (parameter 210), which would check its encoder");
  for (std::size_t arm = 0; arm < state.grippers.size(); ++arm)
    if (state.grippers[arm] == GripperState::kAbsent)
      lines.push_back("arm " + std::to_string(arm + 1) + " works without gripper: " + gripper_faults_[arm]);
  if (state.losses.cycles > 0) lines.push_back(losses_text(state.losses));
  lines.push_back(ethercat::Diagnostics::summary(state.bus.frames, state.bus.counts.round_trips));
  return lines;
}

}  // namespace

std::string check(const EthercatOptions::Parameter& parameter) {
  const tmcl::AxisParameter* const known = tmcl::find_drive_parameter(parameter.name);
  if (known == nullptr) return "is unknown to the drives; youbot-bench parameters lists theirs";
  if (!tmcl::writable(known->access)) return "can only be read";
  // Parameters that are not settings move the motor, change its counter or start an action as soon as they
  // are written: before the robot is enabled.
  const bool is_setting =
      tmcl::storable(known->access) || known->number == tmcl::drive_parameter("pwm_limit").number;
  if (!is_setting) return "is a command, not a setting";
  if (known->protection == tmcl::Protection::kPassword) return "is protected by the manufacturer's password";
  if (!known->in_range(parameter.value))
    return "must be " + std::to_string(known->min) + " to " + std::to_string(known->max) + ", not " +
           std::to_string(parameter.value);
  return {};
}

std::unique_ptr<Robot> make_ethercat_robot(std::function<std::unique_ptr<ethercat::Link>()> open_link,
                                           const EthercatOptions& options, const Clock& clock,
                                           nanoseconds period) {
  return std::make_unique<EthercatRobot>(std::move(open_link), options, clock, period);
}

std::unique_ptr<Robot> make_ethercat_robot(const std::string& interface, const EthercatOptions& options,
                                           const Clock& clock, nanoseconds period) {
  const auto wait =
      options.busy_wait ? ethercat::RawSocketLink::Wait::kBusy : ethercat::RawSocketLink::Wait::kBlock;
  if (!clock.is_real())
    throw std::invalid_argument(interface + ": a robot needs real time, and the clock is not the machine's");
  return make_ethercat_robot(
      [interface, wait]() -> std::unique_ptr<ethercat::Link> {
        return std::make_unique<ethercat::RawSocketLink>(interface, wait);
      },
      options, clock, period);
}

}  // namespace hal
