#include "runtime/configuration/ethercat_config.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <stdexcept>
#include <string_view>
#include <utility>

namespace runtime {
namespace {

constexpr std::chrono::milliseconds kLongestBridge{100};
/// hal::EthercatOptions::loss_fault is a share of it.
constexpr int kLossCycles = 1000;

}  // namespace

void read_ethercat(TomlTable& table, std::chrono::nanoseconds period, hal::EthercatOptions& options) {
  table.choice("kind", options.kind, drivers::tmcl::kYoubotKinds);
  table.boolean("busy_wait", options.busy_wait);
  table.boolean("unsigned_current", options.unsigned_current);
  table.boolean("distributed_clocks", options.distributed_clocks);
  table.boolean("home_arms", options.home_arms);
  for (TomlTable& entry : table.tables("parameter")) {
    hal::EthercatOptions::Parameter parameter;
    entry.text("joint", parameter.joint, {.required = true});
    entry.text("name", parameter.name, {.required = true});
    entry.integer("value", parameter.value, {.required = true});
    if (const std::string complaint = hal::check(parameter); !parameter.name.empty() && !complaint.empty())
      entry.refuse("name", "= '" + parameter.name + "' " + complaint);
    options.parameters.push_back(parameter);
  }
  int tolerated_cycles = options.tolerated_cycles.value_or(hal::kToleratedCycles);
  if (table.has("tolerated_cycles")) {
    table.integer("tolerated_cycles", tolerated_cycles, {.min = 0, .max = 100});
    options.tolerated_cycles = tolerated_cycles;
  }
  table.number("loss_warning", options.loss_warning, {.min = 0.001, .max = 1});
  table.number("loss_fault", options.loss_fault, {.min = 0.001, .max = 1});
  if (options.loss_warning > options.loss_fault)
    table.refuse("loss_warning", fmt::format("= {} comes after 'ethercat.loss_fault' = {}: lower it",
                                             options.loss_warning, options.loss_fault));
  if (tolerated_cycles >= options.loss_fault * kLossCycles)
    table.refuse("loss_fault",
                 fmt::format("= {} of the last {} cycles is a fault before {} in a row are: raise it, "
                             "or lower 'ethercat.tolerated_cycles'",
                             options.loss_fault, kLossCycles, tolerated_cycles));
  double frame_timeout_s = std::chrono::duration<double>(options.frame_timeout).count();
  table.number("frame_timeout_s", frame_timeout_s, {.min = 1e-4, .max = 0.1});
  options.frame_timeout = std::chrono::nanoseconds(std::llround(1e9 * frame_timeout_s));
  // A cycle without an answer takes as long as its time-out, or its period.
  const std::chrono::nanoseconds cycle = std::max(period, options.frame_timeout);
  if (tolerated_cycles * cycle > kLongestBridge) {
    const double cycle_s = std::chrono::duration<double>(cycle).count();
    const char* const key = cycle == period ? "loop.period_s" : "ethercat.frame_timeout_s";
    table.refuse("tolerated_cycles",
                 fmt::format("= {} bridges {} × {:g} s ('{}') = {:g} s, and the drives stop by themselves "
                             "after 0.1 s: lower one of the two",
                             tolerated_cycles, tolerated_cycles, cycle_s, key, tolerated_cycles * cycle_s));
  }
}

std::string ethercat_text(const hal::EthercatOptions& options) {
  std::string text = fmt::format(
      "[ethercat]\nkind = {}\nbusy_wait = {}\nunsigned_current = {}\n"
      "loss_warning = {}\nloss_fault = {}\nframe_timeout_s = {}\ndistributed_clocks = {}\nhome_arms = {}\n",
      toml_string(name_of(options.kind)), options.busy_wait, options.unsigned_current, options.loss_warning,
      options.loss_fault, std::chrono::duration<double>(options.frame_timeout).count(),
      options.distributed_clocks, options.home_arms);
  if (options.tolerated_cycles) text += fmt::format("tolerated_cycles = {}\n", *options.tolerated_cycles);
  for (const hal::EthercatOptions::Parameter& parameter : options.parameters)
    text += fmt::format("\n[[ethercat.parameter]]\njoint = {}\nname = {}\nvalue = {}\n",
                        toml_string(parameter.joint), toml_string(parameter.name), parameter.value);
  return text;
}

hal::YoubotKind ethercat_kind(const std::string& name) {
  std::string known;
  for (const auto& [kind_name, kind] : drivers::tmcl::kYoubotKinds) {
    if (kind_name == name) return kind;
    known += (known.empty() ? "" : ", ") + std::string(kind_name);
  }
  throw std::invalid_argument("--kind: there is no '" + name + "'; known: " + known);
}

}  // namespace runtime
