#include "runtime/configuration/can_config.h"

#include <spdlog/fmt/fmt.h>

#include <array>
#include <cmath>
#include <optional>

#include "drivers/tmcl/polled_drive.h"
#include "hal/youbot_axes.h"

namespace runtime {
namespace {

/// "arm-3" → its gear, motor and limits.
std::optional<hal::AxisData> axis_of(const std::string& joint) {
  for (int wheel = 1; wheel <= 4; ++wheel)
    if (joint == "wheel-" + std::to_string(wheel)) return hal::kWheelAxis;
  for (std::size_t i = 0; i < hal::kArmAxes.size(); ++i)
    if (joint == "arm-" + std::to_string(i + 1)) return hal::kArmAxes[i];
  return std::nullopt;
}

/// Range of the joint on the rig, in the module's own count.
void read_range(TomlTable& table, hal::CanOptions& options) {
  if (!table.has("range_rad")) return;
  std::array<double, 2> range_rad{std::nan(""), std::nan("")};
  table.numbers("range_rad", range_rad);
  if (std::isnan(range_rad[0])) return;  // already rejected
  if (range_rad[0] < range_rad[1]) {
    options.axis.range = {range_rad[0], range_rad[1]};
    options.range_is_stated = true;
  } else {
    table.refuse("range_rad", "must be [lower, upper], the lower one first");
  }
}

/// Never negative. False if one was rejected.
template <typename Number>
bool read_integer(TomlTable& table, std::string_view key, Number& value, const NumberRules& rules) {
  int number = -1;
  table.integer(key, number, rules);
  if (number < 0) return !table.has(key);
  value = static_cast<Number>(number);
  return true;
}

/// One for requests, one for replies.
void read_identifiers(TomlTable& table, hal::CanOptions& options) {
  constexpr NumberRules kElevenBits{.min = 1, .max = 0x7FF};
  const hal::CanOptions defaults = options;
  const bool module_read = read_integer(table, "module_id", options.module_id, kElevenBits);
  const bool reply_read = read_integer(table, "reply_id", options.reply_id, kElevenBits);
  if (!module_read || !reply_read || options.module_id != options.reply_id) return;
  const bool reply_given = table.has("reply_id");
  table.refuse(reply_given ? "reply_id" : "module_id",
               fmt::format("= {} is 'can.{}', too: requests and replies need one each; without the keys they "
                           "are {} and {}",
                           options.reply_id, reply_given ? "module_id" : "reply_id", defaults.module_id,
                           defaults.reply_id));
}

}  // namespace

void read_can(TomlTable& table, hal::CanOptions& options) {
  table.text("joint", options.joint_name);
  if (const std::optional<hal::AxisData> axis = axis_of(options.joint_name))
    options.axis = *axis;
  else
    table.refuse("joint", "= '" + options.joint_name + "' is none of wheel-1 to wheel-4 and arm-1 to arm-5");
  read_range(table, options);
  table.number("rated_torque_Nm", options.axis.rated_torque_Nm, {.min = 0.01, .max = 1e3});
  table.number("speed_limit_rad_per_s", options.axis.speed_limit_rad_per_s, {.min = 0.01, .max = 1e3});
  read_identifiers(table, options);
  read_integer(table, "motor", options.motor, {.min = 0, .max = 5});
  read_integer(table, "bitrate_bit_per_s", options.bitrate_bit_per_s, {.min = 0, .max = 1e6});
  read_integer(table, "requests_per_cycle", options.requests_per_cycle,
               {.min = 1, .max = drivers::tmcl::PolledDrive::kMaxRequests});
  read_integer(table, "patience_cycles", options.patience_cycles, {.min = 1, .max = 100});
  read_integer(table, "tolerated_cycles", options.tolerated_cycles, {.min = 0, .max = 100});
  table.boolean("unsigned_current", options.unsigned_current);
}

std::string can_text(const hal::CanOptions& options) {
  const hal::AxisData& axis = options.axis;
  std::string limits = fmt::format("speed_limit_rad_per_s = {}\n", axis.speed_limit_rad_per_s);
  if (std::isfinite(axis.rated_torque_Nm))
    limits += fmt::format("rated_torque_Nm = {}\n", axis.rated_torque_Nm);
  if (options.range_is_stated)
    limits += fmt::format("range_rad = [{}, {}]\n", axis.range.lower_rad, axis.range.upper_rad);
  return fmt::format(
      "[can]\njoint = {}\nmodule_id = {}\nreply_id = {}\nmotor = {}\nbitrate_bit_per_s = {}\n"
      "requests_per_cycle = {}\npatience_cycles = {}\ntolerated_cycles = {}\nunsigned_current = {}\n{}",
      toml_string(options.joint_name), options.module_id, options.reply_id, options.motor,
      options.bitrate_bit_per_s, options.requests_per_cycle, options.patience_cycles,
      options.tolerated_cycles, options.unsigned_current, limits);
}

}  // namespace runtime
