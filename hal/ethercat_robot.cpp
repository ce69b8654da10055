#include "hal/ethercat_robot.h"

#include <algorithm>
#include <cmath>
#include <deque>
#include <optional>
#include <utility>
#include <vector>

#include "drivers/ethercat/bus_error.h"
#include "drivers/ethercat/pre_op_bus.h"
#include "drivers/ethercat/raw_socket_link.h"
#include "drivers/tmcl/client.h"
#include "drivers/tmcl/commutation.h"
#include "drivers/tmcl/drive_reset.h"
#include "drivers/tmcl/mailbox_transport.h"
#include "drivers/tmcl/process_data.h"
#include "drivers/tmcl/request_queue.h"
#include "drivers/tmcl/youbot_topology.h"
#include "hal/axis_scale.h"
#include "hal/setup_error.h"
#include "hal/youbot_axes.h"

namespace hal {
namespace {

namespace ethercat = drivers::ethercat;
namespace tmcl = drivers::tmcl;
using std::chrono::nanoseconds;

tmcl::YoubotKind kind_of(EthercatOptions::Kind kind) noexcept {
  switch (kind) {
    case EthercatOptions::Kind::kBase: return tmcl::YoubotKind::kBase;
    case EthercatOptions::Kind::kArm: return tmcl::YoubotKind::kArm;
    case EthercatOptions::Kind::kBaseAndArm: return tmcl::YoubotKind::kBaseAndArm;
    case EthercatOptions::Kind::kBaseAndTwoArms: return tmcl::YoubotKind::kBaseAndTwoArms;
  }
  return tmcl::YoubotKind::kBase;
}

const AxisData& axis_of(const tmcl::YoubotBoard& board) noexcept {
  return board.kind == tmcl::BoardKind::kWheel ? kWheelAxis : kArmAxes[static_cast<std::size_t>(board.index)];
}

std::string name_of(const tmcl::YoubotBoard& board) {
  const std::string number = std::to_string(board.index + 1);
  if (board.kind == tmcl::BoardKind::kWheel) return "wheel-" + number;
  return (board.arm == 0 ? "arm-" : "arm2-") + number;
}

JointFault fault_of(tmcl::StatusFlags flags) noexcept {
  using tmcl::StatusFlag;
  constexpr std::array<std::pair<StatusFlag, JointFault>, 9> kFaults{{
      {StatusFlag::kTimeout, JointFault::kCommandTimeout},
      {StatusFlag::kI2tExceeded, JointFault::kI2t},
      {StatusFlag::kUndervoltage, JointFault::kUndervoltage},
      {StatusFlag::kOvervoltage, JointFault::kOvervoltage},
      {StatusFlag::kOvertemperature, JointFault::kOvertemperature},
      {StatusFlag::kHallSensorError, JointFault::kHallSensor},
      {StatusFlag::kEncoderError, JointFault::kEncoder},
      {StatusFlag::kInitializationError, JointFault::kNotInitialized},
      {StatusFlag::kEmergencyStop, JointFault::kEmergencyStop},
  }};
  for (const auto& [flag, fault] : kFaults)
    if (flags.has(flag)) return fault;
  return JointFault::kNone;
}

/// One motor controller, its place on the bus and what it is going through.
class DriveChannel {
 public:
  DriveChannel(const tmcl::YoubotBoard& board, std::size_t slave, tmcl::Firmware firmware, nanoseconds period)
      : slave_(slave),
        firmware_(firmware),
        wheel_(board.kind == tmcl::BoardKind::kWheel),
        scale_(axis_of(board).constants),
        current_limit_mA_(static_cast<std::int32_t>(1000 * axis_of(board).current_limit_A)),
        period_(period) {}

  std::size_t slave() const noexcept { return slave_; }
  bool ready() const noexcept { return stage_ == Stage::kReady; }
  bool failed() const noexcept { return failed_; }
  const tmcl::DriveInput& input() const noexcept { return input_; }

  void attach(ethercat::OpBus& bus) { transport_.emplace(bus.mailbox(slave_), bus.slave(slave_).label()); }

  /// Forgets all preparation: the motor stops.
  void stop() noexcept {
    stage_ = Stage::kOff;
    failed_ = false;
    end_sequences();
    output_ = tmcl::kStopMotor;
  }
  /// Begins to make the drive obey, once its flags are known.
  void prepare() noexcept {
    if (stage_ != Stage::kOff || !sensed_) return;
    queue_.clear();
    failed_ = false;
    if (input_.flags.has(tmcl::StatusFlag::kTimeout)) {
      stage_ = Stage::kClearing;
      reset_.emplace(tmcl::ResetConfig{}, period_);
    } else {
      begin_commutation();
    }
  }

  /// Before the frame: what goes to the drive.
  void drive(const JointCommand& command, bool enabled, std::span<std::uint8_t> pdo) noexcept {
    run_sequence();
    if (enabled && ready()) output_ = output_for(command);
    (void)tmcl::pack(output_, pdo);
  }
  /// After the frame: what the drive says. False when it cannot be read.
  bool sense(std::span<const std::uint8_t> pdo) noexcept {
    if (!tmcl::unpack(firmware_, pdo, input_)) return false;
    position_ticks_ = position_.update(input_.position_ticks);
    sensed_ = true;
    return true;
  }
  /// After every frame, answered or not: mailbox traffic.
  void serve_mailbox() noexcept { queue_.step(*transport_); }

  /// The slave lost its memory: its counter starts again, and nothing that was asked is answered.
  void forget() noexcept {
    position_.reset();
    queue_.clear();
    sensed_ = false;
    stop();
  }

  JointSample sample(bool unsigned_current) const noexcept {
    JointSample sample;
    // The unwrapped counter is beyond int32 after days of driving one way; the scale is linear.
    sample.position_rad = static_cast<double>(position_ticks_) * scale_.position_rad(1);
    sample.velocity_rad_per_s = scale_.velocity_rad_per_s(input_.velocity_rpm);
    const auto sign = unsigned_current ? tmcl::CurrentSign::kAbsolute : tmcl::CurrentSign::kSigned;
    sample.torque_Nm = scale_.torque_Nm(tmcl::signed_current_mA(sign, input_, output_));
    sample.fault = fault_of(input_.flags);
    return sample;
  }

 private:
  enum class Stage : std::uint8_t { kOff, kClearing, kCommutating, kReady };
  static constexpr std::uint32_t kSequenceTag = 1;

  void begin_commutation() noexcept {
    stage_ = Stage::kCommutating;
    tmcl::CommutationConfig config;
    config.firmware = firmware_;
    config.rest = wheel_ ? tmcl::kHoldStill : tmcl::kNoCurrent;
    end_sequences();
    commutation_.emplace(config, period_);
  }

  void end_sequences() noexcept {
    reset_.reset();
    commutation_.reset();
  }

  void run_sequence() noexcept {
    tmcl::Sequence* sequence = nullptr;
    if (reset_) sequence = &*reset_;
    if (commutation_) sequence = &*commutation_;
    std::optional<tmcl::Completion> answer;
    while (auto completion = queue_.pop())
      if (completion->tag == kSequenceTag) answer = completion;
    if (sequence == nullptr) return;

    const tmcl::Action action = sequence->step(input_, answer ? &*answer : nullptr);
    if (action.drive) output_ = *action.drive;
    if (action.ask) (void)queue_.push(*action.ask, kSequenceTag);
    if (sequence->progress() == tmcl::Progress::kFailed) {
      stop();
      failed_ = true;
    } else if (sequence->progress() == tmcl::Progress::kDone) {
      if (stage_ == Stage::kClearing) {
        begin_commutation();
      } else {
        stage_ = Stage::kReady;
        end_sequences();
      }
    }
  }

  tmcl::DriveOutput output_for(const JointCommand& command) const noexcept {
    switch (command.mode) {
      case CommandMode::kTorque:
        return {tmcl::ControllerMode::kCurrent,
                std::clamp(scale_.motor_current_mA(command.target), -current_limit_mA_, current_limit_mA_)};
      case CommandMode::kVelocity: return {tmcl::ControllerMode::kVelocity, scale_.motor_rpm(command.target)};
      case CommandMode::kPosition: {
        // The drive counts modulo 2^32: the distance to go is the same in its counter and in ours.
        const double distance_ticks =
            command.target / scale_.position_rad(1) - static_cast<double>(position_ticks_);
        const auto distance = static_cast<std::int64_t>(std::llround(std::clamp(distance_ticks, -2e9, 2e9)));
        return {tmcl::ControllerMode::kPosition,
                static_cast<std::int32_t>(static_cast<std::uint32_t>(input_.position_ticks) +
                                          static_cast<std::uint32_t>(distance))};
      }
    }
    return tmcl::kStopMotor;
  }

  std::size_t slave_;
  tmcl::Firmware firmware_;
  bool wheel_;
  AxisScale scale_;
  std::int32_t current_limit_mA_;
  nanoseconds period_;
  std::optional<tmcl::MailboxTransport> transport_;
  tmcl::RequestQueue queue_;
  std::optional<tmcl::TimeoutReset> reset_;       // while kClearing
  std::optional<tmcl::Commutation> commutation_;  // while kCommutating
  Stage stage_ = Stage::kOff;
  bool failed_ = false;
  bool sensed_ = false;
  tmcl::DriveInput input_;
  tmcl::DriveOutput output_ = tmcl::kStopMotor;
  tmcl::PositionUnwrapper position_;
  std::int64_t position_ticks_ = 0;
};

class EthercatRobot final : public Robot {
 public:
  using OpenLink = std::function<std::unique_ptr<ethercat::Link>()>;

  EthercatRobot(OpenLink open_link, const EthercatOptions& options, const Clock& clock, nanoseconds period)
      : open_link_(std::move(open_link)), options_(options), clock_(clock), period_(period) {
    for (const tmcl::YoubotBoard& board : tmcl::youbot_boards(kind_of(options.kind))) {
      if (board.kind == tmcl::BoardKind::kPower) continue;
      const AxisData& axis = axis_of(board);
      joints_.push_back({name_of(board), axis.current_limit_A * axis.constants.torque_constant_Nm_per_A *
                                             axis.constants.gear_ratio});
    }
  }
  ~EthercatRobot() override { deactivate(); }

  std::span<const JointInfo> joints() const noexcept override { return joints_; }
  void activate() override;
  void deactivate() noexcept override;
  CycleStatus exchange(const RobotCommand& command, RobotSample& sample) noexcept override;

 private:
  tmcl::Firmware read_firmware(ethercat::PreOpBus& setup, std::size_t slave) const;
  CycleStatus check(const RobotCommand& command) const noexcept;
  CycleStatus check_bus(const ethercat::CycleResult& result) noexcept;
  CycleStatus check_drives() const noexcept;
  void repair() noexcept;
  void prepare_or_stop(bool enable) noexcept;

  OpenLink open_link_;
  EthercatOptions options_;
  const Clock& clock_;
  nanoseconds period_;
  std::vector<JointInfo> joints_;
  std::unique_ptr<ethercat::Link> link_;
  std::optional<ethercat::OpBus> bus_;
  std::deque<DriveChannel> drives_;  // never moved: a transport points into the bus
  bool enabled_ = false;
  int bad_cycles_ = 0;
  CycleStatus latched_{};
};

void EthercatRobot::activate() {
  deactivate();
  try {
    link_ = open_link_();
    ethercat::PreOpBus setup(*link_, options_.tap, {});
    const tmcl::YoubotKind kind = kind_of(options_.kind);
    check_topology(setup.slaves(), tmcl::youbot_topology(kind), link_->name());
    setup.enter_pre_op();
    const std::vector<tmcl::YoubotBoard> boards = tmcl::youbot_boards(kind);
    for (std::size_t slave = 0; slave < boards.size(); ++slave)
      if (boards[slave].kind != tmcl::BoardKind::kPower)
        drives_.emplace_back(boards[slave], slave, read_firmware(setup, slave), period_);
    bus_.emplace(std::move(setup).start());
  } catch (const std::exception& error) {
    drives_.clear();
    throw SetupError("EtherCAT robot", "start up", error.what());
  }
  for (DriveChannel& drive : drives_) drive.attach(*bus_);
  enabled_ = false;
  bad_cycles_ = 0;
  latched_ = {};
}

tmcl::Firmware EthercatRobot::read_firmware(ethercat::PreOpBus& setup, std::size_t slave) const {
  tmcl::SetupMailboxTransport transport(setup, slave);
  tmcl::SteadyClock clock;
  tmcl::Client client(transport, clock);
  const tmcl::FirmwareVersion version = client.version();
  const std::optional<tmcl::Firmware> firmware = tmcl::supported_firmware(version);
  if (!firmware)
    throw SetupError(transport.name(), "check its firmware",
                     "version " + std::to_string(version.version) + " is not supported, only 148 and 200");
  return *firmware;
}

void EthercatRobot::deactivate() noexcept {
  if (bus_) bus_->leave_op();
  bus_.reset();
  drives_.clear();
  link_.reset();
}

CycleStatus EthercatRobot::exchange(const RobotCommand& command, RobotSample& sample) noexcept {
  if (!bus_) {
    sample.enabled = false;
    return {Fault::kNotActive};
  }
  if (!command.enable) latched_ = {};
  if (latched_.ok()) latched_ = check(command);
  prepare_or_stop(command.enable && latched_.ok());

  for (std::size_t i = 0; i < drives_.size(); ++i)
    drives_[i].drive(command.joints[i], enabled_, bus_->outputs(drives_[i].slave()));
  const nanoseconds now = clock_.now();
  const ethercat::CycleResult result = bus_->exchange(now);

  bool all_fresh = true;
  for (DriveChannel& drive : drives_) {
    drive.serve_mailbox();
    const bool fresh = bus_->health(drive.slave()).inputs_fresh && drive.sense(bus_->inputs(drive.slave()));
    all_fresh = all_fresh && fresh;
  }
  const CycleStatus bus_status = check_bus(result);
  if (latched_.ok()) latched_ = bus_status;
  if (latched_.ok() && command.enable) latched_ = check_drives();
  if (!latched_.ok()) prepare_or_stop(false);
  repair();

  if (all_fresh) {
    sample.stamp = now;
    for (std::size_t i = 0; i < drives_.size(); ++i)
      sample.joints[i] = drives_[i].sample(options_.unsigned_current);
  }
  sample.enabled = enabled_;
  return latched_;
}

void EthercatRobot::prepare_or_stop(bool enable) noexcept {
  if (!enable) {
    enabled_ = false;
    for (DriveChannel& drive : drives_) drive.stop();
    return;
  }
  bool all_ready = true;
  for (DriveChannel& drive : drives_) {
    if (!drive.failed()) drive.prepare();
    all_ready = all_ready && drive.ready();
  }
  enabled_ = all_ready;
}

CycleStatus EthercatRobot::check(const RobotCommand& command) const noexcept {
  for (std::size_t i = 0; i < drives_.size(); ++i)
    if (!std::isfinite(command.joints[i].target))
      return {Fault::kBadCommand, static_cast<std::int8_t>(i),
              static_cast<std::uint32_t>(command.joints[i].mode)};
  return {};
}

/// Health is working counter, AL state and fresh inputs together; short disturbances are bridged.
CycleStatus EthercatRobot::check_bus(const ethercat::CycleResult& result) noexcept {
  if (result.all_operational) {
    bad_cycles_ = 0;
    return {};
  }
  if (++bad_cycles_ <= options_.tolerated_cycles) return {};
  if (!result.answered) return {Fault::kFrameLost};
  for (std::size_t i = 0; i < drives_.size(); ++i)
    if (bus_->health(drives_[i].slave()).condition != ethercat::SlaveCondition::kOperational)
      return {Fault::kPartialBus, static_cast<std::int8_t>(i), result.working_counter};
  return {Fault::kPartialBus, -1, result.working_counter};
}

CycleStatus EthercatRobot::check_drives() const noexcept {
  for (std::size_t i = 0; i < drives_.size(); ++i) {
    const DriveChannel& drive = drives_[i];
    JointFault fault = drive.failed() ? JointFault::kNotInitialized : JointFault::kNone;
    // While it is being prepared, flags are what the preparation clears or fails on.
    if (drive.ready()) {
      fault = fault_of(drive.input().flags);
      if (fault == JointFault::kNone && !drive.input().flags.has(tmcl::StatusFlag::kInitialized))
        fault = JointFault::kNotInitialized;
    }
    if (fault != JointFault::kNone)
      return {Fault::kJointFault, static_cast<std::int8_t>(i), static_cast<std::uint32_t>(fault)};
  }
  return {};
}

/// Brings slaves back to OP with the motors stopped. The drives keep their parameters in EEPROM; what a lost
/// slave forgot (counter, commutation, time-out flag) is dealt with when the robot is enabled again.
void EthercatRobot::repair() noexcept {
  for (std::size_t slave = 0; slave < bus_->size(); ++slave) {
    const ethercat::SlaveCondition condition = bus_->health(slave).condition;
    if (condition == ethercat::SlaveCondition::kStopped) bus_->resume(slave);
    if (condition == ethercat::SlaveCondition::kNeedsParameters) {
      for (DriveChannel& drive : drives_)
        if (drive.slave() == slave) drive.forget();
      bus_->resume(slave);
    }
  }
}

}  // namespace

std::unique_ptr<Robot> make_ethercat_robot(std::function<std::unique_ptr<ethercat::Link>()> open_link,
                                           const EthercatOptions& options, const Clock& clock,
                                           nanoseconds period) {
  return std::make_unique<EthercatRobot>(std::move(open_link), options, clock, period);
}

std::unique_ptr<Robot> make_ethercat_robot(const std::string& interface, const EthercatOptions& options,
                                           const Clock& clock, nanoseconds period) {
  const auto wait =
      options.busy_wait ? ethercat::RawSocketLink::Wait::kBusy : ethercat::RawSocketLink::Wait::kBlock;
  return make_ethercat_robot(
      [interface, wait]() -> std::unique_ptr<ethercat::Link> {
        return std::make_unique<ethercat::RawSocketLink>(interface, wait);
      },
      options, clock, period);
}

}  // namespace hal
