#include "runtime/open_haptic.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>
#include <vector>

#include "drivers/haptic/haptic_usb.h"
#include "drivers/station/udp_port.h"
#include "hal/ethercat_robot.h"
#include "hal/haptic/falcon_link.h"
#include "hal/lockstep_haptic_device.h"
#include "hal/loopback_haptic_link.h"
#include "hal/seconds.h"
#include "hal/setup_error.h"
#include "runtime/configuration/regular_file.h"
#include "runtime/station/remote_haptic_link.h"

namespace runtime {
namespace {

using hal::seconds;

constexpr const char* kLoopback = "loopback";
constexpr const char* kFalcon = "falcon";
constexpr const char* kSpaceMouse = "spacemouse";
constexpr const char* kKnown = "loopback, force-dimension or omega.6, falcon, spacemouse";
/// The vendor's image has about 30 kB.
constexpr std::size_t kMaxFirmware_bytes = 1 << 20;
/// Of real devices, whose motors make 8 to 12 N.
constexpr std::chrono::milliseconds kMinRamp{1000};
/// Without real-time rights a busy machine holds the loop up: as long as for the bus of a simulator.
constexpr std::chrono::milliseconds kPenPatience = hal::kSimulatorPatience;

std::vector<std::uint8_t> read_image(const std::filesystem::path& path) {
  if (path.empty()) return {};
  const auto unreadable = [&path](const std::string& why) {
    return hal::SetupError("Novint Falcon", "read its firmware from " + path.string(),
                           why + "; name the image of the vendor's driver package");
  };
  std::string bytes;
  try {
    bytes = read_regular_file(path, kMaxFirmware_bytes, Content::kBytes);
  } catch (const std::runtime_error& error) {
    throw unreadable(std::string("it ") + error.what());
  }
  if (bytes.empty()) throw unreadable("it is empty");
  return {bytes.begin(), bytes.end()};
}

/// The port's context lives as long as the function that opens ports.
hal::FalconLink::OpenPort falcon_opener(const std::string& port_path) {
  return [port_path, context = std::shared_ptr<drivers::usb::UsbContext>()]() mutable {
    context = std::make_shared<drivers::usb::UsbContext>();
    return drivers::haptic::open_falcon_port(*context, port_path);
  };
}

std::unique_ptr<hal::HapticLink> real_link(const HapticOptions& options) {
  if (is_force_dimension(options.name)) {
    hal::ForceDimensionLinkConfig config = options.force_dimension;
    config.device.max_force_N = options.force_limit_N;
    if (config.sdk.sdk_folder.empty())
      config.sdk = drivers::haptic::sdk_search_from_environment(config.sdk.file);
    config.look_at_bus = [] { drivers::haptic::check_force_dimension_on_bus(drivers::usb::UsbContext()); };
    return std::make_unique<hal::ForceDimensionLink>(std::move(config));
  }
  if (options.name == kFalcon) {
    drivers::haptic::FalconConfig config = options.falcon.device;
    config.force_limit_N = options.force_limit_N;
    return std::make_unique<hal::FalconLink>(falcon_opener(options.falcon.port_path), config,
                                             read_image(options.falcon.firmware));
  }
  if (options.name == kSpaceMouse) return std::make_unique<hal::SpaceMouseLink>(options.space_mouse);
  throw std::invalid_argument("--haptic: there is no '" + options.name + "'; known: " + kKnown);
}

std::unique_ptr<hal::HapticLink> remote_link(const HapticOptions& options,
                                             std::shared_ptr<LinkMonitor> monitor) {
  return std::make_unique<RemoteHapticLink>(
      [listen = options.link.listen] {
        return std::make_unique<drivers::station::UdpPort>(drivers::station::UdpPort::listening(listen));
      },
      drivers::station::read_key_file(options.link.key_file), options.link,
      RemoteHapticLink::Limits{.force_N = options.force_limit_N,
                               .speed_m_per_s = options.limits.speed_m_per_s},
      std::move(monitor));
}

std::chrono::milliseconds milliseconds(double seconds) {
  return std::chrono::milliseconds(std::llround(1e3 * seconds));
}

/// A time in seconds in the file, in milliseconds here.
void read_time(TomlTable& table, std::string_view key, std::chrono::milliseconds& time,
               const NumberRules& rules) {
  double value_s = seconds(time);
  table.number(key, value_s, rules);
  time = milliseconds(value_s);
}

void read_force_dimension(TomlTable table, const std::filesystem::path& folder,
                          hal::ForceDimensionLinkConfig& config) {
  using Transport = hal::ForceDimensionTransport;
  table.choice("transport", config.transport, {{"sdk", Transport::kSdk}, {"usb", Transport::kUsb}});
  std::string library;
  table.text("library", library);
  if (!library.empty()) config.sdk.file = (folder / library).string();
  int serial = -1;
  table.integer("serial", serial, {.min = 0, .max = 65535});
  if (serial >= 0) config.device.serial = static_cast<std::uint16_t>(serial);
  table.boolean("allow_motion", config.device.allow_motion);
  double mass_kg = -1.0;
  table.number("effector_mass_kg", mass_kg, {.min = 0.0, .max = 1.0});
  if (mass_kg >= 0.0) config.device.effector_mass_kg = mass_kg;
  double watchdog_s = seconds(config.device.watchdog);
  table.number("watchdog_s", watchdog_s, {.min = 0.002, .max = 0.0318});
  config.device.watchdog = std::chrono::microseconds(std::llround(1e6 * watchdog_s));
}

void read_falcon(TomlTable& table, const std::filesystem::path& folder, HapticOptions::Falcon& falcon) {
  std::string firmware;
  table.text("firmware", firmware);
  if (!firmware.empty()) falcon.firmware = folder / firmware;
  table.text("usb_port", falcon.port_path);
  table.number("command_per_Nm", falcon.device.command_per_Nm, {.min = -5e4, .max = 5e4});
  table.number("origin_m", falcon.device.p_FO_m[2], {.min = 0.08, .max = 0.18});
  double deadline_s = seconds(falcon.device.reply_deadline);
  table.number("reply_deadline_s", deadline_s, {.min = 0.003, .max = 0.02});
  falcon.device.reply_deadline = std::chrono::microseconds(std::llround(1e6 * deadline_s));
  table.integer("lost_after_misses", falcon.device.lost_after_misses, {.min = 1, .max = 10});
}

void read_space_mouse(TomlTable table, hal::SpaceMouseLinkConfig& config) {
  table.text("serial", config.choice.serial);
  table.text("path", config.choice.path);
  table.number("travel_m", config.travel_m, {.min = 1e-3, .max = 1.0});
  table.number("turn_rad", config.turn_rad, {.min = 1e-3, .max = 3.0});
}

void read_hand(TomlTable table, sim::HandParameters& hand) {
  table.number("device_mass_kg", hand.device_mass_kg, {.min = 0.01, .max = 10.0});
  table.number("device_drag_N_s_per_m", hand.device_drag_N_s_per_m, {.min = 0.0, .max = 100.0});
  table.number("mass_kg", hand.hand_mass_kg, {.min = 0.0, .max = 10.0});
  table.number("stiffness_N_per_m", hand.hand_stiffness_N_per_m, {.min = 0.0, .max = 5000.0});
  table.number("damping_N_s_per_m", hand.hand_damping_N_s_per_m, {.min = 0.0, .max = 500.0});
}

}  // namespace

void read_haptic(TomlTable& table, const std::filesystem::path& folder, HapticOptions& options) {
  table.text("device", options.name);
  if (!is_simulated_haptic(options.name) && !is_force_dimension(options.name) && options.name != kFalcon &&
      options.name != kSpaceMouse)
    table.refuse("device", "is '" + options.name + "', allowed is " + kKnown);
  table.number("force_limit_N", options.force_limit_N, {.min = 0.1, .max = 12.0});
  hal::HapticLimits& limits = options.limits;
  table.number("slew_N_per_s", limits.slew_N_per_s, {.min = 1.0, .max = 2000.0});
  table.number("speed_limit_m_per_s", limits.speed_m_per_s, {.min = 0.01, .max = 2.0});
  read_time(table, "ramp_in_s", limits.ramp_in, {.min = 0.1, .max = 60.0});
  read_time(table, "stale_after_s", limits.stale_after, {.min = 0.002, .max = 0.1});
  read_time(table, "command_timeout_s", limits.command_timeout, {.min = 0.002, .max = 0.1});
  table.number("velocity_cutoff_Hz", limits.velocity_cutoff_Hz, {.min = 1.0, .max = 1000.0});
  double period_s = seconds(options.thread.period);
  table.number("period_s", period_s, {.min = 1e-4, .max = 0.01});
  options.thread.period = std::chrono::nanoseconds(std::llround(1e9 * period_s));
  table.integer("priority", options.thread.fifo_priority, {.min = 0, .max = 99});
  read_force_dimension(table.table("force_dimension"), folder, options.force_dimension);
  const bool has_falcon = options.name == kFalcon || table.has("falcon");
  TomlTable falcon = table.table("falcon");
  read_falcon(falcon, folder, options.falcon);
  if (has_falcon && options.falcon.device.reply_deadline >= limits.stale_after)
    falcon.refuse("reply_deadline_s",
                  "is not below haptic.stale_after_s: one missing reply would end the force");
  read_space_mouse(table.table("spacemouse"), options.space_mouse);
  read_hand(table.table("hand"), options.hand);
}

OpenedHaptic open_haptic(const HapticOptions& options, const hal::Clock& clock,
                         std::chrono::nanoseconds period) {
  OpenedHaptic opened;
  if (options.name == kLoopback) {
    opened.hand = std::make_unique<sim::Hand>(options.hand);
    hal::HapticInfo info{
        .name = "simulated handle", .force_limit_N = options.force_limit_N, .senses_rotation = true};
    opened.device = std::make_unique<hal::LockstepHapticDevice>(
        std::make_unique<hal::LoopbackHapticLink>(*opened.hand, period, std::move(info)), clock,
        options.limits);
    return opened;
  }
  hal::HapticLimits limits = options.limits;
  limits.ramp_in = std::max(limits.ramp_in, kMinRamp);
  if (is_force_dimension(options.name))  // its firmware may have no watchdog of its own
    limits.stale_after = std::min(limits.stale_after, std::chrono::duration_cast<std::chrono::milliseconds>(
                                                          options.force_dimension.device.watchdog));
  std::unique_ptr<hal::HapticLink> link;
  if (options.name == kRemoteHaptic) {
    limits.stale_after = std::chrono::duration_cast<std::chrono::milliseconds>(options.link.endpoint.silence);
    opened.link = std::make_shared<LinkMonitor>();
    link = remote_link(options, opened.link);
  } else {
    link = real_link(options);
  }
  opened.device = std::make_unique<hal::ThreadedHapticDevice>(std::move(link), limits, options.thread);
  return opened;
}

void bear_pauses(HapticOptions& options) {
  auto& stale_after = options.limits.stale_after;
  if (is_simulated_haptic(options.name) && stale_after == hal::HapticLimits{}.stale_after)
    stale_after = kPenPatience;
}

bool is_simulated_haptic(const std::string& name) { return name == kLoopback; }

bool is_force_dimension(const std::string& name) { return name == "force-dimension" || name == "omega.6"; }

}  // namespace runtime
