/// @file
/// `youbot-bench parameters`: what the motor controllers are set to, and other settings.
#pragma once
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "apps/youbot_bench/controllers.h"
#include "apps/youbot_bench/subcommand.h"
#include "runtime/program/json_output.h"

namespace youbot_bench {

struct ParametersOptions {
  std::string robot;
  std::filesystem::path config{};       ///< whose [can] tells what is on can:IFACE; empty: the defaults
  std::vector<std::string> joints{};    ///< empty: all, of which one alone may be set
  std::vector<std::string> settings{};  ///< "NAME=VALUE"; empty: they are printed
  bool store = false;                   ///< keep what was set in EEPROM, too
  runtime::Format format = runtime::Format::kText;
};

/// @throws std::invalid_argument for what no drive would take, before anything is sent; BusError, SetupError.
void parameters(const ParametersOptions& options);

/// Prints `slave,name,firmware,number,parameter,value,unit` for every readable axis parameter, as CSV or
/// JSON.
void print_parameters(std::span<Controller> controllers, runtime::Format format, drivers::tmcl::Clock& clock);

struct NewParameter {
  std::string name;
  std::int32_t value = 0;
};
/// "NAME=VALUE". @throws std::invalid_argument for what no drive would take: not a parameter, read-only, a
/// command, protected by the manufacturer's password, out of range, or with `store` not kept in EEPROM.
NewParameter read_setting(const std::string& text, bool store);

/// Writes all of them to each controller, reads them back and says what they were. A setting acts at once:
/// @throws hal::SetupError before anything is written when a motor turns, or its drive holds its place;
/// drivers::SetupError with the controller's refusal, after what the others had taken was said.
void write_parameters(std::span<Controller> controllers, std::span<const NewParameter> settings, bool store,
                      drivers::tmcl::Clock& clock);

Subcommand add_parameters(CLI::App& app);

}  // namespace youbot_bench
