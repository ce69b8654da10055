#include "apps/youbot_bench/parameters.h"

#include <CLI/CLI.hpp>

#include <algorithm>
#include <charconv>
#include <cstdio>
#include <exception>
#include <memory>
#include <optional>
#include <stdexcept>
#include <utility>

#include "apps/youbot_bench/bus.h"
#include "apps/youbot_bench/experiment_request.h"
#include "drivers/tmcl/axis_parameters.h"
#include "drivers/tmcl/client.h"
#include "drivers/tmcl/status_flags.h"
#include "hal/ethercat_robot.h"
#include "hal/setup_error.h"
#include "runtime/configuration/can_config.h"
#include "runtime/configuration/shared_tables.h"
#include "runtime/configuration/toml_reader.h"
#include "runtime/open_robot.h"
#include "runtime/program/exit_code.h"

namespace youbot_bench {
namespace {

namespace ethercat = drivers::ethercat;
namespace tmcl = drivers::tmcl;

hal::CanOptions can_options(const ParametersOptions& options) {
  hal::CanOptions can;
  if (options.config.empty()) return can;
  runtime::TomlFile toml = runtime::TomlFile::parse(options.config);
  runtime::TomlTable root = toml.root();
  runtime::TomlTable table = root.table("can");
  runtime::read_can(table, can);
  runtime::leave_to_others(root, {"can"});
  leave_to_experiments(root);
  toml.finish();
  return can;
}

std::string names(const std::vector<Controller>& controllers) {
  std::string all;
  for (const Controller& each : controllers) all += (all.empty() ? "" : ", ") + each.joint;
  return all;
}

/// The selected joints' controllers.
std::vector<Controller> chosen(std::vector<Controller> controllers, const std::vector<std::string>& joints) {
  if (joints.empty()) return controllers;
  for (const std::string& joint : joints) {
    if (std::ranges::any_of(controllers, [&](const Controller& each) { return each.joint == joint; }))
      continue;
    throw std::invalid_argument("--joint: there is no '" + joint + "'; known: " + names(controllers));
  }
  std::erase_if(controllers, [&](const Controller& each) {
    return std::ranges::find(joints, each.joint) == joints.end();
  });
  return controllers;
}

void run(std::vector<Controller> all, const ParametersOptions& options,
         const std::vector<NewParameter>& settings) {
  if (!settings.empty() && options.joints.empty() && all.size() > 1)
    throw std::invalid_argument("--set: of which --joint? There are " + names(all));
  std::vector<Controller> controllers = chosen(std::move(all), options.joints);
  tmcl::SteadyClock clock;
  settings.empty() ? print_parameters(controllers, options.format, clock)
                   : write_parameters(controllers, settings, options.store, clock);
}

std::string label(const Controller& controller) {
  return controller.transport->name() + ", " + controller.joint;
}

/// A motor stop may leave velocity mode on, so that flag is only meaningful with a target. The drive's flag
/// for a turning motor is smoothed, the measured speed is not; but a slow motor and a blocked one count as
/// halted. PWM mode of firmware 2.0 at standstill cannot be detected: it has no flag.
void require_off(tmcl::Client& client, const Controller& controller) {
  const auto refuse = [&](const std::string& found) {
    throw hal::SetupError(label(controller), "check that it is off",
                          found +
                              ", and settings act at once; end what drives it, then switch the motors' power "
                              "off and on: a raised arm falls");
  };
  const tmcl::StatusFlags flags(
      static_cast<std::uint32_t>(client.get(tmcl::drive_parameter("error_and_status"), controller.motor)));
  if (flags.has(tmcl::StatusFlag::kTimeout)) refuse("its watchdog expired and it holds its position");
  using enum tmcl::StatusFlag;
  if (flags.has(kPositionMode) || flags.has(kCurrentMode) || flags.has(kPwmMode))
    refuse("it is being driven");
  if (!flags.has(kMotorHalted)) refuse("its motor turns");
  if (!flags.has(kVelocityMode)) return;
  const std::int32_t target_rpm = client.get(tmcl::drive_parameter("target_speed"), controller.motor);
  if (target_rpm != 0) refuse("it is commanded to turn at " + std::to_string(target_rpm) + " rpm");
}

void write(tmcl::Client& client, const Controller& controller, const NewParameter& setting, bool store) {
  const tmcl::AxisParameter& parameter = *tmcl::find_drive_parameter(setting.name);
  const std::int32_t before = client.get(parameter, controller.motor);
  client.set(parameter, setting.value, controller.motor);
  const std::int32_t after = client.get(parameter, controller.motor);
  if (after != setting.value)
    throw hal::SetupError(label(controller), "read " + setting.name + " back",
                          "it took " + std::to_string(setting.value) + " and has " + std::to_string(after));
  std::printf("%s: %s was %d, is %d %s until it loses its power\n", label(controller).c_str(),
              setting.name.c_str(), before, after, name(parameter.unit));
  if (!store) return;
  client.store(parameter, controller.motor);
  std::printf("%s: %s is kept in its EEPROM\n", label(controller).c_str(), setting.name.c_str());
}

}  // namespace

NewParameter read_setting(const std::string& text, bool store) {
  const std::size_t equals = std::min(text.find('='), text.size());
  NewParameter setting{.name = text.substr(0, equals)};
  const char* const end = text.data() + text.size();
  const char* const begin = std::min(text.data() + equals + 1, end);
  const auto [stopped, error] = std::from_chars(begin, end, setting.value);
  if (error != std::errc() || stopped != end)
    throw std::invalid_argument("--set: '" + text + "' should be NAME=VALUE, a whole number of 32 bits");
  if (const std::string complaint = hal::check({.name = setting.name, .value = setting.value});
      !complaint.empty())
    throw std::invalid_argument("--set: '" + setting.name + "' " + complaint);
  if (store && !storable(tmcl::find_drive_parameter(setting.name)->access))
    throw std::invalid_argument("--store: '" + setting.name +
                                "' is not kept in EEPROM; [[ethercat.parameter]] writes it at each start");
  return setting;
}

void parameters(const ParametersOptions& options) {
  std::vector<NewParameter> settings;
  for (const std::string& text : options.settings) {
    NewParameter setting = read_setting(text, options.store);
    if (std::ranges::find(settings, setting.name, &NewParameter::name) != settings.end())
      throw std::invalid_argument("--set: '" + setting.name + "' is given twice");
    settings.push_back(std::move(setting));
  }
  if (options.store && settings.empty())
    throw std::invalid_argument("--store: needs --set NAME=VALUE, whose value it stores");
  runtime::check_robot_name(options.robot);
  if (options.robot.starts_with(runtime::kCanPrefix)) {
    run(controllers_on_can(options.robot.substr(runtime::kCanPrefix.size()), can_options(options)), options,
        settings);
    return;
  }
  if (!options.config.empty()) throw std::invalid_argument("--config: its [can] is for --robot can:IFACE");
  const Bus bus = open_bus(options.robot);
  ethercat::PreOpBus setup(*bus.link, nullptr, {});
  run(controllers_of(setup, bus.link->name()), options, settings);
}

void print_parameters(std::span<Controller> controllers, runtime::Format format, tmcl::Clock& clock) {
  const bool text = format == runtime::Format::kText;
  nlohmann::json all = nlohmann::json::array();
  if (text) std::printf("slave,name,firmware,number,parameter,value,unit\n");
  for (const Controller& controller : controllers) {
    tmcl::Client client(*controller.transport, clock);
    const tmcl::FirmwareVersion version = client.version();
    const std::optional<tmcl::Firmware> firmware = tmcl::supported_firmware(version);
    for (const tmcl::AxisParameter& parameter : tmcl::kDriveParameters) {
      if (!readable(parameter.access) || (firmware && !parameter.exists_in(*firmware))) continue;
      std::optional<std::int32_t> value;
      try {
        value = client.get(parameter, controller.motor);
      } catch (const std::exception& error) {
        std::fprintf(stderr, "youbot-bench: %s\n", error.what());
      }
      if (!text) {
        all.push_back({{"slave", controller.number},
                       {"name", controller.name},
                       {"joint", controller.joint},
                       {"firmware", version.version},
                       {"number", parameter.number},
                       {"parameter", parameter.name},
                       {"value", value ? nlohmann::json(*value) : nlohmann::json()},
                       {"unit", name(parameter.unit)}});
        continue;
      }
      std::printf("%u,%s,%d,%u,%.*s,%s,%s\n", controller.number, controller.name.c_str(), version.version,
                  parameter.number, static_cast<int>(parameter.name.size()), parameter.name.data(),
                  value ? std::to_string(*value).c_str() : "refused", name(parameter.unit));
    }
  }
  if (!text) runtime::print(all);
}

void write_parameters(std::span<Controller> controllers, std::span<const NewParameter> settings, bool store,
                      tmcl::Clock& clock) {
  // All are checked before one is changed.
  for (const bool writing : {false, true})
    for (const Controller& controller : controllers) {
      tmcl::Client client(*controller.transport, clock);
      (void)client.version();  // loads the parameters that this firmware lacks
      if (!writing) require_off(client, controller);
      if (writing)
        for (const NewParameter& setting : settings) write(client, controller, setting, store);
    }
}

Subcommand add_parameters(CLI::App& app) {
  const auto options = std::make_shared<ParametersOptions>();
  CLI::App* const command = app.add_subcommand(
      "parameters",
      "print all axis parameters of all motor controllers, or set some; takes the bus to PRE-OP");
  command
      ->add_option("--robot", options->robot,
                   "ethercat:IFACE, can:IFACE, or wire: an emulated base with an arm; loopback has none")
      ->required();
  command->add_option("--config", options->config,
                      "TOML file whose [can] describes the module on can:IFACE, such as an experiment.toml");
  command
      ->add_option("--joint", options->joints,
                   "wheel-1, arm-5, …; slave-2 on a bus that is not a complete youBot; none: all")
      ->delimiter(',');
  CLI::Option* const set =
      command
          ->add_option(
              "--set", options->settings,
              "NAME=VALUE: write it to --joint and read it back; it lasts until the drive loses its power. "
              "Refused while the motor turns or holds, and for parameters that the manufacturer's password "
              "protects")
          ->type_size(1)
          ->delimiter(',');
  runtime::add_json_flag(*command, options->format);
  command->get_option("--json")->excludes(set);
  command->add_flag("--store", options->store, "also store it in the EEPROM, which wears out: use it rarely")
      ->needs(set);
  return {command, [options] {
            parameters(*options);
            return runtime::kExitOk;
          }};
}

}  // namespace youbot_bench
