/// @file
/// One motor controller of the EtherCAT robot: its place on the bus, its preparation before it obeys, and the
/// conversion between its integers and the joint.
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
#include "hal/hall_reader.h"
#include "hal/joint.h"
#include "hal/youbot_axes.h"

namespace hal {

const AxisData& axis_of(const drivers::tmcl::YoubotBoard& board) noexcept;

/// Preparing a drive is a chain; a step that is not needed ends at once:
///   clear the time-out flag, or let the winding cool and clear I²t -> find commutation -> home
/// A drive that lost power first gets its parameters back, in PRE-OP.
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

  /// Setup: `bus` must outlive the channel's cycles.
  void attach(drivers::ethercat::OpBus& bus);

  // Preparation. prepare() starts as soon as the drive's flags are known and continues with every call;
  // stop() discards all preparation and stops the motor.
  void prepare() noexcept;
  void stop() noexcept;
  /// Like stop(), after the operator has switched the robot off. A drive whose watchdog has expired drives
  /// back to its position at that time and holds it, whatever the command: it would push against a person who
  /// frees a hand or an obstacle. So its flag is cleared under a commanded stop; after that the drive is off
  /// like the others.
  void stand_by() noexcept;
  bool ready() const noexcept { return stage_ == Stage::kReady; }
  bool failed() const noexcept { return failed_; }
  /// Why it does not obey; kNone also while it is being prepared.
  JointFault joint_fault() const noexcept;
  /// The drive refuses to report its Hall sensors.
  bool without_hall() const noexcept { return hall_.refused(); }
  /// The last step that failed and has not succeeded since.
  struct Failure {
    drivers::tmcl::SequenceFault fault = drivers::tmcl::SequenceFault::kNone;
    Stage stage{};
  };
  Failure failure() const noexcept { return failure_; }

  bool restoring() const noexcept { return stage_ == Stage::kRestoring; }
  /// Once per cycle while a drive that lost its memory waits for its parameters: its counter restarts,
  /// pending requests stay unanswered, and its parameters are written again. Returns true when all are
  /// restored.
  bool restore() noexcept;

  /// Before the frame: the outputs of the drive.
  void drive(const JointCommand& command, bool enabled, std::span<std::uint8_t> pdo) noexcept;
  /// After the frame: the inputs of the drive. False if they cannot be read.
  bool sense(std::span<const std::uint8_t> pdo) noexcept;
  JointSample sample() const noexcept;

  /// After every frame, with or without answer: mailbox traffic.
  void serve_mailbox() noexcept;
  /// Sends a request for another component through this drive's mailbox. `tag` is not 0 to kOwnTags - 1.
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
  // At most one of these is active; `running_` points to it.
  std::optional<drivers::tmcl::ParameterApplication> restoring_;
  std::optional<drivers::tmcl::TimeoutReset> timeout_reset_;
  std::optional<drivers::tmcl::I2tReset> i2t_reset_;
  std::optional<drivers::tmcl::Commutation> commutation_;
  std::optional<drivers::tmcl::ArmHoming> homing_;
  drivers::tmcl::Sequence* running_ = nullptr;
  std::uint32_t tag_ = 0;  // of the running sequence's requests: late answers do not match
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

/// Setup: text with advice; empty if nothing failed.
std::string describe(const DriveChannel::Failure& failure);

}  // namespace hal
