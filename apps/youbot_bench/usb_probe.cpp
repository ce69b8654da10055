#include "apps/youbot_bench/usb_probe.h"

#include <CLI/CLI.hpp>

#include <array>
#include <charconv>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <memory>
#include <optional>
#include <stdexcept>
#include <vector>

#include "drivers/haptic/haptic_usb.h"
#include "drivers/haptic/space_mouse_models.h"
#include "drivers/usb/usb_access.h"
#include "drivers/usb/usb_descriptors.h"
#include "drivers/usb/usb_devices.h"
#include "runtime/configuration/whole_file.h"
#include "runtime/program/exit_code.h"
#include "runtime/program/stop_on_signals.h"

namespace youbot_bench {
namespace {

namespace usb = drivers::usb;
using usb::UsbDevice;

namespace haptic = drivers::haptic;

/// Role of a device for this software.
struct Role {
  std::string name{};
  std::string backend{};
  std::string rules_file{};
  bool is_master = false;
  bool uses_node = true;  ///< otherwise access to the USB node is irrelevant
};

Role role_of(const UsbDevice& device) {
  if (device.vendor == haptic::kVendorForceDimension) {
    return {.name = "Force Dimension haptic device",
            .backend = "the vendor's library (libdrd), loaded at run time; its USB protocol is not public",
            .rules_file = haptic::kForceDimensionRules,
            .is_master = true};
  }
  if (device.vendor == haptic::kVendorFalcon && device.product == haptic::kProductFalcon) {
    return {.name = "Novint Falcon",
            .backend = "our own driver through libusb: interface 0, bulk OUT 0x02 and IN 0x81",
            .rules_file = haptic::kFalconRules,
            .is_master = true};
  }
  if (const auto* const model = haptic::space_mouse_model(device.vendor, device.product)) {
    return {.name = std::string("3Dconnexion ") + model->name,
            .backend = "our own driver through hidapi, input only",
            .rules_file = "60-3dconnexion-spacemouse.rules",
            .is_master = true,
            .uses_node = false};
  }
  const bool a_mouse = device.vendor == haptic::kVendor3Dconnexion;
  return {.name = a_mouse ? "3Dconnexion device that is not known to have six axes" : "USB device",
          .backend = "none",
          .is_master = a_mouse,
          .uses_node = false};
}

std::optional<std::uint16_t> parse_id(const std::string& text, const char* option) {
  if (text.empty()) return std::nullopt;
  const std::size_t prefix = text.starts_with("0x") ? 2 : 0;
  std::uint16_t value = 0;
  const char* const end = text.data() + text.size();
  const auto [stop, error] = std::from_chars(text.data() + prefix, end, value, 16);
  if (error == std::errc() && stop == end) return value;
  throw std::invalid_argument(std::string(option) + ": expected up to four hexadecimal digits, not '" + text +
                              "'");
}

std::string or_none(const std::string& text) { return text.empty() ? "none" : text; }

std::string octal(unsigned mode) {
  std::array<char, 8> text{};
  (void)std::snprintf(text.data(), text.size(), "%04o", mode);
  return text.data();
}

std::string hex_lines(const std::vector<std::uint8_t>& bytes) {
  constexpr std::size_t kPerLine = 16;
  std::string text;
  for (std::size_t i = 0; i < bytes.size(); ++i) {
    std::array<char, 4> digits{};
    (void)std::snprintf(digits.data(), digits.size(), " %02x", static_cast<unsigned>(bytes[i]));
    text += (i % kPerLine == 0 ? (i == 0 ? "   " : "\n   ") : "") + std::string(digits.data());
  }
  return text.empty() ? "    none" : text;
}

std::string access_lines(const usb::UsbContext& context, const UsbDevice& device, const Role& role) {
  const usb::AccessFacts facts = collect_access_facts(context, device, 0, role.rules_file);
  std::string text = "  node: " + facts.node;
  text += facts.node_there ? ", mode " + octal(facts.node_mode) + ", owner " + facts.node_owner + ", group " +
                                 facts.node_group + "\n"
                           : ", missing\n";
  if (!role.rules_file.empty()) {
    text += "  udev rule: " +
            (facts.rules_installed.empty() ? role.rules_file + ", not installed" : facts.rules_installed) +
            "\n";
  }
  if (!role.uses_node) {
    return text + (role.is_master && !role.rules_file.empty()
                       ? "  access: by its hidraw node, not by the one above\n"
                       : "");
  }
  const usb::AccessVerdict verdict = judge_access(facts);
  return text + "  access: " + verdict.found + (verdict.hint.empty() ? "" : "\n    " + verdict.hint) + "\n";
}

std::string report_of(const usb::UsbContext& context, const UsbDevice& device) {
  const Role role = role_of(device);
  const std::vector<std::uint8_t> bytes = descriptors_of(device, context.paths());
  const usb::DescriptorReport descriptors = usb::report_descriptors(bytes);
  std::string text = role.name + ": " + name_of(device) + "\n";
  text += "  bus " + std::to_string(device.bus) + ", address " + std::to_string(device.address) + ", " +
          describe(device.speed) + "\n";
  text += "  manufacturer: " + or_none(device.manufacturer) + "; product: " + or_none(device.product_name) +
          "; serial number: " + or_none(device.serial) + "\n";
  text += "  backend: " + role.backend + "\n";
  text += access_lines(context, device, role);
  for (const int interface : descriptors.interfaces) {
    text += "  kernel driver of interface " + std::to_string(interface) + ": " +
            or_none(kernel_driver_of(device, interface, context.paths())) + "\n";
  }
  text += "  descriptors:\n";
  for (const std::string& line : descriptors.lines) text += "    " + line + "\n";
  if (descriptors.malformed) text += "    malformed, " + *descriptors.malformed + "\n";
  return text + "  descriptors, raw:\n" + hex_lines(bytes) + "\n";
}

/// Advice if nothing was found.
std::runtime_error absence(const usb::UsbContext& context, const usb::UsbDeviceFilter& filter) {
  const std::string step = "usb-probe: look for devices: expected ";
  if (filter.vendor && filter.product) {
    const usb::AccessVerdict verdict =
        judge_access(absence_facts(context, {.vendor = *filter.vendor, .product = *filter.product}));
    return std::runtime_error(step + "the one asked for, found " + verdict.found + "; " + verdict.hint);
  }
  const std::size_t others = context.devices().size();
  const std::string found = others == 0
                                ? "no USB device at all; check that this machine, or container, has a USB "
                                  "host and sees /sys/bus/usb"
                                : "none among " + std::to_string(others) + " devices (--all lists them)";
  return std::runtime_error(
      step + (filter.vendor || filter.product ? "one with these numbers" : "a haptic device") + ", found " +
      found +
      "; check that the device is switched on and its USB cable plugged in, try another "
      "cable and USB port, without a hub, and see the kernel's log (dmesg)");
}

/// Reports the present devices, then each arrival and removal.
void watch(const usb::UsbContext& context, const usb::UsbDeviceFilter& filter, bool any,
           const std::atomic<bool>& stop) {
  usb::UsbWatch devices(filter, context.paths());
  while (!stop.load(std::memory_order_relaxed)) {
    for (const usb::UsbArrival& arrival : devices.poll(std::chrono::milliseconds(200))) {
      if (!any && !role_of(arrival.device).is_master) continue;
      if (arrival.kind == usb::UsbArrival::Kind::kCame) {
        std::printf("came: %s", report_of(context, arrival.device).c_str());
      } else {
        std::printf("went: %s\n", name_of(arrival.device).c_str());
      }
      std::fflush(stdout);
    }
  }
}

}  // namespace

void usb_probe(const UsbProbeOptions& options, const std::atomic<bool>& stop) {
  const usb::UsbDeviceFilter filter{.vendor = parse_id(options.vendor, "--vendor"),
                                    .product = parse_id(options.product, "--product")};
  const bool any = options.all || filter.vendor || filter.product;
  const usb::UsbContext context;
  if (options.watch) return watch(context, filter, any, stop);
  std::string report;
  for (const UsbDevice& device : context.devices(filter)) {
    if (any || role_of(device).is_master) report += (report.empty() ? "" : "\n") + report_of(context, device);
  }
  if (report.empty()) throw absence(context, filter);
  std::printf("%s", report.c_str());
  if (!options.out.empty()) runtime::write_whole_file(options.out, report);
}

Subcommand add_usb_probe(CLI::App& app) {
  const auto options = std::make_shared<UsbProbeOptions>();
  CLI::App* const command = app.add_subcommand(
      "usb-probe", "list haptic devices on USB and whether they can be used; claims and sends nothing");
  command->add_option("--vendor", options->vendor, "only devices of this vendor, hexadecimal");
  command->add_option("--product", options->product, "only this product, hexadecimal");
  command->add_flag("--all", options->all, "also list other devices");
  CLI::Option* const probe_out =
      command->add_option("--out", options->out, "also write the report to this file");
  command->add_flag("--watch", options->watch, "continue and report arrivals and removals; Ctrl-C ends it")
      ->excludes(probe_out);
  return {command, [options] {
            runtime::stop_on_signals();
            usb_probe(*options, runtime::stop_requested);
            return runtime::kExitOk;
          }};
}

}  // namespace youbot_bench
