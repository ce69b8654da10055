/// @file
/// Continuous bus diagnostics: round trips, and the error counters of each port of each slave.
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
  std::uint64_t forwarded = 0;       ///< frames that an earlier slave had already found damaged
  std::uint64_t lost_links = 0;
  friend bool operator==(const PortErrors&, const PortErrors&) = default;
};

struct SlaveErrors {
  std::array<PortErrors, 4> ports{};
  std::uint64_t processing_unit = 0;  ///< frames that are not EtherCAT
  std::uint64_t pdi = 0;              ///< failed accesses by the slave's own processor
  /// Number of times that counts may be missing: a counter was saturated (255), or was reset by another
  /// party.
  std::uint64_t gaps = 0;
};

/// All counts, per slave.
struct DiagnosticCounts {
  std::vector<SlaveErrors> total;
  std::vector<SlaveErrors> marked;  ///< total at the last mark
  LatencyHistogram round_trips;
};

inline constexpr std::size_t kErrorRegisterBytes = 0x14;  ///< 0x0300 to 0x0313

/// Asks one slave in turn for its error counters. They saturate at 255, so past the middle the same datagram
/// that reads them clears them (FPRW). Counts start when PreOpBus::enter_pre_op() clears them. Cycle: all but
/// the constructor and the functions that return text.
class Diagnostics {
 public:
  /// Setup. @param slaves as scanned, with their cabling
  explicit Diagnostics(std::vector<Slave> slaves);

  LatencyHistogram& round_trips() noexcept { return counts_.round_trips; }
  const LatencyHistogram& round_trips() const noexcept { return counts_.round_trips; }

  /// Adds the datagram to the next slave in turn: 32 bytes. False if it does not fit.
  bool add(FrameWriter& writer, std::uint8_t index) noexcept;
  /// Its answer. A lost frame needs no call: the same slave is asked again.
  void answer(const Datagram& datagram) noexcept;
  /// The counters of slave i (from 0) as read; `cleared`: the same access set them to zero.
  void take(std::size_t i, std::span<const std::uint8_t, kErrorRegisterBytes> registers,
            bool cleared) noexcept;

  std::size_t size() const noexcept { return stations_.size(); }
  /// Since construction.
  const SlaveErrors& errors(std::size_t i) const noexcept { return counts_.total[i]; }
  const DiagnosticCounts& counts() const noexcept { return counts_; }
  /// "New" counts start here.
  void mark() noexcept;
  /// Text on what is new since mark(), with advice; empty if nothing is.
  std::vector<std::string> findings() const { return findings(counts_); }
  /// The same for a copy of counts(), which another thread may hold while counting continues.
  std::vector<std::string> findings(const DiagnosticCounts& counts) const;
  /// "60000 frames sent: 2 lost, 0 late, 0 duplicate, 0 malformed, 0 foreign, 0 not sent; round trip 38 us at
  /// least,
  /// ..."
  static std::string summary(const FrameCounters& counters, const LatencyHistogram& round_trips);

 private:
  struct Station {
    Slave slave;
    std::array<std::uint8_t, kErrorRegisterBytes> last{};
    bool clear = false;  // with the next look
  };
  std::string far_end(const Slave& slave, std::size_t port) const;

  DiagnosticCounts counts_;
  std::vector<Station> stations_;
  std::size_t turn_ = 0;
};

}  // namespace drivers::ethercat
