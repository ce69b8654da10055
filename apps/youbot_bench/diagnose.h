/// @file
#pragma once
#include <atomic>
#include <chrono>
#include <string>

#include "apps/youbot_bench/subcommand.h"
#include "runtime/program/json_output.h"

namespace drivers::ethercat {
class Link;
}
namespace hal {
class Clock;
}

namespace youbot_bench {

struct DiagnoseOptions {
  double duration_s = 10;
  std::string capture{};  ///< pcapng file for the last second of frames; empty: none
  bool quiet = false;     ///< no progress
  runtime::Format format = runtime::Format::kText;
};

/// Takes a youBot's boards, all or some of them, to OP with all outputs zero, cycles them at 1 kHz and prints
/// how frames, slaves and cables fared. True when nothing was found wrong. `stop` ends it early, and so does
/// another master. `clock` is the bus'.
/// @throws drivers::ethercat::BusError, also for any other device; std::runtime_error when the capture cannot
/// be written.
bool print_diagnosis(drivers::ethercat::Link& link, hal::Clock& clock, const DiagnoseOptions& options,
                     const std::atomic<bool>& stop);

Subcommand add_diagnose(CLI::App& app);

}  // namespace youbot_bench
