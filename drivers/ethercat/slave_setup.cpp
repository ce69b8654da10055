#include "drivers/ethercat/slave_setup.h"

#include <algorithm>
#include <cstdio>
#include <utility>

#include "drivers/ethercat/registers.h"

namespace drivers::ethercat {
namespace {

using std::chrono::nanoseconds;

// Types of an FMMU, and its activate register.
constexpr std::uint8_t kFmmuReads = 1;
constexpr std::uint8_t kFmmuWrites = 2;
constexpr std::uint8_t kFmmuEnabled = 1;
// Reads AL control, AL status and its code at once.
constexpr std::size_t kAlRegisters = reg::kAlStatusCode + 2 - reg::kAlControl;
// Control bytes for mailboxes if the SII gives none: mailbox mode, direction, PDI interrupt.
constexpr std::uint8_t kMailboxOutControl = 0x26;
constexpr std::uint8_t kMailboxInControl = 0x22;

SetupStep write(std::uint16_t address, std::uint8_t length) {
  SetupStep step;
  step.address = address;
  step.length = length;
  return step;
}

SetupStep sync_manager(unsigned number, std::uint16_t start, std::uint16_t length, std::uint8_t control) {
  SetupStep step = write(static_cast<std::uint16_t>(reg::kSyncManager + number * reg::kSyncManagerBytes), 8);
  store_le(&step.data[0], start);
  store_le(&step.data[2], length);
  step.data[4] = control;
  step.data[6] = reg::kSyncManagerEnabled;
  return step;
}

SetupStep fmmu(unsigned number, const ProcessDataWindow& window, std::uint8_t type) {
  SetupStep step = write(static_cast<std::uint16_t>(reg::kFmmu + number * reg::kFmmuBytes), 16);
  store_le(&step.data[0], window.image_offset);
  store_le(&step.data[4], window.bytes);
  step.data[6] = 0;  // logical start bit
  step.data[7] = 7;  // logical end bit
  store_le(&step.data[8], window.start);
  step.data[10] = 0;  // physical start bit
  step.data[11] = type;
  step.data[12] = kFmmuEnabled;
  return step;
}

/// Overwrites what another master may have left there.
void add_watchdog(std::vector<SetupStep>& steps) {
  constexpr std::chrono::microseconds kTick{100};
  constexpr std::uint16_t kTickDivider = 2498;  // of 40 ns, plus 2
  for (const auto& [address, value] :
       {std::pair(reg::kWatchdogDivider, kTickDivider),
        std::pair(reg::kWatchdogProcessData, static_cast<std::uint16_t>(kProcessDataWatchdog / kTick))}) {
    steps.push_back(write(address, 2));
    store_le(steps.back().data.data(), value);
  }
}

SetupStep state(AlState wanted) {
  SetupStep step;
  step.state = wanted;
  return step;
}

SetupStep sii(std::uint16_t word, std::uint32_t value) {
  SetupStep step;
  step.sii_word = word;
  step.sii_value = value;
  return step;
}

const char* name_of_identity(std::uint16_t sii_word) noexcept {
  if (sii_word == kSiiVendorWord) return "vendor";
  return sii_word == kSiiProductWord ? "product" : "serial number";
}

}  // namespace

std::vector<SetupStep> steps_to_identify(const Slave& slave) {
  std::vector<SetupStep> steps;
  // Take the EEPROM from the slave's own processor, as the scan does.
  for (const std::uint8_t owner : {std::uint8_t{2}, std::uint8_t{0}}) {
    steps.push_back(write(reg::kSiiConfiguration, 1));
    steps.back().data[0] = owner;
  }
  steps.push_back(sii(kSiiVendorWord, slave.sii.vendor));
  steps.push_back(sii(kSiiProductWord, slave.sii.product));
  steps.push_back(sii(kSiiSerialWord, slave.sii.serial));
  return steps;
}

std::vector<SetupStep> steps_to_pre_op(const Slave& slave) {
  std::vector<SetupStep> steps{state(AlState::kInit)};
  if (slave.mailbox_fits) {
    const auto control = [&](std::size_t number, std::uint8_t fallback) {
      const auto& managers = slave.sii.sync_managers;
      return number < managers.size() && managers[number].control != 0 ? managers[number].control : fallback;
    };
    const MailboxWindow& out = slave.sii.mailbox_out;
    const MailboxWindow& in = slave.sii.mailbox_in;
    steps.push_back(sync_manager(0, out.start, out.length, control(0, kMailboxOutControl)));
    steps.push_back(sync_manager(1, in.start, in.length, control(1, kMailboxInControl)));
  }
  steps.push_back(state(AlState::kPreOp));
  return steps;
}

std::vector<SetupStep> steps_to_clear(const Slave& slave) {
  std::vector<SetupStep> steps{state(AlState::kInit)};
  const auto disable = [&steps](unsigned number) {
    steps.push_back(write(static_cast<std::uint16_t>(reg::kSyncManager + number * reg::kSyncManagerBytes +
                                                     reg::kSyncManagerActivate),
                          1));
  };
  if (slave.mailbox_fits)
    for (const unsigned number : {0U, 1U}) disable(number);
  for (const ProcessDataWindow* window : {&slave.outputs, &slave.inputs})
    if (window->bytes > 0) disable(window->sync_manager);
  return steps;
}

std::vector<SetupStep> steps_to_safe_op(const Slave& slave) {
  // FMMUs before the state change: some slaves apply them only then.
  std::vector<SetupStep> steps;
  unsigned next_fmmu = 0;
  for (const auto& [window, type] :
       {std::pair(&slave.outputs, kFmmuWrites), std::pair(&slave.inputs, kFmmuReads)}) {
    if (window->bytes == 0) continue;
    steps.push_back(sync_manager(window->sync_manager, window->start, window->bytes, window->control));
    steps.push_back(fmmu(next_fmmu++, *window, type));
  }
  if (slave.outputs.bytes > 0) add_watchdog(steps);
  steps.push_back(state(AlState::kSafeOp));
  return steps;
}

std::vector<SetupStep> steps_to_op() { return {state(AlState::kOp)}; }

void SlaveSetup::begin(std::uint16_t station, std::span<const SetupStep> steps,
                       nanoseconds timeout) noexcept {
  station_ = station;
  steps_ = steps;
  timeout_ = timeout;
  step_ = 0;
  started_ = false;
  status_ = steps_.empty() ? Status::kDone : Status::kRunning;
  acknowledge_ = Acknowledge::kNone;
  another_device_ = answered_ = false;
  al_status_ = 0;
  al_code_ = 0;
}

SlaveSetup::Ask SlaveSetup::first_ask() const noexcept {
  const SetupStep& step = steps_[step_];
  if (step.address != 0) return Ask::kWrite;
  return step.sii_word != 0 ? Ask::kSiiRequest : Ask::kStateRequest;
}

bool SlaveSetup::request(FrameWriter& writer, std::uint8_t index, nanoseconds now) noexcept {
  if (status_ != Status::kRunning) return false;
  if (!std::exchange(started_, true)) {
    step_begin_ = now;
    ask_ = first_ask();
  }
  check_timeout(now);
  if (status_ != Status::kRunning) return false;
  const SetupStep& step = steps_[step_];
  const auto write = [&](std::uint16_t address, std::span<const std::uint8_t> data) {
    const Datagram datagram = writer.add(Command::kFpwr, index, address_of(station_, address), data.size());
    if (datagram.counter == nullptr) return false;
    std::copy(data.begin(), data.end(), datagram.data.begin());
    return true;
  };
  const auto read = [&](std::uint16_t address, std::size_t length) {
    return writer.add(Command::kFprd, index, address_of(station_, address), length).counter != nullptr;
  };
  switch (ask_) {
    case Ask::kWrite: return write(step.address, std::span(step.data).first(step.length));
    case Ask::kSiiRequest: {
      std::array<std::uint8_t, 6> command{};
      store_le(&command[0], reg::kSiiReadCommand);
      store_le(&command[2], std::uint32_t{step.sii_word});
      return write(reg::kSiiControl, command);
    }
    case Ask::kSiiClearError: return write(reg::kSiiControl, std::array<std::uint8_t, 2>{});
    case Ask::kSiiRead: return read(reg::kSiiControl, 10);
    case Ask::kStateRequest:
      al_control_ = static_cast<std::uint8_t>(step.state);
      return write(reg::kAlControl, std::array<std::uint8_t, 2>{al_control_});
    case Ask::kStateAcknowledge:
      al_control_ = static_cast<std::uint8_t>((al_status_ & 0x0F) | reg::kAlError);
      return write(reg::kAlControl, std::array<std::uint8_t, 2>{al_control_});
    case Ask::kStateRead: return read(reg::kAlControl, kAlRegisters);
  }
  return false;
}

void SlaveSetup::answer(const Datagram& datagram, nanoseconds now) noexcept {
  if (status_ != Status::kRunning || datagram.working_counter() == 0) return;
  answered_ = true;
  switch (ask_) {
    case Ask::kWrite: advance(now); return;
    case Ask::kSiiRequest: ask_ = Ask::kSiiRead; return;
    case Ask::kSiiClearError: ask_ = Ask::kSiiRequest; return;
    case Ask::kSiiRead: take_sii(datagram, now); return;
    case Ask::kStateRequest:
    case Ask::kStateAcknowledge: ask_ = Ask::kStateRead; return;
    case Ask::kStateRead: take_state(datagram, now); return;
  }
}

void SlaveSetup::take_sii(const Datagram& datagram, nanoseconds now) noexcept {
  const auto status = load_le<std::uint16_t>(datagram.data.data());
  if ((status & reg::kSiiBusy) != 0) return;
  if ((status & reg::kSiiErrors) != 0) {
    ask_ = Ask::kSiiClearError;
    return;
  }
  sii_found_ = load_le<std::uint32_t>(&datagram.data[reg::kSiiData - reg::kSiiControl]);
  if (sii_found_ == steps_[step_].sii_value) {
    advance(now);
    return;
  }
  another_device_ = true;
  fail(now);
}

void SlaveSetup::take_state(const Datagram& datagram, nanoseconds now) noexcept {
  al_status_ = datagram.data[reg::kAlStatus - reg::kAlControl];
  al_code_ = load_le<std::uint16_t>(&datagram.data[reg::kAlStatusCode - reg::kAlControl]);
  const auto reached = static_cast<AlState>(al_status_ & 0x0F);
  const bool error = (al_status_ & reg::kAlError) != 0;
  // The controller drops a write before the firmware has processed the previous one (ESC data sheet section
  // II, 0x0120), but still counts it.
  const bool taken = datagram.data[0] == al_control_;
  if (reached == steps_[step_].state && !error) {
    advance(now);
  } else if (error && acknowledge_ == Acknowledge::kCleared) {
    fail(now);  // the error is about this request
  } else if (error) {
    // Perhaps from before this request. A slow slave takes a while to process the acknowledgement.
    if (acknowledge_ == Acknowledge::kNone || !taken) ask_ = Ask::kStateAcknowledge;
    acknowledge_ = Acknowledge::kAsked;
  } else if (acknowledge_ == Acknowledge::kAsked) {
    acknowledge_ = Acknowledge::kCleared;  // then request the state once more
    ask_ = Ask::kStateRequest;
  } else if (!taken) {
    ask_ = Ask::kStateRequest;
  }
}

void SlaveSetup::advance(nanoseconds now) noexcept {
  step_begin_ = now;
  acknowledge_ = Acknowledge::kNone;
  answered_ = false;
  if (++step_ == steps_.size())
    status_ = Status::kDone;
  else
    ask_ = first_ask();
}

void SlaveSetup::fail(nanoseconds now) noexcept {
  elapsed_ = now - step_begin_;
  status_ = Status::kFailed;
}

void SlaveSetup::check_timeout(nanoseconds now) noexcept {
  if (now - step_begin_ > timeout_) fail(now);
}

std::string SlaveSetup::failure() const {
  const SetupStep& step = steps_[std::min(step_, steps_.size() - 1)];
  const long long milliseconds = std::chrono::duration_cast<std::chrono::milliseconds>(elapsed_).count();
  char text[256];
  if (step.address != 0)
    std::snprintf(text, sizeof text, "write to register 0x%04X: no answer for %lld ms", step.address,
                  milliseconds);
  else if (another_device_)
    std::snprintf(text, sizeof text, "another device is there: %s (SII word 0x%04X) is 0x%08X, not 0x%08X",
                  name_of_identity(step.sii_word), step.sii_word, unsigned{sii_found_},
                  unsigned{step.sii_value});
  else if (step.sii_word != 0)
    std::snprintf(text, sizeof text, "SII word 0x%04X (register 0x%04X): %s for %lld ms", step.sii_word,
                  unsigned{reg::kSiiControl}, answered_ ? "busy or faulty" : "no answer", milliseconds);
  else if (!answered_)
    std::snprintf(text, sizeof text, "%s requested (register 0x%04X): no answer for %lld ms",
                  to_string(step.state), unsigned{reg::kAlControl}, milliseconds);
  else
    std::snprintf(text, sizeof text,
                  "%s refused: it is in %s%s, AL status code (register 0x0134) 0x%04X %s, after %lld ms",
                  to_string(step.state), to_string(static_cast<AlState>(al_status_ & 0x0F)),
                  (al_status_ & reg::kAlError) != 0 ? " with error" : "", al_code_,
                  describe_al_status_code(al_code_), milliseconds);
  return text;
}

}  // namespace drivers::ethercat
