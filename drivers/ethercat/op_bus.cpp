#include "drivers/ethercat/op_bus.h"

#include <algorithm>
#include <utility>

#include "drivers/ethercat/bus_error.h"
#include "drivers/ethercat/register_text.h"
#include "drivers/ethercat/registers.h"

namespace drivers::ethercat {
namespace {

using std::chrono::nanoseconds;

// In addition to the image: the state of all, of one slave, and of its place; and one step or mailbox.
constexpr std::size_t kSupervisionBytes = 2 + 6 + 2;
constexpr std::size_t kLongestStep = 22;
// Error counters saturate at 255: often enough for any bus that still works.
constexpr unsigned kCyclesBetweenCounters = 10;
// Time-out per state on the way down, in answered frames; an unanswered one counts for many.
constexpr int kLeaveFrames = 200;
constexpr int kLostLeaveFrame = 20;

/// LRW counts 1 for a read and 2 for a write.
std::uint16_t counter_of(const Slave& slave) noexcept {
  return static_cast<std::uint16_t>((slave.inputs.bytes > 0 ? 1 : 0) + (slave.outputs.bytes > 0 ? 2 : 0));
}

std::size_t bytes_of(const Slave& slave) noexcept {
  return std::size_t{slave.outputs.bytes} + slave.inputs.bytes;
}

bool is_repaired(SlaveCondition condition) noexcept {
  return condition == SlaveCondition::kLost || condition == SlaveCondition::kRestarting ||
         condition == SlaveCondition::kResuming || condition == SlaveCondition::kTampered;
}

std::vector<SetupStep> joined(std::vector<SetupStep> first, const std::vector<SetupStep>& second) {
  first.insert(first.end(), second.begin(), second.end());
  return first;
}

/// If another slave is down for this long, a transition to SAFE-OP is attributed to the watchdog.
constexpr std::chrono::milliseconds kFed = kProcessDataWatchdog / 2;

/// A slave that leaves operation by itself sets its error flag, and one that lost power has no station
/// address. A slave also goes to SAFE-OP when its process data end: only one that received them until now was
/// ordered there.
bool was_ordered_down(const SlaveHealth& health, bool fed) noexcept {
  if (health.al_error) return false;
  switch (health.state) {
    case AlState::kInit:
    case AlState::kPreOp:
    case AlState::kBoot: return true;
    case AlState::kSafeOp: return fed;
    default: return false;
  }
}

/// The fault of a slave that is not operational.
std::string condition_text(const Slave& slave, const SlaveHealth& health, const SlaveSetup& failed_setup) {
  std::string text = slave.label() + ": " + describe(health.condition);
  if (health.condition == SlaveCondition::kTampered)
    text += ": register " + register_text(health.tampered_register);
  if (failed_setup.status() == SlaveSetup::Status::kFailed) text += "; " + failed_setup.failure();
  return text;
}

}  // namespace

const char* describe(SlaveCondition condition) noexcept {
  switch (condition) {
    case SlaveCondition::kOperational: return "operational";
    case SlaveCondition::kLost: return "does not answer: check its power and the cable before it";
    case SlaveCondition::kStopped: return "answers, but is not in OP";
    case SlaveCondition::kRestarting: return "found again, on its way to PRE-OP";
    case SlaveCondition::kNeedsParameters: return "in PRE-OP, waits for its parameters";
    case SlaveCondition::kResuming: return "on its way to OP";
    case SlaveCondition::kForeign: return "another device is in its place";
    case SlaveCondition::kTampered: return "another EtherCAT master wrote its configuration";
  }
  return "in an unknown condition";
}

OpBus::Station::Station(Slave slave)
    : info(std::move(slave)),
      mailbox(info),
      restart_steps(joined(joined(steps_to_identify(info), steps_to_clear(info)), steps_to_pre_op(info))),
      resume_steps(joined(steps_to_safe_op(info), steps_to_op())),
      op_steps(steps_to_op()),
      expected_counter(counter_of(info)),
      at_place(info.station) {}

OpBus::OpBus(std::unique_ptr<Transceiver> transceiver, std::vector<Slave> slaves, const Options& options,
             std::optional<DistributedClocks> clocks)
    : transceiver_(std::move(transceiver)),
      options_(options),
      watch_(slaves),
      diagnostics_(slaves),
      clocks_(std::move(clocks)) {
  if (slaves.empty()) throw BusError(transceiver_->link().name(), "start", "there are no slaves");
  std::size_t image = 0;
  slaves_.reserve(slaves.size());
  for (Slave& slave : slaves) {
    image += bytes_of(slave);
    slaves_.emplace_back(std::move(slave));
  }
  // The image must also fit one frame in its split form, with room for the supervision and repair or mailbox
  // of at least one slave per cycle.
  std::size_t service = kLongestStep;
  for (const Station& station : slaves_)
    if (station.mailbox.exists())
      service = std::max({service, std::size_t{station.info.sii.mailbox_out.length},
                          std::size_t{station.info.sii.mailbox_in.length}});
  const std::size_t frame = kFrameHeaderBytes + image + service + kSupervisionBytes +
                            (clocks_ ? kClockBytes + kDatagramOverheadBytes : 0) +
                            (slaves_.size() + 4) * kDatagramOverheadBytes;
  if (frame > kMaxFrameBytes)
    throw BusError(transceiver_->link().name(), "lay out the process image",
                   std::to_string(image) + " bytes of " + std::to_string(slaves_.size()) +
                       " slaves, with supervision and a mailbox of " + std::to_string(service) +
                       ", need a frame of " + std::to_string(frame) +
                       " bytes: " + std::to_string(kMaxFrameBytes) + " are possible");
  output_image_.resize(image);
  input_image_.resize(image);
  entries_.reserve(4 * slaves_.size() + 4);
  for (Station& station : slaves_)
    station.setup.begin(station.info.station, station.op_steps, options_.step_timeout);
}

std::span<std::uint8_t> OpBus::outputs(std::size_t i) noexcept {
  const ProcessDataWindow& window = slaves_[i].info.outputs;
  return {output_image_.data() + window.image_offset, window.bytes};
}

std::span<const std::uint8_t> OpBus::inputs(std::size_t i) const noexcept {
  const ProcessDataWindow& window = slaves_[i].info.inputs;
  return {input_image_.data() + window.image_offset, window.bytes};
}

void OpBus::send(nanoseconds now) noexcept {
  result_ = {};
  image_whole_ = broadcast_clean_ = chain_whole_ = false;
  for (Station& station : slaves_) {
    station.asked = station.probed = station.placed = station.flowing = station.given = false;
    station.health.inputs_fresh = false;
    result_.expected_working_counter =
        static_cast<std::uint16_t>(result_.expected_working_counter + station.expected_counter);
    if (station.health.condition != SlaveCondition::kOperational) {
      // If it is not operational, it must not find an old set value when it returns.
      const ProcessDataWindow& window = station.info.outputs;
      std::fill_n(output_image_.begin() + window.image_offset, window.bytes, std::uint8_t{0});
    }
  }
  build_frame(now);
  sent_at_ = now;
  sent_ = transceiver_->send();
}

CycleResult OpBus::receive() noexcept {
  result_.answered = sent_ && transceiver_->receive(options_.frame_timeout);
  if (result_.answered) {
    diagnostics_.round_trips().add(transceiver_->round_trip());
    result_.answer_age = transceiver_->answer_age();
    FrameReader answer = transceiver_->answer();
    Datagram datagram;
    for (const Entry& entry : entries_)
      if (answer.next(datagram)) take(entry, datagram, sent_at_);
  } else {
    for (const Entry& entry : entries_)
      if (entry.purpose == Purpose::kMailbox) slaves_[entry.slave].mailbox.frame_lost();
  }
  update_conditions();
  return result_;
}

void OpBus::build_frame(nanoseconds now) noexcept {
  FrameWriter& writer = transceiver_->begin();
  const std::uint8_t index = transceiver_->index();
  entries_.clear();
  // First: datagrams before it delay the time it carries.
  if (clocks_ && clocks_->add(writer, index)) entries_.push_back({Purpose::kClock, 0});
  if (!suspicious_ && !output_image_.empty()) {
    const Datagram image = writer.add(Command::kLrw, index, 0, output_image_.size());
    if (add(Purpose::kImage, 0, image))
      std::copy(output_image_.begin(), output_image_.end(), image.data.begin());
  }
  if (suspicious_)
    for (std::size_t i = 0; i < slaves_.size(); ++i) {
      const Slave& slave = slaves_[i].info;
      const std::size_t bytes = bytes_of(slave);
      if (bytes == 0) continue;
      const std::uint32_t offset = slave.outputs.image_offset;
      const Datagram part = writer.add(Command::kLrw, index, offset, bytes);
      if (add(Purpose::kSlaveImage, i, part))
        std::copy_n(output_image_.begin() + offset, bytes, part.data.begin());
    }
  add(Purpose::kBroadcastState, 0, writer.add(Command::kBrd, index, address_of(0, reg::kAlStatus), 2));

  // In rotation, so that no slave blocks the frame's free room for long: repairs, which are few, then
  // supervision, then mailboxes.
  turn_ = (turn_ + 1) % slaves_.size();
  add_supervision(writer, index, turn_);
  add_service(writer, index, turn_, now);
  const auto add_services = [&](bool repairs) {
    for (std::size_t n = 1; n < slaves_.size(); ++n) {
      const std::size_t i = (turn_ + n) % slaves_.size();
      if (is_repaired(slaves_[i].health.condition) == repairs) add_service(writer, index, i, now);
    }
  };
  add_services(true);
  for (std::size_t n = 1; n < slaves_.size() && suspicious_; ++n)
    add_supervision(writer, index, (turn_ + n) % slaves_.size());
  add_services(false);
  look_due_ = suspicious_ || !look_due_;
  if (look_due_ && watch_.add(writer, index))
    entries_.push_back({Purpose::kLook, static_cast<std::uint16_t>(watch_.next().slave)});
  // Last: without room it waits for the next frame.
  if (++cycles_to_counters_ >= kCyclesBetweenCounters && diagnostics_.add(writer, index)) {
    entries_.push_back({Purpose::kErrorCounters, 0});
    cycles_to_counters_ = 0;
  }
}

bool OpBus::add(Purpose purpose, std::size_t slave, const Datagram& datagram) noexcept {
  if (datagram.counter == nullptr) return false;
  entries_.push_back({purpose, static_cast<std::uint16_t>(slave)});
  return true;
}

void OpBus::add_supervision(FrameWriter& writer, std::uint8_t index, std::size_t i) noexcept {
  const Slave& slave = slaves_[i].info;
  slaves_[i].asked = add(Purpose::kProbe, i,
                         writer.add(Command::kFprd, index, address_of(slave.station, reg::kAlStatus), 6));
  if (!is_sought(slaves_[i])) return;
  // A slave that lost power has lost its address, and another master may give it another address, with which
  // its process data continue: check its place.
  const std::uint16_t place = position_address(static_cast<std::uint16_t>(slave.position - 1));
  add(Purpose::kFind, i, writer.add(Command::kAprd, index, address_of(place, reg::kStationAddress), 2));
}

void OpBus::add_service(FrameWriter& writer, std::uint8_t index, std::size_t i, nanoseconds now) noexcept {
  Station& station = slaves_[i];
  switch (station.health.condition) {
    case SlaveCondition::kForeign: station.mailbox.expire(now); return;
    case SlaveCondition::kTampered:
    case SlaveCondition::kLost:
      station.mailbox.expire(now);
      if (station.found) {
        const std::uint16_t place = position_address(static_cast<std::uint16_t>(station.info.position - 1));
        const Datagram datagram =
            writer.add(Command::kApwr, index, address_of(place, reg::kStationAddress), 2);
        if (add(Purpose::kAddress, i, datagram)) store_le(datagram.data.data(), station.info.station);
      }
      return;
    case SlaveCondition::kRestarting:
    case SlaveCondition::kResuming:
      station.mailbox.expire(now);
      if (station.setup.request(writer, index, now))
        entries_.push_back({Purpose::kSetup, static_cast<std::uint16_t>(i)});
      return;
    case SlaveCondition::kOperational:
    case SlaveCondition::kStopped:
    case SlaveCondition::kNeedsParameters:
      if (station.mailbox.add(writer, index, now))
        entries_.push_back({Purpose::kMailbox, static_cast<std::uint16_t>(i)});
      return;
  }
}

void OpBus::take(const Entry& entry, const Datagram& datagram, nanoseconds now) noexcept {
  Station& station = slaves_[entry.slave];
  const std::uint16_t counter = datagram.working_counter();
  switch (entry.purpose) {
    case Purpose::kImage:
      result_.working_counter = counter;
      image_whole_ = counter == result_.expected_working_counter;
      if (image_whole_) std::copy(datagram.data.begin(), datagram.data.end(), input_image_.begin());
      break;
    case Purpose::kSlaveImage:
      result_.working_counter = static_cast<std::uint16_t>(result_.working_counter + counter);
      station.flowing = counter == station.expected_counter;
      if (station.flowing) accept_inputs(station, datagram.data.subspan(station.info.outputs.bytes));
      break;
    case Purpose::kBroadcastState:
      most_answering_ = std::max(most_answering_, counter);
      chain_whole_ = counter >= slaves_.size() && counter <= slaves_.size() + options_.bystanders;
      broadcast_clean_ =
          counter == slaves_.size() + options_.bystanders && datagram.data[0] == expected_states();
      break;
    case Purpose::kProbe: take_probe(station, datagram); break;
    case Purpose::kMailbox: station.mailbox.answer(datagram); break;
    case Purpose::kSetup: station.setup.answer(datagram, now); break;
    case Purpose::kFind: take_place(station, datagram); break;
    case Purpose::kAddress:
      station.given = counter != 0;
      if (station.given) restart(station);
      break;
    case Purpose::kLook: take_look(station, datagram); break;
    case Purpose::kErrorCounters: diagnostics_.answer(datagram); break;
    case Purpose::kClock: (void)clocks_->answer(datagram); break;
  }
}

void OpBus::take_place(Station& station, const Datagram& datagram) noexcept {
  const auto address = load_le<std::uint16_t>(datagram.data.data());
  station.placed = datagram.working_counter() != 0;
  // The place may be a neighbour's while others are missing: only a device without address is ours.
  if (station.health.condition == SlaveCondition::kLost) station.found = station.placed && address == 0;
  if (!station.placed || station.given) return;
  // Requires a second look, because a byte may be damaged.
  const bool again = std::exchange(station.at_place, address) == address;
  // An address from another master does not prove the identity: that requires all slaves in their places.
  if (station.health.condition == SlaveCondition::kTampered && !(again && chain_whole_))
    station.found = false;
  if (address != 0 && address != station.info.station) station.differs = 0;  // another slave's place
  if (again && is_foreign(station, address)) tamper(station, reg::kStationAddress);
  if (again && address == station.info.station && station.differs != 0)
    tamper(station, std::exchange(station.differs, std::uint16_t{0}));
}

/// Whether to ask the device at its place.
bool OpBus::is_sought(const Station& station) noexcept {
  return station.health.condition == SlaveCondition::kLost ||
         station.health.condition == SlaveCondition::kTampered || station.mute || station.differs != 0 ||
         station.at_place != station.info.station;
}

/// Whether only another master can have given it this address.
bool OpBus::is_foreign(const Station& station, std::uint16_t address) const noexcept {
  // While some are missing, or there is one too many, another slave may be in its place.
  if (address == station.info.station || !chain_whole_) return false;
  // A slave that lost power has no address, but it also lost OP and its part of the image.
  return address != 0 || broadcast_clean_ || station.flowing;
}

/// A master wrote the difference, or it was lost with the power, and with it the address: the place shows
/// which.
void OpBus::take_look(Station& station, const Datagram& datagram) noexcept {
  const std::uint16_t address = watch_.next().written.address;
  const bool differs = watch_.answer(datagram);
  if (address == reg::kStationAddress)
    take_place(station, datagram);
  else if (differs && station.written && chain_whole_ && station.at_place == station.info.station)
    station.differs = address;
}

void OpBus::tamper(Station& station, std::uint16_t register_address) noexcept {
  SlaveHealth& health = station.health;
  if (health.condition == SlaveCondition::kTampered || health.condition == SlaveCondition::kForeign) return;
  if (health.condition == SlaveCondition::kOperational) ++health.times_lost;
  health.condition = SlaveCondition::kTampered;
  health.tampered_register = register_address;
  station.silent_cycles = 0;
  station.found = false;
  station.mailbox.clear();
  // Once: the same difference before it is configured again is not a new order.
  if (std::exchange(station.written, false))
    transceiver_->other_master().note_order({station.info.position, register_address},
                                            transceiver_->link().now());
}

void OpBus::take_probe(Station& station, const Datagram& datagram) noexcept {
  station.mute = datagram.working_counter() == 0;
  if (station.mute) return;
  station.probed = true;
  station.silent_cycles = 0;
  station.health.state = static_cast<AlState>(datagram.data[0] & 0x0F);
  station.health.al_error = (datagram.data[0] & reg::kAlError) != 0;
  station.health.al_code = load_le<std::uint16_t>(&datagram.data[4]);
  if (station.health.condition != SlaveCondition::kLost) return;
  if (station.configured)
    station.health.condition = SlaveCondition::kStopped;
  else
    restart(station);
}

void OpBus::restart(Station& station) noexcept {
  station.configured = station.written = station.found = false;
  station.differs = 0;
  station.silent_cycles = 0;
  station.mailbox.clear();
  station.health.condition = SlaveCondition::kRestarting;
  station.setup.begin(station.info.station, station.restart_steps, options_.step_timeout);
}

void OpBus::accept_inputs(Station& station, std::span<const std::uint8_t> inputs) noexcept {
  // Below SAFE-OP a slave may still answer, with old memory content.
  if (station.health.state != AlState::kSafeOp && station.health.state != AlState::kOp) return;
  std::copy(inputs.begin(), inputs.end(), input_image_.begin() + station.info.inputs.image_offset);
  station.health.inputs_fresh = true;
}

void OpBus::update_conditions() noexcept {
  const bool clean = image_whole_ && broadcast_clean_;
  const nanoseconds now = transceiver_->link().now();
  if (clean) last_clean_ = now;
  const bool fed = last_clean_ && now - *last_clean_ < kFed;
  bool all_operational = true;
  for (Station& station : slaves_) {
    SlaveHealth& health = station.health;
    if (image_whole_ || (bytes_of(station.info) == 0 && (station.probed || broadcast_clean_)))
      health.inputs_fresh = true;
    if (clean) {
      // A bystander's PRE-OP hides another slave's from the broadcast, but not from that slave's own probe.
      const bool hidden = options_.bystanders > 0 && station.probed && health.state == AlState::kPreOp;
      if (!hidden) {
        health.state = AlState::kOp;
        health.al_error = false;
      }
      station.silent_cycles = 0;
    } else if ((station.asked || !result_.answered) && suspicious_ && !station.probed &&
               !(station.placed && health.condition == SlaveCondition::kTampered) &&
               health.condition != SlaveCondition::kLost) {
      if (++station.silent_cycles >= options_.lost_after_cycles) lose(station);
    }
    // It answers without data: are they still mapped?
    const bool starves = station.probed && suspicious_ && bytes_of(station.info) > 0 && !station.flowing;
    if (starves && !station.starved) watch_.suspect(station.info.position - 1U);
    if (starves || station.flowing) station.starved = starves;
    const bool in_op = health.state == AlState::kOp && !health.al_error;
    switch (health.condition) {
      case SlaveCondition::kOperational:
        if (!in_op) {
          health.condition = SlaveCondition::kStopped;
          ++health.times_lost;
          watch_.suspect(station.info.position - 1U);
          if (was_ordered_down(health, fed))
            transceiver_->other_master().note_order({station.info.position, reg::kAlControl}, now);
        }
        break;
      case SlaveCondition::kRestarting:
        if (station.setup.status() == SlaveSetup::Status::kDone) {
          health.condition = SlaveCondition::kNeedsParameters;
          health.state = AlState::kPreOp;  // the probe may be older
          health.al_error = false;
        }
        if (station.setup.status() == SlaveSetup::Status::kFailed) {
          station.failed_setup = station.setup;
          lose(station);
          if (station.setup.is_another_device()) health.condition = SlaveCondition::kForeign;
        }
        break;
      case SlaveCondition::kResuming:
        if (station.setup.status() == SlaveSetup::Status::kDone) {
          health.condition = SlaveCondition::kOperational;
          station.written = true;
          station.failed_setup = {};
          health.state = AlState::kOp;  // the probe may be older
          health.al_error = false;
        }
        if (station.setup.status() == SlaveSetup::Status::kFailed) {
          station.failed_setup = station.setup;
          health.condition = SlaveCondition::kStopped;
        }
        break;
      case SlaveCondition::kNeedsParameters:
        // In INIT the mailbox is disabled, so parameters cannot be written.
        if (station.probed && (health.state != AlState::kPreOp || health.al_error)) restart(station);
        break;
      case SlaveCondition::kLost:
      case SlaveCondition::kStopped:
      case SlaveCondition::kForeign:
      case SlaveCondition::kTampered: break;
    }
    all_operational = all_operational && health.condition == SlaveCondition::kOperational;
  }
  result_.all_operational =
      all_operational && result_.answered && result_.working_counter == result_.expected_working_counter;
  // One clean split frame clears the suspicion; any anomaly sets it.
  suspicious_ = !(all_operational && result_.all_operational && broadcast_clean_);
}

void OpBus::lose(Station& station) noexcept {
  if (station.health.condition == SlaveCondition::kOperational) ++station.health.times_lost;
  station.health.condition = SlaveCondition::kLost;
  station.health.state = AlState::kNone;
  station.found = false;
  station.differs = 0;
  station.mailbox.clear();
}

/// ORed over all.
std::uint8_t OpBus::expected_states() const noexcept {
  const unsigned bystanders = options_.bystanders > 0 ? static_cast<unsigned>(AlState::kPreOp) : 0U;
  return static_cast<std::uint8_t>(static_cast<unsigned>(AlState::kOp) | bystanders);
}

void OpBus::leave_op() noexcept {
  for (const AlState state : {AlState::kSafeOp, AlState::kPreOp, AlState::kInit}) {
    // A request goes to all, and must not take bystanders to a higher state.
    if (state == AlState::kSafeOp && options_.bystanders > 0) continue;
    bool reached = false;
    for (int patience = kLeaveFrames; patience > 0 && !reached; --patience) {
      FrameWriter& writer = transceiver_->begin();
      const std::uint8_t index = transceiver_->index();
      if (!output_image_.empty()) writer.add(Command::kLrw, index, 0, output_image_.size());
      const Datagram request = writer.add(Command::kBwr, index, address_of(0, reg::kAlControl), 2);
      if (request.counter != nullptr) request.data[0] = static_cast<std::uint8_t>(state);
      (void)writer.add(Command::kBrd, index, address_of(0, reg::kAlStatus), 2);
      if (!transceiver_->exchange(options_.frame_timeout)) {
        patience -= kLostLeaveFrame;
        continue;
      }
      FrameReader answer = transceiver_->answer();
      Datagram datagram;
      while (answer.next(datagram))
        if (datagram.command == Command::kBrd)
          // States of all, ORed: a slave above this state is visible.
          reached = (datagram.data[0] & 0x0F) <= static_cast<std::uint8_t>(state);
    }
  }
}

void OpBus::resume(std::size_t i) noexcept {
  Station& station = slaves_[i];
  SlaveHealth& health = station.health;
  if (health.condition == SlaveCondition::kTampered) {
    if (station.at_place != station.info.station)
      station.found = chain_whole_;  // found at its place, it gets its address first
    else
      restart(station);
    return;
  }
  if (health.condition != SlaveCondition::kStopped && health.condition != SlaveCondition::kNeedsParameters)
    return;
  station.configured = true;
  const auto run = [&](const std::vector<SetupStep>& steps) {
    health.condition = SlaveCondition::kResuming;
    station.setup.begin(station.info.station, steps, options_.step_timeout);
  };
  switch (health.state) {
    case AlState::kSafeOp:
    case AlState::kOp:
      // The cause of leaving OP may have been written while it was configured.
      station.written ? run(station.op_steps) : restart(station);
      break;
    case AlState::kPreOp:
      station.written = false;
      run(station.resume_steps);
      break;
    default: restart(station); break;  // it lost its configuration
  }
}

std::string OpBus::failure(std::size_t i) const {
  const SlaveSetup& setup = slaves_[i].failed_setup;
  return setup.status() == SlaveSetup::Status::kFailed ? setup.failure() : std::string();
}

void OpBus::copy_state(BusState& state) const noexcept {
  state.frames = counters();
  state.other_master = other_master();
  state.other_master_present = other_master_present();
  state.counts = diagnostics_.counts();
  state.health.resize(slaves_.size());
  state.failed_setups.resize(slaves_.size());
  for (std::size_t i = 0; i < slaves_.size(); ++i) {
    state.health[i] = slaves_[i].health;
    state.failed_setups[i] = slaves_[i].failed_setup;
  }
  state.most_answering = most_answering_;
}

std::vector<std::string> OpBus::device_faults(const BusState& state) const {
  std::vector<std::string> lines;
  if (state.other_master_present)
    lines.push_back("bus: another EtherCAT master is on it: " + state.other_master.source());
  for (std::size_t i = 0; i < slaves_.size(); ++i) {
    const SlaveHealth& health = state.health[i];
    const bool starting = health.condition == SlaveCondition::kResuming && health.times_lost == 0 &&
                          state.failed_setups[i].status() != SlaveSetup::Status::kFailed;
    if (health.condition != SlaveCondition::kOperational && !starting)
      lines.push_back(condition_text(slaves_[i].info, health, state.failed_setups[i]));
  }
  return lines;
}

std::vector<std::string> OpBus::findings() const {
  BusState now;
  copy_state(now);
  return findings(now);
}

std::vector<std::string> OpBus::findings(const BusState& state) const {
  std::vector<std::string> lines = diagnostics_.findings(state.counts);
  if (state.other_master_present) lines.push_back("bus: " + state.other_master.describe());
  for (std::size_t i = 0; i < slaves_.size(); ++i) {
    const SlaveHealth& health = state.health[i];
    if (health.times_lost > 0)
      lines.push_back(slaves_[i].info.label() + ": left operation " +
                      (health.times_lost == 1 ? "once" : std::to_string(health.times_lost) + " times"));
    if (health.condition != SlaveCondition::kOperational)
      lines.push_back(condition_text(slaves_[i].info, health, state.failed_setups[i]));
  }
  const std::size_t at_start = slaves_.size() + options_.bystanders;
  if (state.most_answering > at_start)
    lines.push_back(std::to_string(state.most_answering) + " slaves answer, " + std::to_string(at_start) +
                    " were there at the start: something was plugged in, and works only after a restart");
  return lines;
}

}  // namespace drivers::ethercat
