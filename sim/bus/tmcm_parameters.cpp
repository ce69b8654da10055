#include "sim/bus/tmcm_parameters.h"

#include <cmath>

#include "drivers/tmcl/axis_parameters.h"

namespace sim::bus {
namespace {

using drivers::tmcl::AxisParameter;
using drivers::tmcl::find_drive_parameter;
using drivers::tmcl::kUserVariableBank;
using drivers::tmcl::Protection;
using drivers::tmcl::Status;
namespace user_variable = drivers::tmcl::user_variable;

constexpr std::uint8_t kApproveProtected = 248;
constexpr std::uint8_t kEepromLock = 73;  // global parameter (TMCL manual)
constexpr std::int32_t kLockCode = 1234;
constexpr std::int32_t kUnlockCode = 4321;

struct FactorySetting {
  std::uint8_t number;
  std::int32_t value;
};

// "Factory" set and common values of the Óbuda University driver's files for the arm, TMCM-1630 manual for
// I²t. The timeout of 100 ms is from that driver's simulation; the halted velocity and the start-up velocity
// are ours: none of the three was observed on a real board.
constexpr FactorySetting kFactory[] = {
    {4, 4000},    {7, 500},    {9, 5},      {10, 5},     {11, 2000},  {14, 1000},  {25, 13200},
    {26, 211200}, {90, 100},   {130, 500},  {133, 1},    {134, 1},    {135, 500},  {140, 200},
    {141, 200},   {143, 500},  {146, 1},    {159, 3},    {172, 25},   {173, 60},   {175, 1000},
    {177, 1000},  {230, 2000}, {233, 1000}, {234, 1000}, {235, 1000}, {237, 1000}, {241, 100},
    {244, 500},   {245, 1},    {249, 1},    {250, 4000}, {251, 1},    {254, 1},
};

}  // namespace

TmcmParameters::TmcmParameters(drivers::tmcl::Firmware firmware, const BoardAxis& axis, std::int32_t password)
    : firmware_(firmware), password_(password) {
  for (const FactorySetting& setting : kFactory) eeprom_[setting.number] = setting.value;
  eeprom_[6] = static_cast<std::int32_t>(std::lround(1000 * axis.current_limit_A));
  eeprom_[250] = axis.ticks_per_motor_rev;
  eeprom_[253] = axis.motor_poles;
  power_up();
}

void TmcmParameters::power_up() noexcept {
  ram_ = eeprom_;
  user_ram_ = user_eeprom_;
  approved_ = false;
}

Status TmcmParameters::may_write(std::uint8_t number) const noexcept {
  const AxisParameter* const row = find_drive_parameter(number);
  if (row == nullptr || !row->exists_in(firmware_) || !writable(row->access)) return Status::kWrongType;
  return row->protection == Protection::kPassword && !approved_ ? Status::kProtected : Status::kOk;
}

TmcmParameters::Answer TmcmParameters::get(std::uint8_t number) const noexcept {
  const AxisParameter* const row = find_drive_parameter(number);
  if (row == nullptr || !row->exists_in(firmware_) || !readable(row->access)) return {Status::kWrongType, 0};
  return {Status::kOk, ram_[number]};
}

TmcmParameters::Answer TmcmParameters::set(std::uint8_t number, std::int32_t value) noexcept {
  if (number == kApproveProtected) {
    approved_ = value == password_ && value != 0;
    return {approved_ || value == 0 ? Status::kOk : Status::kInvalidValue, value};
  }
  const Status status = may_write(number);
  if (status != Status::kOk) return {status, value};
  if (!find_drive_parameter(number)->in_range(value)) return {Status::kInvalidValue, value};
  ram_[number] = value;
  return {Status::kOk, value};
}

// STAP and RSAP carry no meaningful value; the official driver expects an echo, which the caller provides.
TmcmParameters::Answer TmcmParameters::store(std::uint8_t number) noexcept {
  const Status status = may_write(number);
  if (status != Status::kOk) return {status, 0};
  if (!storable(find_drive_parameter(number)->access)) return {Status::kWrongType, 0};
  if (eeprom_locked_) return {Status::kEepromLocked, 0};
  eeprom_[number] = ram_[number];
  return {};
}

TmcmParameters::Answer TmcmParameters::restore(std::uint8_t number) noexcept {
  const Status status = may_write(number);
  if (status != Status::kOk) return {status, 0};
  if (!storable(find_drive_parameter(number)->access)) return {Status::kWrongType, 0};
  ram_[number] = eeprom_[number];
  return {};
}

Status TmcmParameters::may_write_user_variable(std::uint8_t bank, std::uint8_t number) const noexcept {
  if (bank != kUserVariableBank) return Status::kInvalidValue;
  return user_variable::is_protected(number) && !approved_ ? Status::kProtected : Status::kOk;
}

Status TmcmParameters::may_store_user_variable(std::uint8_t bank, std::uint8_t number) const noexcept {
  const Status status = may_write_user_variable(bank, number);
  if (status != Status::kOk) return status;
  return user_variable::storable(number) ? Status::kOk : Status::kWrongType;
}

TmcmParameters::Answer TmcmParameters::get_global(std::uint8_t bank, std::uint8_t number) const noexcept {
  if (bank == 0 && number == kEepromLock) return {Status::kOk, eeprom_locked_ ? 1 : 0};
  if (bank != kUserVariableBank) return {bank == 0 ? Status::kWrongType : Status::kInvalidValue, 0};
  return {Status::kOk, user_ram_[number]};
}

TmcmParameters::Answer TmcmParameters::set_global(std::uint8_t bank, std::uint8_t number,
                                                  std::int32_t value) noexcept {
  if (bank == 0) {
    if (number != kEepromLock) return {Status::kWrongType, value};
    if (value != kLockCode && value != kUnlockCode) return {Status::kInvalidValue, value};
    eeprom_locked_ = value == kLockCode;
    return {Status::kOk, value};
  }
  const Status status = may_write_user_variable(bank, number);
  if (status == Status::kOk) user_ram_[number] = value;
  return {status, value};
}

TmcmParameters::Answer TmcmParameters::store_global(std::uint8_t bank, std::uint8_t number) noexcept {
  const Status status = may_store_user_variable(bank, number);
  if (status != Status::kOk) return {status, 0};
  if (eeprom_locked_) return {Status::kEepromLocked, 0};
  user_eeprom_[number] = user_ram_[number];
  return {};
}

TmcmParameters::Answer TmcmParameters::restore_global(std::uint8_t bank, std::uint8_t number) noexcept {
  const Status status = may_store_user_variable(bank, number);
  if (status == Status::kOk) user_ram_[number] = user_eeprom_[number];
  return {status, 0};
}

}  // namespace sim::bus
