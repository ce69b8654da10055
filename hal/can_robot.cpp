#include "hal/can_robot.h"

#include <net/if.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <utility>

#include "drivers/can/interface_bitrate.h"
#include "drivers/can/socket_can.h"
#include "drivers/setup_error.h"
#include "drivers/tmcl/axis_parameters.h"
#include "drivers/tmcl/can_transport.h"
#include "drivers/tmcl/client.h"
#include "drivers/tmcl/commutation.h"
#include "drivers/tmcl/drive_reset.h"
#include "drivers/tmcl/polled_drive.h"
#include "hal/drive_units.h"
#include "hal/hall_reader.h"
#include "hal/newest_value.h"
#include "hal/setup_error.h"

namespace hal {
namespace {

namespace can = drivers::can;
namespace tmcl = drivers::tmcl;
using std::chrono::nanoseconds;

constexpr std::uint8_t kMarkVariable = 55;
constexpr tmcl::Request kStop{tmcl::kDriveModule, tmcl::Command::kMotorStop, 0, 0, 0};

struct KnownModule {
  int controller;
  const char* name;
  bool is_youbots;  ///< youBot firmware: status bit 15 and commutation at start-up
};
constexpr KnownModule kKnownModules[] = {{174, "TMCM-174", true},
                                         {1632, "TMCM-1632", true},
                                         {841, "TMCM-KR-841", true},
                                         {1610, "TMCM-1610", true},
                                         {1630, "TMCM-1630", false}};

const KnownModule* find_module(const tmcl::FirmwareVersion& version) noexcept {
  for (const KnownModule& module : kKnownModules) {
    if (module.controller != version.controller) continue;
    return module.is_youbots && !tmcl::supported_firmware(version) ? nullptr : &module;
  }
  return nullptr;
}

std::string in_words(const tmcl::FirmwareVersion& version) {
  const std::string fraction = std::to_string(100 + version.version % 100).substr(1);
  return "controller " + std::to_string(version.controller) + ", firmware " +
         std::to_string(version.version / 100) + "." + fraction;
}

std::string in_milliseconds(nanoseconds duration) {
  const std::int64_t hundredths = (duration.count() + 9'999) / 10'000;  // rounded up
  return std::to_string(hundredths / 100) + "." + std::to_string(100 + hundredths % 100).substr(1) + " ms";
}

class CanRobot final : public Robot {
 public:
  CanRobot(std::function<can::SocketCan()> open_socket, const CanOptions& options, const Clock& clock,
           nanoseconds period, tmcl::Clock* setup_clock)
      : open_socket_(std::move(open_socket)),
        options_(options),
        clock_(clock),
        period_(period),
        setup_clock_(setup_clock != nullptr ? *setup_clock : machine_clock_),
        units_(options.axis, options.unsigned_current),
        hall_(options.axis.constants, period, 0),
        joints_{joint_info(options.joint_name, options.axis)} {}
  ~CanRobot() override { deactivate(); }

  std::span<const JointInfo> joints() const noexcept override { return joints_; }
  void activate() override;
  void deactivate() noexcept override;
  CycleStatus exchange(const RobotCommand& command, RobotSample& sample) noexcept override;
  std::vector<std::string> notes() const override {
    return sampling_notes(tmcl::PolledDrive::cycles_between_positions(options_.requests_per_cycle) * period_);
  }
  std::vector<std::string> device_faults() const override;
  std::vector<std::string> report() const override;

 private:
  enum class Stage : std::uint8_t { kOff, kClearing, kCommutating, kReady };

  // Setup.
  void check_options() const;
  void check_bitrate() const;
  void identify(tmcl::Client& client);
  void check_encoder(tmcl::Client& client) const;
  void read_all(tmcl::Client& client);
  void try_whole_cycles();

  // Cycle.
  CycleStatus check(const RobotCommand& command) const noexcept;
  CycleStatus check_bus() const noexcept;
  CycleStatus check_drive() const noexcept;
  void take_in(bool answered) noexcept;
  void read_hall() noexcept;
  void switch_off() noexcept;
  void prepare() noexcept;
  void commutate() noexcept;
  void end_sequence() noexcept;
  void run_sequence() noexcept;

  std::function<can::SocketCan()> open_socket_;
  CanOptions options_;
  const Clock& clock_;
  nanoseconds period_;
  tmcl::SteadyClock machine_clock_;
  tmcl::Clock& setup_clock_;
  DriveUnits units_;
  HallReader hall_;
  std::array<JointInfo, 1> joints_;

  std::optional<tmcl::CanTransport> transport_;
  std::string module_name_;  // for messages
  tmcl::Firmware firmware_ = tmcl::Firmware::k148;
  bool is_youbots_ = true;
  std::optional<tmcl::PolledDrive> drive_;  // while active

  Stage stage_ = Stage::kOff;
  bool failed_ = false;  // in its preparation
  // In kClearing one of the resets, in kCommutating the commutation; `running_` points to it.
  std::optional<tmcl::TimeoutReset> timeout_reset_;
  std::optional<tmcl::I2tReset> i2t_reset_;
  std::optional<tmcl::Commutation> commutation_;
  tmcl::Sequence* running_ = nullptr;
  tmcl::DriveOutput output_ = tmcl::kStopMotor;
  tmcl::PositionUnwrapper position_;
  std::int64_t position_ticks_ = 0;
  int silent_cycles_ = 0;
  CycleStatus latched_{};
  struct Reported {
    CycleStatus status;
    bool without_hall = false;
  };
  mutable NewestValue<Reported> states_;  // from the cycle to the reporting thread
  mutable Reported reported_{};
  bool stop_unheard_ = false;   // of the last deactivate()
  bool range_is_lost_ = false;  // the module's count has changed since its range was stated
};

// ---- set-up ----

void CanRobot::activate() {
  deactivate();
  check_options();
  try {
    transport_.emplace(open_socket_(),
                       tmcl::CanIdentifiers{.module = options_.module_id, .reply = options_.reply_id});
    module_name_ = transport_->name();
    check_bitrate();
    tmcl::Client client(*transport_, setup_clock_);
    identify(client);
    tmcl::Request stop = kStop;
    stop.motor = options_.motor;
    client.execute(stop, "stop the motor");
    check_encoder(client);
    client.set_user_variable(kMarkVariable, tmcl::PolledDrive::kMemoryMark);
    try_whole_cycles();
    drive_.emplace(*transport_, tmcl::PolledDriveOptions{.motor = options_.motor,
                                                         .requests_per_cycle = options_.requests_per_cycle,
                                                         .patience_cycles = options_.patience_cycles,
                                                         .mark_variable = kMarkVariable});
    read_all(client);
  } catch (const drivers::SetupError& error) {
    drive_.reset();
    transport_.reset();
    const drivers::SetupError::Report& report = error.report();
    throw SetupError(report.device, report.step,
                     "expected " + report.expected + ", found " + report.found + "; " + report.hint);
  } catch (...) {
    drive_.reset();
    transport_.reset();
    throw;
  }
  stage_ = Stage::kOff;
  failed_ = false;
  output_ = tmcl::kStopMotor;
  silent_cycles_ = 0;
  latched_ = {};
  hall_.forget();
  states_.publish({});
}

void CanRobot::check_options() const {
  const bool sound = options_.requests_per_cycle >= 1 &&
                     options_.requests_per_cycle <= tmcl::PolledDrive::kMaxRequests &&
                     options_.patience_cycles >= 1 && options_.tolerated_cycles >= 0 && period_.count() > 0;
  if (!sound)
    throw SetupError("CAN robot", "check its options",
                     "it takes 1 to 5 requests a cycle, a patience of 1 cycle or more, 0 tolerated cycles or "
                     "more and a period above zero");
}

void CanRobot::check_bitrate() const {
  const can::SocketCan& socket = transport_->socket();
  const auto found = can::interface_bitrate(::if_nametoindex(socket.name().c_str()));
  const std::uint32_t bit_per_s = found.value_or(options_.bitrate_bit_per_s);
  if (bit_per_s == 0) return;  // a virtual interface
  const nanoseconds shortest = shortest_can_period(bit_per_s, options_.requests_per_cycle);
  if (period_ >= shortest) return;
  throw SetupError(socket.name(), "check that a cycle fits on the bus",
                   std::to_string(options_.requests_per_cycle) + " requests and replies a cycle at " +
                       std::to_string(bit_per_s) + " bit/s need a period of " + in_milliseconds(shortest) +
                       " or more, and it is " + in_milliseconds(period_) +
                       "; lengthen the period, lower requests_per_cycle, or set module and interface to a "
                       "higher bit rate");
}

void CanRobot::identify(tmcl::Client& client) {
  const tmcl::FirmwareVersion version = client.version();
  const KnownModule* const module = find_module(version);
  if (module == nullptr)
    throw SetupError(module_name_, "identify the module",
                     "it is " + in_words(version) +
                         "; known are TMCM-174, -1632, -KR-841 and -1610 with firmware 1.48 or 2.00, and "
                         "TMCM-1630");
  is_youbots_ = module->is_youbots;
  firmware_ = tmcl::supported_firmware(version).value_or(tmcl::Firmware::k200);
  module_name_ += " (" + std::string(module->name) + ", " + in_words(version) + ")";
}

void CanRobot::check_encoder(tmcl::Client& client) const {
  const std::int32_t expected = options_.axis.constants.ticks_per_motor_rev;
  const std::int32_t found = client.get(tmcl::drive_parameter("encoder_resolution"), options_.motor);
  if (found != expected)
    throw SetupError(module_name_, "check the encoder",
                     "the axis has " + std::to_string(expected) + " ticks a motor turn, the module counts " +
                         std::to_string(found) + " (parameter 250); correct the one that is wrong");
}

void CanRobot::read_all(tmcl::Client& client) {
  tmcl::DriveInput& input = drive_->input();
  const std::uint8_t motor = options_.motor;
  input.position_ticks = client.get(tmcl::drive_parameter("actual_position"), motor);
  input.current_mA = client.get(tmcl::drive_parameter("actual_motor_current"), motor);
  input.velocity_rpm = client.get(tmcl::drive_parameter("actual_speed"), motor);
  input.flags = tmcl::StatusFlags(
      static_cast<std::uint32_t>(client.get(tmcl::drive_parameter("error_and_status"), motor)));
  position_.reset();
  position_ticks_ = position_.update(input.position_ticks);
}

/// Sends a cycle's requests at once, as in operation. Neighbours differ in their command, so that a dropped
/// one shows.
void CanRobot::try_whole_cycles() {
  if (options_.requests_per_cycle == 1) return;
  constexpr int kRounds = 8;
  constexpr nanoseconds kLook = std::chrono::microseconds(100);
  constexpr nanoseconds kLongest = std::chrono::milliseconds(100);
  const tmcl::Request read = tmcl::get(tmcl::drive_parameter("actual_position"), options_.motor);
  nanoseconds best = kLongest;
  for (int round = 0; round < kRounds; ++round) {
    tmcl::RequestBatch batch(kLongest / kLook);
    const nanoseconds begin = setup_clock_.now();
    for (int i = 0; i < options_.requests_per_cycle; ++i)
      (void)batch.post(*transport_, i % 2 == 0 ? tmcl::get_user_variable(kMarkVariable) : read);
    std::size_t answers = 0;
    while (answers == 0 && batch.lost() == 0 && setup_clock_.now() - begin < kLongest) {
      setup_clock_.wait(kLook);
      batch.step(*transport_);
      answers = batch.take().size();
    }
    if (answers != static_cast<std::size_t>(options_.requests_per_cycle))
      throw SetupError(module_name_, "send a cycle's requests at once",
                       "it does not answer " + std::to_string(options_.requests_per_cycle) +
                           " in order; lower requests_per_cycle, to 1 if need be: the TMCL manual wants one "
                           "request at a time");
    best = std::min(best, setup_clock_.now() - begin);
  }
  if (best > options_.patience_cycles * period_)
    throw SetupError(module_name_, "send a cycle's requests at once",
                     "its answers take " + in_milliseconds(best) + ", more than " +
                         std::to_string(options_.patience_cycles) + " periods of " +
                         in_milliseconds(period_) + "; lengthen the period or lower requests_per_cycle");
}

void CanRobot::deactivate() noexcept {
  if (drive_) {
    stop_unheard_ = true;
    drive_->stop();  // immediately; the code below confirms it
    drive_.reset();
    constexpr int kTries = 6;
    try {
      tmcl::Client client(*transport_, setup_clock_,
                          {.timeout = options_.stop_timeout / kTries, .tries = kTries});
      tmcl::Request stop = kStop;
      stop.motor = options_.motor;
      client.execute(stop, "stop the motor");
      stop_unheard_ = false;
    } catch (const std::exception&) {
      // The bus is gone: report() says so.
    }
  }
  transport_.reset();
  end_sequence();
  stage_ = Stage::kOff;
}

// ---- cycle ----

CycleStatus CanRobot::exchange(const RobotCommand& command, RobotSample& sample) noexcept {
  if (!drive_) {
    sample.enabled = false;
    return {Fault::kNotActive};
  }
  const nanoseconds now = clock_.now();
  take_in(drive_->receive());
  const nanoseconds received = clock_.now();

  if (!command.enable) latched_ = {};
  if (latched_.ok()) latched_ = check(command);
  if (latched_.ok()) latched_ = check_bus();
  if (latched_.ok() && command.enable) latched_ = check_drive();

  if (command.enable && latched_.ok()) {
    prepare();
    run_sequence();
    // While preparing, the sequence determines the command.
    if (stage_ == Stage::kReady) {
      output_ = units_.output(command.joints[0], drive_->input(), position_ticks_);
      read_hall();
    }
  } else {
    switch_off();
  }
  drive_->send(output_, now);

  if (drive_->position_is_fresh()) {
    sample.stamp = sample.earliest = drive_->stamp();
    sample.latest = std::max(received - drive_->position_age(), sample.earliest);
    sample.joints[0] = units_.sample(drive_->input(), output_, position_ticks_);
    sample.joints[0].homed = options_.range_is_stated && !range_is_lost_;
    sample.joints[0].rotor = hall_.reading();
  }
  sample.enabled = stage_ == Stage::kReady;
  states_.publish({latched_, hall_.refused()});
  return latched_;
}

void CanRobot::take_in(bool answered) noexcept {
  silent_cycles_ = answered ? 0 : std::min(silent_cycles_ + 1, options_.tolerated_cycles + 1);
  if (drive_->has_restarted()) {
    position_.reset();
    hall_.forget();
    range_is_lost_ = true;
  }
  if (!drive_->position_is_fresh()) return;
  position_ticks_ = position_.update(drive_->input().position_ticks);
  hall_.pass(position_ticks_);
}

/// In the ready drive, which has no sequence that asks. The position of the same answers was taken before the
/// rotor's angle: the next one ends the reading.
void CanRobot::read_hall() noexcept {
  if (const std::optional<tmcl::Completion>& answer = drive_->answer()) hall_.answer(*answer);
  // Repeated for ever, a request that is not answered would take the place of the readings.
  if (hall_.unanswered_cycles() > 2 * options_.patience_cycles) {
    drive_->forget_ask();
    hall_.answer({.request = HallReader::request(), .outcome = tmcl::Outcome::kTimedOut});
  }
  if (!hall_.due()) return;
  tmcl::Request question = HallReader::request();
  question.motor = options_.motor;
  drive_->ask(question);
  hall_.ask();
}

CycleStatus CanRobot::check(const RobotCommand& command) const noexcept {
  if (std::isfinite(command.joints[0].target)) return {};
  return {Fault::kBadCommand, 0, static_cast<std::uint32_t>(command.joints[0].mode)};
}

CycleStatus CanRobot::check_bus() const noexcept {
  const can::SocketCan& socket = transport_->socket();
  const can::BusError& error = socket.bus_error();
  if (silent_cycles_ <= options_.tolerated_cycles && !error.bus_off()) return {};
  return {Fault::kFrameLost, -1,
          (error.classes & 0xFFFFU) | static_cast<std::uint32_t>(socket.last_error()) << 16};
}

CycleStatus CanRobot::check_drive() const noexcept {
  const auto joint_fault = [](JointFault fault) {
    return CycleStatus{Fault::kJointFault, 0, static_cast<std::uint32_t>(fault)};
  };
  if (const auto& refusal = drive_->refusal()) {
    return {Fault::kJointFault, 0,
            static_cast<std::uint32_t>(JointFault::kRefused) |
                static_cast<std::uint32_t>(refusal->reply.status) << 8 |
                std::uint32_t{refusal->request.type} << 16 |
                static_cast<std::uint32_t>(refusal->request.command) << 24};
  }
  if (drive_->has_restarted()) return joint_fault(JointFault::kRestarted);
  if (failed_) return joint_fault(JointFault::kNotInitialized);
  // During preparation, the preparation clears the flags or fails on them.
  if (stage_ != Stage::kReady) return {};
  const tmcl::StatusFlags flags = drive_->input().flags;
  if (const JointFault fault = joint_fault_of(flags); fault != JointFault::kNone) return joint_fault(fault);
  if (is_youbots_ && !flags.has(tmcl::StatusFlag::kInitialized))
    return joint_fault(JointFault::kNotInitialized);
  return {};
}

std::vector<std::string> CanRobot::device_faults() const {
  if (!drive_) return {};
  (void)states_.take(reported_);
  if (reported_.status.ok()) return {};
  return {options_.joint_name + ": " + describe_can(reported_.status)};
}

std::vector<std::string> CanRobot::report() const {
  if (!drive_) {
    if (!stop_unheard_) return {};
    return {options_.joint_name +
            ": the motor stop was not acknowledged, and a module on CAN has no watchdog: " +
            "the motor may still turn; press the emergency stop"};
  }
  std::vector<std::string> lines = device_faults();
  if (reported_.without_hall)
    lines.push_back(options_.joint_name +
                    ": the module refuses to report its Hall sensors (parameter 210), which would check its "
                    "encoder");
  return lines;
}

/// Discards all preparation; sends the stop immediately if the motor may be moving. From then on the stop is
/// among the cycle's requests: every cycle, and after the pause following each silence while there are no
/// answers. More often, the pause would never end, and without it no answer could be distinguished from a
/// late one.
void CanRobot::switch_off() noexcept {
  if (output_ != tmcl::kStopMotor) drive_->stop();
  output_ = tmcl::kStopMotor;
  stage_ = Stage::kOff;
  failed_ = false;
  end_sequence();
  drive_->forget_ask();
  hall_.cancel();
}

void CanRobot::end_sequence() noexcept {
  running_ = nullptr;
  timeout_reset_.reset();
  i2t_reset_.reset();
  commutation_.reset();
}

void CanRobot::prepare() noexcept {
  if (stage_ != Stage::kOff || failed_) return;
  const tmcl::StatusFlags flags = drive_->input().flags;
  if (flags.has(tmcl::StatusFlag::kTimeout)) {
    stage_ = Stage::kClearing;
    running_ = &timeout_reset_.emplace(tmcl::ResetConfig{}, period_);
  } else if (flags.has(tmcl::StatusFlag::kI2tExceeded)) {
    stage_ = Stage::kClearing;
    running_ = &i2t_reset_.emplace(tmcl::ResetConfig{}, period_);
  } else {
    commutate();
  }
}

void CanRobot::commutate() noexcept {
  if (!is_youbots_) {
    stage_ = Stage::kReady;
    return;
  }
  stage_ = Stage::kCommutating;
  tmcl::CommutationConfig config;
  config.firmware = firmware_;
  config.rest = tmcl::kHoldStill;
  running_ = &commutation_.emplace(config, period_);
}

void CanRobot::run_sequence() noexcept {
  if (running_ == nullptr) return;
  const std::optional<tmcl::Completion>& answer = drive_->answer();
  const tmcl::Action action = running_->step(drive_->input(), answer ? &*answer : nullptr);
  if (action.drive) output_ = *action.drive;
  if (action.ask) drive_->ask(*action.ask);
  if (running_->progress() == tmcl::Progress::kFailed) {
    switch_off();
    failed_ = true;  // reported by the next cycle's check
  } else if (running_->progress() == tmcl::Progress::kDone) {
    // After clearing, another flag may be set behind it: prepare() checks.
    stage_ = stage_ == Stage::kClearing ? Stage::kOff : Stage::kReady;
    end_sequence();
  }
}

}  // namespace

std::unique_ptr<Robot> make_can_robot(std::function<can::SocketCan()> open_socket, const CanOptions& options,
                                      const Clock& clock, nanoseconds period, tmcl::Clock* setup_clock) {
  return std::make_unique<CanRobot>(std::move(open_socket), options, clock, period, setup_clock);
}

std::unique_ptr<Robot> make_can_robot(const std::string& interface, const CanOptions& options,
                                      const Clock& clock, nanoseconds period) {
  const can::SocketCanOptions socket{
      .interface = interface, .receive_id = options.reply_id, .bitrate_bit_per_s = options.bitrate_bit_per_s};
  return make_can_robot([socket] { return can::SocketCan(socket); }, options, clock, period);
}

}  // namespace hal
