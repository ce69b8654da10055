/// @file
/// The bus during set-up: scanned, checked, in PRE-OP, with working mailboxes. Turns into an OpBus.
///
///   PreOpBus setup(link, nullptr, {});                 // throws BusError
///   check_topology(setup.slaves(), expected, "eth0");
///   setup.enter_pre_op();
///   setup.mailbox_exchange(3, request);                // parameters
///   OpBus bus = std::move(setup).start();              // SAFE-OP, then OP
#pragma once
#include <algorithm>
#include <chrono>
#include <cstdint>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "drivers/ethercat/bus_scan.h"
#include "drivers/ethercat/mailbox_line.h"
#include "drivers/ethercat/op_bus.h"
#include "drivers/ethercat/register_access.h"
#include "drivers/ethercat/transceiver.h"

namespace drivers::ethercat {

/// Setup only: everything blocks and throws.
class PreOpBus {
 public:
  struct Options {
    RegisterAccess::Options access{};
    std::chrono::nanoseconds state_timeout = std::chrono::seconds(3);
    std::chrono::nanoseconds mailbox_timeout = std::chrono::milliseconds(500);
    bool distributed_clocks = false;  ///< the youBot's slaves do not work with them
    OpBus::Options cyclic{};
  };

  /// Scans. `link` and `tap` (null: none) must outlive the bus it turns into. @throws BusError.
  PreOpBus(Link& link, FrameTap* tap, const Options& options);

  const std::vector<Slave>& slaves() const noexcept { return slaves_; }

  /// Minimum number of silent cycles before a slave counts as lost; the larger of this and the option
  /// applies.
  void lose_no_sooner_than(int cycles) noexcept {
    options_.cyclic.lost_after_cycles = std::max(options_.cyclic.lost_after_cycles, cycles);
  }

  /// Writes a register of all slaves. @throws BusError if one did not take it.
  void broadcast_write(std::uint16_t address, std::span<const std::uint8_t> data);

  /// Resets every slave to INIT and takes all of them in parallel to PRE-OP.
  /// @throws BusError with slave, requested and actual state, text of the AL status code, elapsed time.
  void enter_pre_op();

  /// One request and its reply through the mailbox of slave i (from 0); the reply is valid until the next
  /// call. An empty request only waits for mail.
  /// @throws BusError if the slave has no mailbox or does not reply in time.
  std::span<const std::uint8_t> mailbox_exchange(std::size_t i, std::span<const std::uint8_t> request);

  /// Sets clocks up if requested, configures process data, takes the first `driven` slaves to SAFE-OP and,
  /// with process data cycling, to OP; the slaves after them stay in PRE-OP.
  /// @throws BusError as enter_pre_op().
  OpBus start(std::size_t driven) &&;
  OpBus start() && { return std::move(*this).start(slaves_.size()); }

 private:
  void run_setups(std::vector<SlaveSetup>& setups);
  std::chrono::nanoseconds now() const noexcept { return transceiver_->link().now(); }

  std::unique_ptr<Transceiver> transceiver_;
  Options options_;
  RegisterAccess access_;
  std::vector<Slave> slaves_;
  std::vector<MailboxLine> mailboxes_;
};

}  // namespace drivers::ethercat
