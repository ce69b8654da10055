/// @file
/// How the bus is doing, always watched: round trips, and what each port of each slave counted as damaged.
///
///   Diagnostics diagnostics(slaves);
///   each cycle:   diagnostics.round_trips().add(time_from_send_to_receive);
///                 now and then: diagnostics.add(writer, index); ... diagnostics.answer(datagram);
///   on demand:    for (const std::string& line : diagnostics.findings()) ...
///                 // "slave 4 (TMCM-1610) port 0: 12 new CRC errors: check the cable from slave 3 (...)"
#pragma once
#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "drivers/ethercat/frame.h"
#include "drivers/ethercat/slave.h"
#include "drivers/ethercat/transceiver.h"
#include "drivers/latency_histogram.h"

namespace drivers::ethercat {

struct PortErrors {
  std::uint64_t invalid_frames = 0;  ///< damaged on the cable into this port: wrong check sequence
  std::uint64_t symbol_errors = 0;   ///< RX_ER of the transceiver, in frames and between them
  std::uint64_t forwarded = 0;       ///< frames that another slave had found damaged before
  std::uint64_t lost_links = 0;
  friend bool operator==(const PortErrors&, const PortErrors&) = default;
};

struct SlaveErrors {
  std::array<PortErrors, 4> ports{};
  std::uint64_t processing_unit = 0;  ///< frames that are no EtherCAT
  std::uint64_t pdi = 0;              ///< accesses by the slave's own processor that failed
  /// How often counts may be missing: a counter stood at its end (255), or went back without us.
  std::uint64_t gaps = 0;
};

/// All that was counted, slave by slave.
struct DiagnosticCounts {
  std::vector<SlaveErrors> total;
  std::vector<SlaveErrors> marked;  ///< total as it was at the last mark
  LatencyHistogram round_trips;
};

inline constexpr std::size_t kErrorRegisterBytes = 0x14;  ///< 0x0300 to 0x0313

/// One slave in turn is asked for its error counters. They end at 255, so past the middle they are cleared by
/// the same datagram that reads them (FPRW). Counted from their last clearing on, which
/// PreOpBus::enter_pre_op() does. Cycle: all but the constructor and what returns text.
class Diagnostics {
 public:
  /// Setup. @param slaves as scanned, with their cabling
  explicit Diagnostics(std::vector<Slave> slaves);

  LatencyHistogram& round_trips() noexcept { return counts_.round_trips; }
  const LatencyHistogram& round_trips() const noexcept { return counts_.round_trips; }

  /// Adds the datagram that asks the slave whose turn it is: 32 bytes. False when it does not fit.
  bool add(FrameWriter& writer, std::uint8_t index) noexcept;
  /// Its answer. A frame that is lost needs no call: the same slave is asked again.
  void answer(const Datagram& datagram) noexcept;
  /// The counters of slave i (from 0) as read; `cleared`: and set to zero by the same access.
  void take(std::size_t i, std::span<const std::uint8_t, kErrorRegisterBytes> registers,
            bool cleared) noexcept;

  std::size_t size() const noexcept { return stations_.size(); }
  /// Since construction.
  const SlaveErrors& errors(std::size_t i) const noexcept { return counts_.total[i]; }
  const DiagnosticCounts& counts() const noexcept { return counts_; }
  /// "New" counts from here.
  void mark() noexcept;
  /// What is new since mark(), in words, with what to check; empty when nothing is.
  std::vector<std::string> findings() const { return findings(counts_); }
  /// The same of a copy of counts(), which another thread may hold while this one goes on counting.
  std::vector<std::string> findings(const DiagnosticCounts& counts) const;
  /// "60000 frames sent: 2 lost, 0 late, 0 duplicate, 0 malformed, 0 foreign, 0 not sent; round trip 38 us at
  /// least,
  /// ..."
  static std::string summary(const FrameCounters& counters, const LatencyHistogram& round_trips);

 private:
  struct Station {
    Slave slave;
    std::array<std::uint8_t, kErrorRegisterBytes> last{};
    bool clear = false;  // at the next look
  };
  std::string far_end(const Slave& slave, std::size_t port) const;

  DiagnosticCounts counts_;
  std::vector<Station> stations_;
  std::size_t turn_ = 0;
};

}  // namespace drivers::ethercat
