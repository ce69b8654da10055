/// @file
/// The bus in operation: one frame a cycle with process data, mailboxes, supervision and repair.
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

/// How a slave is doing. Only kOperational slaves' outputs act; inputs come from SAFE-OP on.
enum class SlaveCondition : std::uint8_t {
  kOperational,
  kLost,             ///< does not answer
  kStopped,          ///< answers, but is not in OP (watchdog, error of its own)
  kRestarting,       ///< found again, on its way to PRE-OP
  kNeedsParameters,  ///< in PRE-OP, lost its RAM: mailbox works; waits for resume()
  kResuming,         ///< on its way to OP
  kForeign,          ///< another device came in its place; left alone until that is gone
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
  std::chrono::nanoseconds answer_age{};  ///< so long it had been there, unfetched
  std::uint16_t working_counter = 0;
  std::uint16_t expected_working_counter = 0;
};

/// All that a bus can tell of itself, as plain values: a copy may be put in words beside the cycle.
struct BusState {
  FrameCounters frames;
  OtherMaster other_master;
  bool other_master_present = false;
  DiagnosticCounts counts;
  std::vector<SlaveHealth> health;        ///< of each slave
  std::vector<SlaveSetup> failed_setups;  ///< its last one that did, until it is in OP again
  std::uint16_t most_answering = 0;       ///< slaves, to a broadcast, since the start
};

/// One frame per exchange(), which is a send() and its receive():
/// - normally one LRW over the whole image; while anything is wrong, one LRW per slave, so that the working
///   counter tells slave by slave whose data is good (3: read 1 + write 2);
/// - a broadcast read of the AL status, which shows any slave that left OP although it still answers;
/// - one supervision datagram for one slave in turn, for all while something is wrong;
/// - at most one mailbox or repair datagram per slave, in turn, as room permits;
/// - every second time one register that is configured, every time while anything is wrong;
/// - every tenth time the error counters of one slave;
/// - with distributed clocks, before all that, the reference's time to all.
/// A lost slave that answers to its station address again was only out of reach. One that lost its address,
/// and with it its memory, is looked for at its place on the bus, gets the address back, and if vendor and
/// product are right is brought to PRE-OP, where it waits for its parameters and resume(). A slave that fell
/// out of OP with its memory intact waits for resume() alone. One that another master has configured
/// otherwise, whose outputs are zero from then on, is brought back from INIT by resume(), its address given
/// by its place. Cycle-safe after construction; one thread.
class OpBus {
 public:
  struct Options {
    std::chrono::nanoseconds frame_timeout = std::chrono::microseconds(500);
    std::chrono::nanoseconds step_timeout = std::chrono::seconds(3);  ///< of one step to a state
    int lost_after_cycles = 3;  ///< cycles without an answer until a slave counts as lost
    /// Slaves behind these that stay in PRE-OP. They are neither mapped nor supervised: whatever becomes of
    /// them, the others work on.
    std::size_t bystanders = 0;
  };

  /// Slaves are in SAFE-OP and configured; they are taken to OP by the first exchanges.
  /// `clocks`: none unless they have been set up.
  OpBus(std::unique_ptr<Transceiver> transceiver, std::vector<Slave> slaves, const Options& options,
        std::optional<DistributedClocks> clocks = {});

  std::size_t size() const noexcept { return slaves_.size(); }
  const Slave& slave(std::size_t i) const noexcept { return slaves_[i].info; }
  const SlaveHealth& health(std::size_t i) const noexcept { return slaves_[i].health; }

  /// Written before exchange(); zero after construction and while the slave is not operational.
  std::span<std::uint8_t> outputs(std::size_t i) noexcept;
  /// As of the last cycle with SlaveHealth::inputs_fresh.
  std::span<const std::uint8_t> inputs(std::size_t i) const noexcept;
  MailboxLine& mailbox(std::size_t i) noexcept { return slaves_[i].mailbox; }

  /// Sends the frame: from now on its slaves put into it what they have measured. `now` comes from the
  /// caller's clock; the first call after start-up may use another clock, because no time-out is running.
  void send(std::chrono::nanoseconds now) noexcept;
  /// Waits for that frame, and takes in what it brings.
  CycleResult receive() noexcept;
  CycleResult exchange(std::chrono::nanoseconds now) noexcept {
    send(now);
    return receive();
  }
  /// Takes all slaves down to INIT, outputs zero; a few frames for each state, so that it ends without an
  /// answer too, or with the first that has none when silence is final. Nothing is to be exchanged
  /// afterwards.
  void leave_op() noexcept;
  /// Takes slave i from kStopped or kNeedsParameters to OP, from kTampered to kNeedsParameters.
  void resume(std::size_t i) noexcept;
  /// Setup: why an attempt to change the state of slave i failed since it was last in OP, in words; empty if
  /// none did.
  std::string failure(std::size_t i) const;

  const FrameCounters& counters() const noexcept { return transceiver_->counters(); }
  /// Another master was at work within the last second: slaves it has taken are left to it until then.
  bool other_master_present() const noexcept {
    return transceiver_->other_master().present(transceiver_->link().now());
  }
  const OtherMaster& other_master() const noexcept { return transceiver_->other_master(); }
  const Diagnostics& diagnostics() const noexcept { return diagnostics_; }
  /// None when they are off.
  const std::optional<DistributedClocks>& clocks() const noexcept { return clocks_; }

  /// Cycle, once `state` has been through here.
  void copy_state(BusState& state) const noexcept;
  // Setup, and beside the cycle: `state` in words.
  /// Slaves that do not work now, one a line, with what to check; those that have not started yet are none.
  std::vector<std::string> trouble(const BusState& state) const;
  /// What is or was wrong, one finding a line; empty when nothing is.
  std::vector<std::string> findings(const BusState& state) const;
  /// Setup: of now.
  std::vector<std::string> findings() const;

 private:
  /// Why a datagram is in the frame; they come back in order.
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
    SlaveSetup failed_setup;  // the last one that did, until it is in OP again
    SlaveHealth health;
    std::vector<SetupStep> restart_steps;  // to PRE-OP
    std::vector<SetupStep> resume_steps;   // from PRE-OP to OP
    std::vector<SetupStep> op_steps;       // from SAFE-OP to OP
    std::uint16_t expected_counter = 0;
    int silent_cycles = 0;
    bool asked = false;          // for its state, in this frame
    bool probed = false;         // and it answered
    bool mute = false;           // did not answer when it was asked last
    bool given = false;          // its address, in this frame: what the frame read there is older
    bool placed = false;         // something answered at its place, in this frame
    bool flowing = false;        // its part of the image was whole, in this frame
    bool starved = false;        // it answered, and its part was not, in the last frame that told
    bool found = false;          // what answers at its place is to be given its address
    bool configured = true;      // what has its address is the right device, with all it was given
    bool written = true;         // and its registers hold what the steps to SAFE-OP write
    std::uint16_t at_place = 0;  // the address that was seen there last
    std::uint16_t differs = 0;   // a register of what has its address; 0: none
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
  bool suspicious_ = true;                              // look at every slave
  std::size_t turn_ = 0;                                // whose supervision and service comes first
  bool image_whole_ = false;                            // the single LRW had its full counter
  std::optional<std::chrono::nanoseconds> last_clean_;  // when all were in OP
  bool broadcast_clean_ = false;
  bool chain_whole_ = false;          // as many answer as at the start: each one is in its place
  std::uint16_t most_answering_ = 0;  // slaves, to a broadcast, since the start
  unsigned cycles_to_counters_ = 0;
  bool look_due_ = false;
  ConfigurationWatch watch_;
  Diagnostics diagnostics_;
  std::optional<DistributedClocks> clocks_;
  CycleResult result_;
};

}  // namespace drivers::ethercat
