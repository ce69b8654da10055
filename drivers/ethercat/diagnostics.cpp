#include "drivers/ethercat/diagnostics.h"

#include <algorithm>
#include <utility>

#include "drivers/ethercat/registers.h"

namespace drivers::ethercat {
namespace {

using std::chrono::nanoseconds;

constexpr std::uint8_t kCounterEnd = 0xFF;
constexpr std::uint8_t kClearFrom = 0x80;
constexpr std::size_t kPorts = 4;

// Offsets within the registers from 0x0300 on.
constexpr std::size_t kInvalidFrames = 0;  // of port p at 2p, followed by its RX errors
constexpr std::size_t kForwarded = reg::kForwardedErrorCounters - reg::kRxErrorCounters;
constexpr std::size_t kProcessing = reg::kProcessingErrorCounter - reg::kRxErrorCounters;
constexpr std::size_t kPdi = reg::kPdiErrorCounter - reg::kRxErrorCounters;
constexpr std::size_t kLostLinks = reg::kLostLinkCounters - reg::kRxErrorCounters;

std::string counted(std::uint64_t count, const std::string& one, const std::string& more = {}) {
  return std::to_string(count) + " " + (count == 1 ? one : more.empty() ? one + "s" : more);
}

std::string microseconds(nanoseconds duration) {
  return std::to_string((duration.count() + 500) / 1000) + " us";
}

PortErrors difference(const PortErrors& now, const PortErrors& before) noexcept {
  return {now.invalid_frames - before.invalid_frames, now.symbol_errors - before.symbol_errors,
          now.forwarded - before.forwarded, now.lost_links - before.lost_links};
}

}  // namespace

Diagnostics::Diagnostics(std::vector<Slave> slaves)
    : counts_{std::vector<SlaveErrors>(slaves.size()), std::vector<SlaveErrors>(slaves.size()), {}} {
  stations_.reserve(slaves.size());
  for (Slave& slave : slaves) stations_.emplace_back().slave = std::move(slave);
}

bool Diagnostics::add(FrameWriter& writer, std::uint8_t index) noexcept {
  if (stations_.empty()) return false;
  const Station& station = stations_[turn_];
  return writer
             .add(station.clear ? Command::kFprw : Command::kFprd, index,
                  address_of(station.slave.station, reg::kRxErrorCounters), kErrorRegisterBytes)
             .counter != nullptr;
}

void Diagnostics::answer(const Datagram& datagram) noexcept {
  if (stations_.empty() || datagram.data.size() != kErrorRegisterBytes) return;
  const std::size_t i = turn_;
  turn_ = turn_ + 1 < stations_.size() ? turn_ + 1 : 0;
  // 1: read; 3: read and written. A missing slave is left alone until its next turn.
  const std::uint16_t counter = datagram.working_counter();
  if (counter != 1 && counter != 3) return;
  take(i, datagram.data.first<kErrorRegisterBytes>(), datagram.command == Command::kFprw && counter == 3);
}

void Diagnostics::take(std::size_t i, std::span<const std::uint8_t, kErrorRegisterBytes> registers,
                       bool cleared) noexcept {
  Station& station = stations_[i];
  SlaveErrors& total = counts_.total[i];
  bool gap = false;
  bool high = false;
  // A counter that decreased was cleared by a power cycle or another party: its value was counted since then.
  const auto count = [&](std::size_t at, std::uint64_t& sum) {
    const std::uint8_t now = registers[at];
    const std::uint8_t before = station.last[at];
    sum += now >= before ? static_cast<std::uint64_t>(now - before) : now;
    gap = gap || now < before || (now == kCounterEnd && before != kCounterEnd);
    high = high || now >= kClearFrom;
    station.last[at] = cleared ? std::uint8_t{0} : now;
  };
  for (std::size_t port = 0; port < kPorts; ++port) {
    PortErrors& errors = total.ports[port];
    count(kInvalidFrames + 2 * port, errors.invalid_frames);
    count(kInvalidFrames + 2 * port + 1, errors.symbol_errors);
    count(kForwarded + port, errors.forwarded);
    count(kLostLinks + port, errors.lost_links);
  }
  count(kProcessing, total.processing_unit);
  count(kPdi, total.pdi);
  if (gap) ++total.gaps;
  station.clear = high && !cleared;
}

void Diagnostics::mark() noexcept { counts_.marked = counts_.total; }

/// The device at the other end of the cable at a port.
std::string Diagnostics::far_end(const Slave& slave, std::size_t port) const {
  if (port == 0 && slave.parent == 0) return "the master";
  for (const Station& other : stations_) {
    if (port == 0 && other.slave.position == slave.parent)
      return other.slave.label() + " port " + std::to_string(slave.parent_port);
    if (port != 0 && other.slave.parent == slave.position && other.slave.parent_port == port)
      return other.slave.label();
  }
  return {};
}

std::vector<std::string> Diagnostics::findings(const DiagnosticCounts& counts) const {
  bool damage_found = false;  // where a frame was first damaged
  for (std::size_t i = 0; i < stations_.size(); ++i)
    for (std::size_t port = 0; port < kPorts; ++port)
      damage_found = damage_found || counts.total[i].ports[port].invalid_frames !=
                                         counts.marked[i].ports[port].invalid_frames;

  std::vector<std::string> lines;
  for (std::size_t i = 0; i < stations_.size(); ++i) {
    const Station& station = stations_[i];
    const SlaveErrors& total = counts.total[i];
    const SlaveErrors& marked = counts.marked[i];
    const std::string at_least = total.gaps != marked.gaps ? "at least " : "";
    bool damaged_here = false;
    for (std::size_t port = 0; port < kPorts; ++port) {
      const PortErrors errors = difference(total.ports[port], marked.ports[port]);
      const std::string place = station.slave.label() + " port " + std::to_string(port) + ": " + at_least;
      const std::string end = far_end(station.slave, port);
      const std::string cable = end.empty() ? "what is plugged in there" : "the cable from " + end;
      damaged_here = damaged_here || errors.invalid_frames > 0 || errors.forwarded > 0;
      if (errors.invalid_frames > 0)
        lines.push_back(place + counted(errors.invalid_frames, "new CRC error") + ": check " + cable);
      else if (errors.symbol_errors > 0)
        lines.push_back(place + counted(errors.symbol_errors, "new symbol error") +
                        " between frames: check plug and shield of " + cable);
      if (errors.lost_links > 0)
        lines.push_back(place + counted(errors.lost_links, "new lost link") + ": check the plugs of " +
                        cable + (port != 0 && !end.empty() ? " and the power there" : ""));
      if (errors.forwarded > 0 && !damage_found)
        lines.push_back(place + counted(errors.forwarded, "frame") +
                        " came in already damaged: the fault lies farther along, where nothing was counted");
    }
    const std::string place = station.slave.label() + ": " + at_least;
    if (const std::uint64_t bad = total.processing_unit - marked.processing_unit; bad > 0 && !damaged_here)
      lines.push_back(place + counted(bad, "frame") +
                      " without sense: does something else than this master send on the line?");
    if (const std::uint64_t bad = total.pdi - marked.pdi; bad > 0)
      lines.push_back(place + counted(bad, "failed access", "failed accesses") +
                      " by its own processor: the board, not the bus");
  }
  return lines;
}

std::string Diagnostics::summary(const FrameCounters& counters, const LatencyHistogram& round_trips) {
  std::string text = std::to_string(counters.sent) + " frames sent: " + std::to_string(counters.lost) +
                     " lost, " + std::to_string(counters.late) + " late, " +
                     std::to_string(counters.duplicate) + " duplicate, " +
                     std::to_string(counters.malformed) + " malformed, " + std::to_string(counters.foreign) +
                     " foreign, " + std::to_string(counters.not_sent) + " not sent";
  if (round_trips.count() > 0)
    text += "; round trip " + microseconds(round_trips.best()) + " at least, median " +
            microseconds(round_trips.quantile(0.5)) + ", 99.9 % within " +
            microseconds(round_trips.quantile(0.999)) + ", " + microseconds(round_trips.worst()) + " at most";
  return text;
}

}  // namespace drivers::ethercat
