/// @file
/// Checks that the slaves still hold the configuration of this master.
#pragma once
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "drivers/ethercat/frame.h"
#include "drivers/ethercat/slave.h"
#include "drivers/ethercat/slave_setup.h"

namespace drivers::ethercat {

/// Reads back, one register per look and in rotation, what the steps to SAFE-OP have written, and the station
/// address: another master may write any of it without a trace in the process data. A difference counts only
/// after a second look confirms it, so that a damaged byte does not. Cycle: all but the constructor.
class ConfigurationWatch {
 public:
  struct Look {
    std::size_t slave = 0;  ///< from 0: its place on the bus, used for addressing whatever its station
                            ///< address is
    SetupStep written;
  };

  /// Setup.
  explicit ConfigurationWatch(const std::vector<Slave>& slaves);

  const Look& next() const noexcept { return looks_[turn_]; }
  /// Adds the datagram of next(): 14 to 28 bytes. False if it does not fit.
  bool add(FrameWriter& writer, std::uint8_t index) const noexcept;
  /// Its answer. True if two looks showed the same value and it is not the written one. A lost frame needs no
  /// call: the same register is asked again.
  bool answer(const Datagram& datagram) noexcept;
  /// Looks at this slave next, unless a difference at another look is about to be confirmed.
  void suspect(std::size_t slave) noexcept;

 private:
  void turn_to(std::size_t look) noexcept;

  std::vector<Look> looks_;         // slave by slave
  std::vector<std::size_t> first_;  // look of each slave
  std::size_t turn_ = 0;
  bool doubted_ = false;  // the last look saw `seen_`, which is not the written value
  std::array<std::uint8_t, sizeof(SetupStep::data)> seen_{};
};

}  // namespace drivers::ethercat
