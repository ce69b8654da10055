/// @file
/// One motor controller of the EtherCAT robot: its place on the bus, what it has to be taken through before
/// it obeys, and the conversion between its integers and the joint.
#pragma once
#include <chrono>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "drivers/ethercat/op_bus.h"
#include "drivers/tmcl/arm_homing.h"
#include "drivers/tmcl/commutation.h"
#include "drivers/tmcl/drive_reset.h"
#include "drivers/tmcl/mailbox_transport.h"
#include "drivers/tmcl/parameter_application.h"
#include "drivers/tmcl/process_data.h"
#include "drivers/tmcl/request_queue.h"
#include "drivers/tmcl/youbot_topology.h"
#include "hal/drive_units.h"
#include "hal/ethercat/hall_reader.h"
#include "hal/joint.h"
#include "hal/youbot_axes.h"

namespace hal {

const AxisData& axis_of(const drivers::tmcl::YoubotBoard& board) noexcept;

/// Preparing a drive is a chain; a link that is not needed ends at once:
///   clear the time-out flag, or let the winding cool and clear I²t -> find commutation -> home
/// A drive that lost its power is given its parameters back before, in PRE-OP.
/// Cycle: all but the constructor and attach(). Never moved: sequences point into it.
class DriveChannel {
 public:
  enum class Stage : std::uint8_t { kOff, kRestoring, kClearing, kCommutating, kHoming, kReady };
  struct Setup {
    drivers::tmcl::YoubotBoard board;
    std::size_t slave = 0;  ///< from 0
    drivers::tmcl::Firmware firmware{};
    std::vector<drivers::tmcl::ParameterSetting> parameters;
    bool home = false;
    bool unsigned_current = false;
    std::chrono::nanoseconds period{};
  };
  explicit DriveChannel(Setup setup);
  DriveChannel(const DriveChannel&) = delete;
  DriveChannel& operator=(const DriveChannel&) = delete;
  ~DriveChannel() = default;

  std::size_t slave() const noexcept { return setup_.slave; }
  const drivers::tmcl::YoubotBoard& board() const noexcept { return setup_.board; }
  const drivers::tmcl::DriveInput& input() const noexcept { return input_; }

  /// Setup: `bus` outlives the channel's cycles.
  void attach(drivers::ethercat::OpBus& bus);

  // Whether it obeys. prepare() begins, as soon as the drive's flags are known, and goes on with every call;
  // stop() forgets all preparation, and the motor stops.
  void prepare() noexcept;
  void stop() noexcept;
  /// As stop(), for an operator who has switched the robot off. A drive whose watchdog has run out drives
  /// back to where it was then and holds that place, whatever the command: it would push against whoever
  /// frees a hand or an obstacle. So its flag is cleared, under a commanded stop; after that it is off like
  /// the others.
  void stand_by() noexcept;
  bool ready() const noexcept { return stage_ == Stage::kReady; }
  bool failed() const noexcept { return failed_; }
  /// What keeps it from obeying; kNone too while it is being prepared.
  JointFault joint_fault() const noexcept;
  /// It refuses to report its Hall sensors.
  bool without_hall() const noexcept { return hall_.refused(); }
  /// The last thing that failed and has not succeeded since.
  struct Failure {
    drivers::tmcl::SequenceFault fault = drivers::tmcl::SequenceFault::kNone;
    Stage stage{};
  };
  Failure failure() const noexcept { return failure_; }

  bool restoring() const noexcept { return stage_ == Stage::kRestoring; }
  /// Once a cycle while a drive that lost its memory waits for its parameters: its counter restarts,
  /// nothing that was asked is answered, and its parameters are written again. True when they are all back.
  bool restore() noexcept;

  /// Before the frame: what goes to the drive.
  void drive(const JointCommand& command, bool enabled, std::span<std::uint8_t> pdo) noexcept;
  /// After the frame: what the drive says. False when it cannot be read.
  bool sense(std::span<const std::uint8_t> pdo) noexcept;
  JointSample sample() const noexcept;

  /// After every frame, answered or not: mailbox traffic.
  void serve_mailbox() noexcept;
  /// A request of somebody else through this drive's mailbox. `tag` is not 0 to kOwnTags - 1.
  void ask(const drivers::tmcl::Request& request, std::uint32_t tag) noexcept;
  /// The answer to such a request, once.
  std::optional<drivers::tmcl::Completion> answer_for_others() noexcept;
  static constexpr std::uint32_t kOwnTags = 0x8000'0000;

 private:
  static constexpr std::uint32_t kHallTag = kOwnTags - 1;  // the tags of sequences are below

  void forget() noexcept;
  void begin(Stage stage, drivers::tmcl::Sequence& sequence) noexcept;
  void clear_timeout() noexcept;
  void commutate() noexcept;
  void home_or_finish() noexcept;
  void run_sequence() noexcept;
  void end_sequence() noexcept;

  Setup setup_;
  DriveUnits units_;
  std::optional<drivers::tmcl::MailboxTransport> transport_;
  drivers::tmcl::RequestQueue queue_;

  Stage stage_ = Stage::kOff;
  // One of these at a time: what `running_` points to.
  std::optional<drivers::tmcl::ParameterApplication> restoring_;
  std::optional<drivers::tmcl::TimeoutReset> timeout_reset_;
  std::optional<drivers::tmcl::I2tReset> i2t_reset_;
  std::optional<drivers::tmcl::Commutation> commutation_;
  std::optional<drivers::tmcl::ArmHoming> homing_;
  drivers::tmcl::Sequence* running_ = nullptr;
  std::uint32_t tag_ = 0;  // of the running sequence's requests: a late answer fits no other
  std::optional<drivers::tmcl::Completion> answer_;
  std::optional<drivers::tmcl::Completion> answer_for_others_;
  bool failed_ = false;
  Failure failure_;

  bool sensed_ = false;  // since it last lost its memory
  bool fresh_ = false;   // in the last cycle
  bool homed_ = false;
  drivers::tmcl::DriveInput input_;
  drivers::tmcl::DriveOutput output_ = drivers::tmcl::kStopMotor;
  drivers::tmcl::PositionUnwrapper position_;
  std::int64_t position_ticks_ = 0;
  HallReader hall_;
};

/// Setup: in words, with what to try; empty without one.
std::string describe(const DriveChannel::Failure& failure);

}  // namespace hal
