/// @file
/// Whether the slaves still hold what this master has configured.
#pragma once
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "drivers/ethercat/frame.h"
#include "drivers/ethercat/slave.h"
#include "drivers/ethercat/slave_setup.h"

namespace drivers::ethercat {

/// Reads back, one register a look and in turn, what the steps to SAFE-OP have written, and the station
/// address: another master may write any of it without a trace in the process data. Only a difference that a
/// second look confirms counts, so that a byte damaged on the way is none. Cycle: all but the constructor.
class ConfigurationWatch {
 public:
  struct Look {
    std::size_t slave = 0;  ///< from 0: its place on the bus, by which it is asked, whatever address it has
    SetupStep written;
  };

  /// Setup.
  explicit ConfigurationWatch(const std::vector<Slave>& slaves);

  const Look& next() const noexcept { return looks_[turn_]; }
  /// Adds the datagram of next(): 14 to 28 bytes. False when it does not fit.
  bool add(FrameWriter& writer, std::uint8_t index) const noexcept;
  /// Its answer. True when what was asked twice showed the same, and not what was written. A frame that is
  /// lost needs no call: the same is asked again.
  bool answer(const Datagram& datagram) noexcept;
  /// Looks at this slave next, unless it is about to confirm what it saw there.
  void suspect(std::size_t slave) noexcept;

 private:
  void turn_to(std::size_t look) noexcept;

  std::vector<Look> looks_;         // slave by slave
  std::vector<std::size_t> first_;  // look of each slave
  std::size_t turn_ = 0;
  bool doubted_ = false;  // the last look saw `seen_`, which was not written
  std::array<std::uint8_t, sizeof(SetupStep::data)> seen_{};
};

}  // namespace drivers::ethercat
