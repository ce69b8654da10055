#include "drivers/tmcl/client.h"

#include <algorithm>

namespace drivers::tmcl {
namespace {

using std::to_string;

std::string label(const AxisParameter& parameter, std::uint8_t motor) {
  std::string text = parameter.module == kGripperModule ? "gripper " : "";
  text += std::string(parameter.name) + " (" + to_string(parameter.number) + ")";
  return parameter.module == kGripperModule ? text + " of bar " + to_string(motor + 1) : text;
}

std::string with_unit(std::int32_t value, Unit unit) {
  return unit == Unit::kNone ? to_string(value) : to_string(value) + " " + name(unit);
}

std::string milliseconds(std::chrono::nanoseconds duration) {
  return to_string(std::chrono::duration_cast<std::chrono::milliseconds>(duration).count()) + " ms";
}

std::string words(const Reply& reply) {
  return std::string(name(reply.command)) + ", status " + to_string(static_cast<int>(reply.status)) + " (" +
         describe(reply.status) + "), value " + to_string(reply.value);
}

std::string printable(std::span<const std::uint8_t> text) {
  std::string result;
  for (const std::uint8_t c : text) result += c >= ' ' && c <= '~' ? static_cast<char>(c) : '.';
  return result;
}

const char* advice(Status status) {
  switch (status) {
    case Status::kWrongChecksum:
      return "check cabling and interference, and that the carrier is the right one";
    case Status::kEepromLocked: return "unlock it: set global parameter 73 (bank 0) to 4321";
    case Status::kProtected: return "call approve_protected() with the manufacturer's password first";
    case Status::kInvalidValue:
      return "the drive's own range is narrower than the manual's: try another value";
    case Status::kStoredInProgram:
      return "end the module's download mode (TMCL command 133), or power-cycle it";
    default: return "read the firmware version: this one may lack the parameter or command";
  }
}

// A relative move whose reply was lost would be executed twice.
bool is_repeatable(const Request& request) noexcept {
  return request.command != Command::kMoveToPosition ||
         request.type == static_cast<std::uint8_t>(MoveType::kAbsolute);
}

constexpr char kTimeoutHint[] =
    "check that the module is powered and correctly addressed, and that no other program uses its mailbox";

}  // namespace

Client::Client(Transport& transport, Clock& clock, const ClientOptions& options)
    : transport_(transport), clock_(clock), options_(options) {}

void Client::require(bool condition, const std::string& step, const std::string& expected,
                     const std::string& found, const std::string& hint) const {
  if (!condition) throw SetupError({transport_.name(), step, expected, found, hint});
}

void Client::require_known_to_firmware(const AxisParameter& parameter, const std::string& step) const {
  require(!firmware_ || parameter.exists_in(*firmware_), step, "firmware before 2.0", "firmware 2.0",
          "leave this parameter out");
}

void Client::require_writable(const AxisParameter& parameter, const std::string& step) const {
  require_known_to_firmware(parameter, step);
  require(parameter.protection == Protection::kOpen || approved_, step, "approval for protected parameters",
          "none", "call approve_protected() with the manufacturer's password first");
}

void Client::wait_out_late_replies() noexcept {
  while (late_replies_ > 0 && clock_.now() < late_until_) {
    if (transport_.poll()) {
      --late_replies_;
    } else {
      clock_.wait(options_.poll_interval);
    }
  }
  late_replies_ = 0;
}

Exchange Client::try_once(const Request& request) noexcept {
  const auto deadline = clock_.now() + options_.timeout;
  const Exchange result = exchange(transport_, clock_, request, deadline, options_.poll_interval);
  if (result.posted && !result.reply && !asks_for_text(request)) ++late_replies_;
  late_until_ = deadline + options_.timeout;
  return result;
}

Reply Client::execute(const Request& request, const std::string& step) {
  wait_out_late_replies();
  const int tries = is_repeatable(request) ? std::max(options_.tries, 1) : 1;
  Exchange last;
  for (int i = 0; i < tries; ++i) {
    last = try_once(request);
    if (last.reply) {
      require(accepted(request, *last.reply), step, "status 100 (ok)", words(*last.reply),
              advice(last.reply->status));
      return *last.reply;
    }
  }
  throw SetupError({transport_.name(), step,
                    "a reply within " + milliseconds(options_.timeout) + ", " + to_string(tries) +
                        (tries == 1 ? " try" : " tries"),
                    describe_failure(last), kTimeoutHint});
}

std::string Client::describe_failure(const Exchange& last) const {
  std::string found = last.posted ? "none" : "the request could not be sent";
  if (last.discarded_last) {
    found = to_string(last.discarded) + " that answer something else, the last one " +
            words(*last.discarded_last);
  }
  const std::string fault = transport_.transport_fault();
  return fault.empty() ? found : found + " (" + fault + ")";
}

FirmwareVersion Client::version(std::uint8_t module) {
  wait_out_late_replies();
  const std::string step = "get firmware version";
  const Request request{module, Command::kGetFirmwareVersion, 0, 0, 0};
  Exchange last;
  int tries = 0;
  // Zeros are an answer and may arrive for a long time; silence is not.
  for (int silent = 0; tries < options_.version_tries && silent < std::max(options_.tries, 1); ++tries) {
    last = try_once(request);
    FirmwareVersion version;
    if (last.reply && parse_version(last.reply->text, version) == VersionText::kValid) {
      if (module == kDriveModule) firmware_ = supported_firmware(version);
      return version;
    }
    require(!last.reply, step, "text such as 1610V148", last.reply ? words(*last.reply) : "",
            "check that this module is a TMCL module");
    silent = last.discarded_last ? 0 : silent + 1;
    clock_.wait(options_.poll_interval);
  }
  const std::string found =
      last.discarded_last ? "\"" + printable(last.discarded_last->text) + "\"" : describe_failure(last);
  throw SetupError({transport_.name(), step,
                    "text such as 1610V148, " + to_string(tries) + (tries == 1 ? " try" : " tries"), found,
                    kTimeoutHint});
}

std::int32_t Client::get(const AxisParameter& parameter, std::uint8_t motor) {
  const std::string step = "get " + label(parameter, motor);
  require(readable(parameter.access), step, "a readable parameter", "a write-only one", "only set() it");
  require_known_to_firmware(parameter, step);
  return execute(drivers::tmcl::get(parameter, motor), step).value;
}

void Client::set(const AxisParameter& parameter, std::int32_t value, std::uint8_t motor) {
  // Keeps the password out of messages and logs.
  const bool secret = &parameter == &drive_parameter("approve_protected_parameters");
  const std::string step =
      "set " + label(parameter, motor) + (secret ? "" : " to " + with_unit(value, parameter.unit));
  require(writable(parameter.access), step, "a writable parameter", "a read-only one", "only get() it");
  require(parameter.in_range(value), step,
          to_string(parameter.min) + " to " + with_unit(parameter.max, parameter.unit), to_string(value),
          "correct the value");
  require_writable(parameter, step);
  execute(drivers::tmcl::set(parameter, value, motor), step);
}

void Client::store(const AxisParameter& parameter, std::uint8_t motor) {
  const std::string step = "store " + label(parameter, motor);
  require(storable(parameter.access), step, "a parameter kept in EEPROM", "one that is not",
          "set() it at each start");
  require_writable(parameter, step);
  // According to the manual STAP ignores the value; the official driver sends the value to store. This
  // satisfies both.
  const std::int32_t value = execute(drivers::tmcl::get(parameter, motor), step).value;
  execute({parameter.module, Command::kStoreAxisParameter, parameter.number, motor, value}, step);
}

void Client::restore(const AxisParameter& parameter, std::uint8_t motor) {
  const std::string step = "restore " + label(parameter, motor);
  require(storable(parameter.access), step, "a parameter kept in EEPROM", "one that is not",
          "set() it instead");
  require_writable(parameter, step);
  execute({parameter.module, Command::kRestoreAxisParameter, parameter.number, motor, 0}, step);
}

std::int32_t Client::get_user_variable(std::uint8_t number, std::uint8_t module) {
  return execute(drivers::tmcl::get_user_variable(number, module), "get user variable " + to_string(number))
      .value;
}

void Client::set_user_variable(std::uint8_t number, std::int32_t value, std::uint8_t module) {
  const std::string step = "set user variable " + to_string(number) + " to " + to_string(value);
  require(!user_variable::is_protected(number) || approved_, step, "approval for variables 0 to 15", "none",
          "use 16 or above, or call approve_protected() first");
  execute(drivers::tmcl::set_user_variable(number, value, module), step);
}

void Client::approve_protected(std::int32_t password) {
  set(drive_parameter("approve_protected_parameters"), password);
  approved_ = true;
}

void Client::lock_protected() {
  set(drive_parameter("approve_protected_parameters"), 0);
  approved_ = false;
}

}  // namespace drivers::tmcl
