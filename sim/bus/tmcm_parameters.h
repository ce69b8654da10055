/// @file
/// The memory of a motor controller: axis parameters and user variables, in RAM and in EEPROM.
#pragma once
#include <array>
#include <cstdint>

#include "drivers/tmcl/firmware_version.h"
#include "drivers/tmcl/telegram.h"
#include "sim/bus/board_drive.h"

namespace sim::bus {

/// Answers SAP, GAP, STAP, RSAP and their global counterparts by the rules of drivers/tmcl/axis_parameters.h:
/// unknown, not readable, not writable or not storable 3, out of range 4, EEPROM locked 5, password needed 8.
/// A drive with the same wrong table would not notice; the numbers in tests come from the fact sheet.
/// Power-up reads the EEPROM; everything that was not stored is lost. Cycle: everything except the
/// constructor.
class TmcmParameters {
 public:
  struct Answer {
    drivers::tmcl::Status status = drivers::tmcl::Status::kOk;
    std::int32_t value = 0;
  };

  /// Factory setting. The real password is not public: `password` replaces it.
  TmcmParameters(drivers::tmcl::Firmware firmware, const BoardAxis& axis, std::int32_t password);

  void power_up() noexcept;

  // Axis parameters, for telegrams.
  Answer get(std::uint8_t number) const noexcept;
  Answer set(std::uint8_t number, std::int32_t value) noexcept;
  Answer store(std::uint8_t number) noexcept;
  Answer restore(std::uint8_t number) noexcept;

  // Global parameters: bank 2, the user variables; and number 73 of bank 0, the lock of the EEPROM.
  Answer get_global(std::uint8_t bank, std::uint8_t number) const noexcept;
  Answer set_global(std::uint8_t bank, std::uint8_t number, std::int32_t value) noexcept;
  Answer store_global(std::uint8_t bank, std::uint8_t number) noexcept;
  Answer restore_global(std::uint8_t bank, std::uint8_t number) noexcept;

  // For the firmware itself: no checks.
  std::int32_t operator[](std::uint8_t number) const noexcept { return ram_[number]; }
  void assign(std::uint8_t number, std::int32_t value) noexcept { ram_[number] = value; }

 private:
  using Status = drivers::tmcl::Status;
  Status may_write(std::uint8_t number) const noexcept;
  Status may_write_user_variable(std::uint8_t bank, std::uint8_t number) const noexcept;
  Status may_store_user_variable(std::uint8_t bank, std::uint8_t number) const noexcept;

  drivers::tmcl::Firmware firmware_;
  std::int32_t password_;
  bool approved_ = false;
  bool eeprom_locked_ = false;  // stored in EEPROM
  std::array<std::int32_t, 256> ram_{};
  std::array<std::int32_t, 256> eeprom_{};
  std::array<std::int32_t, 256> user_ram_{};
  std::array<std::int32_t, 256> user_eeprom_{};
};

}  // namespace sim::bus
