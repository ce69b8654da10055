/// @file
/// Parameters of one module, by name, checked, with explained failures. For set-up: it blocks.
#pragma once
#include <chrono>
#include <cstdint>
#include <optional>
#include <string>

#include "drivers/setup_error.h"
#include "drivers/tmcl/axis_parameters.h"
#include "drivers/tmcl/firmware_version.h"
#include "drivers/tmcl/transport.h"

namespace drivers::tmcl {

struct ClientOptions {
  /// Per try. The official driver checks 100 times, every millisecond.
  std::chrono::nanoseconds timeout = std::chrono::milliseconds(100);
  std::chrono::nanoseconds poll_interval = std::chrono::milliseconds(1);
  /// Repeats are harmless: all requests except relative moves can be executed twice, and those get one try.
  int tries = 3;
  /// Real boards answer with zeros before the text; the Óbuda driver asks up to 50 times. A board that does
  /// not answer at all gets `tries`.
  int version_tries = 50;
};

/// Setup: all of it. One request at a time; replies are matched on command and status. No reply names its
/// parameter, so after a failed request the client waits one more time-out, so that a late reply is not
/// mistaken for the next one's.
///
///   SteadyClock clock;
///   Client client(mailbox, clock);
///   if (client.version() != FirmwareVersion{1610, 148}) ...
///   client.set(drive_parameter("motor_acceleration"), 2000);
///
/// @throws SetupError naming device, parameter and tries, with the text of the drive's refusal or of the
/// check that failed before anything was sent: access, range, firmware, protection.
class Client {
 public:
  /// Both must outlive the client.
  Client(Transport& transport, Clock& clock, const ClientOptions& options = {});

  /// Afterwards parameters that this firmware lacks are rejected here.
  FirmwareVersion version(std::uint8_t module = kDriveModule);

  std::int32_t get(const AxisParameter& parameter, std::uint8_t motor = 0);
  /// RAM only: lost at power-off.
  void set(const AxisParameter& parameter, std::int32_t value, std::uint8_t motor = 0);
  /// Stores the present value in EEPROM, which wears out: not for every start.
  void store(const AxisParameter& parameter, std::uint8_t motor = 0);
  /// Loads the value from EEPROM into RAM.
  void restore(const AxisParameter& parameter, std::uint8_t motor = 0);

  std::int32_t get_user_variable(std::uint8_t number, std::uint8_t module = kDriveModule);
  void set_user_variable(std::uint8_t number, std::int32_t value, std::uint8_t module = kDriveModule);

  /// Unlocks the protected parameters for writing. The manufacturer provides the password; it is not public.
  void approve_protected(std::int32_t password);
  void lock_protected();

  /// Any other request. `step` is for the message.
  Reply execute(const Request& request, const std::string& step);

 private:
  void require(bool condition, const std::string& step, const std::string& expected, const std::string& found,
               const std::string& hint) const;
  void require_known_to_firmware(const AxisParameter& parameter, const std::string& step) const;
  void require_writable(const AxisParameter& parameter, const std::string& step) const;
  void wait_out_late_replies() noexcept;
  Exchange try_once(const Request& request) noexcept;
  std::string describe_failure(const Exchange& last) const;

  Transport& transport_;
  Clock& clock_;
  ClientOptions options_;
  std::optional<Firmware> firmware_;
  bool approved_ = false;
  int late_replies_ = 0;  // timed-out requests that may still be answered
  std::chrono::nanoseconds late_until_{0};
};

}  // namespace drivers::tmcl
