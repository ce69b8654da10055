/// @file
/// `youbot-bench parameters`: reads and writes parameters of the motor controllers.
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
  std::filesystem::path config{};       ///< its [can] table describes can:IFACE; empty: the defaults
  std::vector<std::string> joints{};    ///< empty: all; only a single joint may be set
  std::vector<std::string> settings{};  ///< "NAME=VALUE"; empty: prints the parameters
  bool store = false;                   ///< also store the new values in EEPROM
  runtime::Format format = runtime::Format::kText;
};

/// @throws std::invalid_argument for values that no drive accepts, before anything is sent; BusError,
/// SetupError.
void parameters(const ParametersOptions& options);

/// Prints `slave,name,firmware,number,parameter,value,unit` for every readable axis parameter, as CSV or
/// JSON.
void print_parameters(std::span<Controller> controllers, runtime::Format format, drivers::tmcl::Clock& clock);

struct NewParameter {
  std::string name;
  std::int32_t value = 0;
};
/// "NAME=VALUE". @throws std::invalid_argument if no drive accepts it: not a parameter, read-only, a command,
/// protected by the manufacturer's password, out of range, or with `store` not storable in EEPROM.
NewParameter read_setting(const std::string& text, bool store);

/// Writes all of them to each controller, reads them back and prints the old values. A setting acts at once:
/// @throws hal::SetupError before anything is written if a motor turns, or its drive holds its position;
/// drivers::SetupError with the controller's refusal, after the changes of the others were printed.
void write_parameters(std::span<Controller> controllers, std::span<const NewParameter> settings, bool store,
                      drivers::tmcl::Clock& clock);

Subcommand add_parameters(CLI::App& app);

}  // namespace youbot_bench
