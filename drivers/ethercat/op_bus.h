/// @file
/// The bus in operation: one frame per cycle with process data, mailboxes, supervision and repair.
#pragma once
#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "drivers/ethercat/configuration_watch.h"
#include "drivers/ethercat/diagnostics.h"
#include "drivers/ethercat/distributed_clocks.h"
#include "drivers/ethercat/mailbox_line.h"
#include "drivers/ethercat/slave.h"
#include "drivers/ethercat/slave_setup.h"
#include "drivers/ethercat/transceiver.h"

namespace drivers::ethercat {

/// Condition of a slave. Outputs act only on kOperational slaves; inputs are valid from SAFE-OP on.
enum class SlaveCondition : std::uint8_t {
  kOperational,
  kLost,             ///< does not answer
  kStopped,          ///< answers, but is not in OP (watchdog, or its own error)
  kRestarting,       ///< found again, on the way to PRE-OP
  kNeedsParameters,  ///< in PRE-OP, RAM lost: mailbox works; waits for resume()
  kResuming,         ///< on the way to OP
  kForeign,          ///< another device is in its place; left alone until it is removed
  kTampered,         ///< another master changed its configuration; waits for resume()
};

const char* describe(SlaveCondition condition) noexcept;

struct SlaveHealth {
  SlaveCondition condition = SlaveCondition::kResuming;
  AlState state = AlState::kNone;
  bool al_error = false;
  std::uint16_t al_code = 0;
  bool inputs_fresh = false;            ///< in the last cycle
  std::uint64_t times_lost = 0;         ///< transitions away from kOperational
  std::uint16_t tampered_register = 0;  ///< while kTampered
};

struct CycleResult {
  bool answered = false;  ///< the frame came back
  bool all_operational = false;
  std::chrono::nanoseconds answer_age{};  ///< time that the frame waited before it was fetched
  std::uint16_t working_counter = 0;
  std::uint16_t expected_working_counter = 0;
};

/// State of the bus as plain values: a copy may be turned into text concurrently with the cycle.
struct BusState {
  FrameCounters frames;
  OtherMaster other_master;
  bool other_master_present = false;
  DiagnosticCounts counts;
  std::vector<SlaveHealth> health;        ///< of each slave
  std::vector<SlaveSetup> failed_setups;  ///< last failed set-up of each, until it is in OP again
  std::uint16_t most_answering = 0;       ///< maximum number of slaves that answered a broadcast since the
                                          ///< start
};

/// One frame per exchange(), which is a send() and its receive():
/// - normally one LRW over the whole image; while there is a fault, one LRW per slave, so that the working
///   counter shows for each slave whether its data is good (3: read 1 + write 2);
/// - a broadcast read of the AL status, which shows any slave that left OP although it still answers;
/// - one supervision datagram for one slave in turn, for all slaves while there is a fault;
/// - at most one mailbox or repair datagram per slave, in turn, as room permits;
/// - in every second frame one configured register, in every frame while there is a fault;
/// - in every tenth frame the error counters of one slave;
/// - with distributed clocks, before everything else, the reference time to all.
/// A lost slave that answers to its station address again was only unreachable. A slave that lost its
/// address, and therefore its memory, is searched at its place on the bus and gets the address back. If
/// vendor and product match, it is brought to PRE-OP, where it waits for its parameters and resume(). A slave
/// that left OP with its memory intact waits only for resume(). A slave that another master has reconfigured
/// gets zero outputs; resume() brings it back from INIT and addresses it by its place. Cycle-safe after
/// construction; one thread.
class OpBus {
 public:
  struct Options {
    std::chrono::nanoseconds frame_timeout = std::chrono::microseconds(500);
    std::chrono::nanoseconds step_timeout = std::chrono::seconds(3);  ///< per state change
    int lost_after_cycles = 3;  ///< cycles without an answer before a slave counts as lost
    /// Slaves after the others that stay in PRE-OP. They are neither mapped nor supervised: their failure
    /// does not affect the others.
    std::size_t bystanders = 0;
  };

  /// The slaves must be in SAFE-OP and configured; the first exchanges take them to OP. `clocks`: empty
  /// unless they have been set up.
  OpBus(std::unique_ptr<Transceiver> transceiver, std::vector<Slave> slaves, const Options& options,
        std::optional<DistributedClocks> clocks = {});

  std::size_t size() const noexcept { return slaves_.size(); }
  const Slave& slave(std::size_t i) const noexcept { return slaves_[i].info; }
  const SlaveHealth& health(std::size_t i) const noexcept { return slaves_[i].health; }

  /// Write before exchange(); zero after construction and while the slave is not operational.
  std::span<std::uint8_t> outputs(std::size_t i) noexcept;
  /// From the last cycle with SlaveHealth::inputs_fresh.
  std::span<const std::uint8_t> inputs(std::size_t i) const noexcept;
  MailboxLine& mailbox(std::size_t i) noexcept { return slaves_[i].mailbox; }

  /// Sends the frame; the slaves insert their measurements as it passes. `now` is from the caller's clock;
  /// the first call after start-up may use another clock, because no time-out is running.
  void send(std::chrono::nanoseconds now) noexcept;
  /// Waits for that frame and processes its content.
  CycleResult receive() noexcept;
  CycleResult exchange(std::chrono::nanoseconds now) noexcept {
    send(now);
    return receive();
  }
  /// Takes all slaves down to INIT with outputs zero. Sends a few frames per state, so that it ends without
  /// an answer too, or with the first unanswered frame if silence is final. No exchange is allowed
  /// afterwards.
  void leave_op() noexcept;
  /// Takes slave i from kStopped or kNeedsParameters to OP, or from kTampered to kNeedsParameters.
  void resume(std::size_t i) noexcept;
  /// Setup: text on why a state change of slave i failed since it was last in OP; empty if none failed.
  std::string failure(std::size_t i) const;

  const FrameCounters& counters() const noexcept { return transceiver_->counters(); }
  /// Another master was active within the last second: slaves it has taken are left to it until then.
  bool other_master_present() const noexcept {
    return transceiver_->other_master().present(transceiver_->link().now());
  }
  const OtherMaster& other_master() const noexcept { return transceiver_->other_master(); }
  const Diagnostics& diagnostics() const noexcept { return diagnostics_; }
  /// Empty if off.
  const std::optional<DistributedClocks>& clocks() const noexcept { return clocks_; }

  /// Cycle, once `state` has been filled here before.
  void copy_state(BusState& state) const noexcept;
  // Setup, and concurrently with the cycle: text for `state`.
  /// Slaves that do not work now, one per line, with advice; slaves that have not started yet do not count.
  std::vector<std::string> device_faults(const BusState& state) const;
  /// Current and past faults, one per line; empty if there are none.
  std::vector<std::string> findings(const BusState& state) const;
  /// Setup: for the current state.
  std::vector<std::string> findings() const;

 private:
  /// Why a datagram is in the frame; answers come in the same order.
  enum class Purpose : std::uint8_t {
    kImage,
    kSlaveImage,
    kBroadcastState,
    kProbe,
    kMailbox,
    kSetup,
    kFind,
    kAddress,
    kLook,
    kErrorCounters,
    kClock
  };
  struct Entry {
    Purpose purpose;
    std::uint16_t slave;
  };
  struct Station {
    explicit Station(Slave slave);
    Slave info;
    MailboxLine mailbox;
    SlaveSetup setup;
    SlaveSetup failed_setup;  // last failed set-up, until it is in OP again
    SlaveHealth health;
    std::vector<SetupStep> restart_steps;  // to PRE-OP
    std::vector<SetupStep> resume_steps;   // from PRE-OP to OP
    std::vector<SetupStep> op_steps;       // from SAFE-OP to OP
    std::uint16_t expected_counter = 0;
    int silent_cycles = 0;
    bool asked = false;          // its state, in this frame
    bool probed = false;         // it answered that request
    bool mute = false;           // did not answer its last request
    bool given = false;          // its address was written in this frame: what the frame read there is older
    bool placed = false;         // something answered at its place, in this frame
    bool flowing = false;        // its part of the image was complete, in this frame
    bool starved = false;        // it answered without its part of the image, in the last frame that showed
                                 // it
    bool found = false;          // the device at its place is to get its address
    bool configured = true;      // the device with its address is the right one, with its configuration
    bool written = true;         // its registers hold what the steps to SAFE-OP write
    std::uint16_t at_place = 0;  // the last address read there
    std::uint16_t differs = 0;   // a register of the device with its address; 0: none
  };

  void build_frame(std::chrono::nanoseconds now) noexcept;
  bool add(Purpose purpose, std::size_t slave, const Datagram& datagram) noexcept;
  void add_supervision(FrameWriter& writer, std::uint8_t index, std::size_t i) noexcept;
  void add_service(FrameWriter& writer, std::uint8_t index, std::size_t i,
                   std::chrono::nanoseconds now) noexcept;
  void take(const Entry& entry, const Datagram& datagram, std::chrono::nanoseconds now) noexcept;
  void take_probe(Station& station, const Datagram& datagram) noexcept;
  void take_place(Station& station, const Datagram& datagram) noexcept;
  void take_look(Station& station, const Datagram& datagram) noexcept;
  void accept_inputs(Station& station, std::span<const std::uint8_t> inputs) noexcept;
  void update_conditions() noexcept;
  std::uint8_t expected_states() const noexcept;
  void lose(Station& station) noexcept;
  static bool is_sought(const Station& station) noexcept;
  bool is_foreign(const Station& station, std::uint16_t address) const noexcept;
  void tamper(Station& station, std::uint16_t register_address) noexcept;
  void restart(Station& station) noexcept;

  std::unique_ptr<Transceiver> transceiver_;
  Options options_;
  std::vector<Station> slaves_;
  std::vector<std::uint8_t> output_image_;
  std::vector<std::uint8_t> input_image_;
  std::vector<Entry> entries_;  // of the frame under way; capacity fixed
  std::chrono::nanoseconds sent_at_{};
  bool sent_ = false;
  bool suspicious_ = true;                              // check every slave
  std::size_t turn_ = 0;                                // slave whose supervision and service comes first
  bool image_whole_ = false;                            // the single LRW had its full working counter
  std::optional<std::chrono::nanoseconds> last_clean_;  // last time that all were in OP
  bool broadcast_clean_ = false;
  bool chain_whole_ = false;          // as many answer as at the start: each one is in its place
  std::uint16_t most_answering_ = 0;  // maximum number of slaves that answered a broadcast since the start
  unsigned cycles_to_counters_ = 0;
  bool look_due_ = false;
  ConfigurationWatch watch_;
  Diagnostics diagnostics_;
  std::optional<DistributedClocks> clocks_;
  CycleResult result_;
};

}  // namespace drivers::ethercat
