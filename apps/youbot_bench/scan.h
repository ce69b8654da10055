/// @file
/// `youbot-bench scan`: lists the slaves on an EtherCAT bus.
#pragma once
#include <string>

#include "apps/youbot_bench/subcommand.h"
#include "drivers/ethercat/link.h"
#include "runtime/program/json_output.h"

namespace youbot_bench {

/// Prints every slave with identity, cabling and process data, and which youBot it is. Changes no state.
/// @throws drivers::ethercat::BusError.
void print_scan(drivers::ethercat::Link& link, runtime::Format format = runtime::Format::kText);

Subcommand add_scan(CLI::App& app);

}  // namespace youbot_bench
