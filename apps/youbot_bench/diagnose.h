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

/// Takes all or some of a youBot's boards to OP with all outputs zero, cycles them at 1 kHz and prints the
/// statistics of frames, slaves and cables. True if no fault was found. `stop` ends it early, and so does
/// another master. `clock` is the bus'.
/// @throws drivers::ethercat::BusError, also for any other device; std::runtime_error if the capture cannot
/// be written.
bool print_diagnosis(drivers::ethercat::Link& link, hal::Clock& clock, const DiagnoseOptions& options,
                     const std::atomic<bool>& stop);

Subcommand add_diagnose(CLI::App& app);

}  // namespace youbot_bench
