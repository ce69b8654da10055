#include "apps/youbotd/check_parts.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <filesystem>
#include <map>
#include <sstream>
#include <string>
#include <string_view>
#include <system_error>

#include "drivers/usb/usb_devices.h"

namespace youbotd {
namespace {

namespace fs = std::filesystem;
using drivers::usb::first_line;
using drivers::usb::SystemPaths;
using Mark = Finding::Mark;

/// Reading these takes a microsecond or more, or they are constant for longer than a cycle.
constexpr std::array<std::string_view, 4> kSlowClocks{"hpet", "acpi_pm", "jiffies", "refined-jiffies"};

/// "6.1.0-18-rt-amd64", the third word of /proc/version.
std::string release_in(const std::string& version) {
  std::istringstream words(version);
  std::string word;
  for (int i = 0; i < 3; ++i) words >> word;
  return word;
}

std::optional<long> number_in(const fs::path& file) {
  const std::string text = first_line(file);
  long value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  return error == std::errc() && end == text.data() + text.size() ? std::optional(value) : std::nullopt;
}

/// "cpu12", and not "cpufreq".
bool is_core(const std::string& name) {
  return name.size() > 3 && name.starts_with("cpu") &&
         std::all_of(name.begin() + 3, name.end(), [](unsigned char c) { return std::isdigit(c) != 0; });
}

}  // namespace

Finding check_kernel(const SystemPaths& paths) {
  const std::string version = first_line(paths.proc / "version");
  const std::string kernel = "kernel: " + release_in(version);
  // Debian's kernel states it in both places, one built without the file only in the text.
  if (first_line(paths.sys / "kernel/realtime") == "1" || version.find("PREEMPT_RT") != std::string::npos)
    return {Mark::kOk, kernel + ", PREEMPT_RT"};
  const bool preemptible = version.find("PREEMPT") != std::string::npos;
  return {Mark::kWarn,
          kernel + (preemptible ? ", preemptible but" : ",") +
              " not PREEMPT_RT: the latency of a cycle is unbounded",
          "sudo apt install linux-image-rt-$(dpkg --print-architecture), then restart the machine"};
}

Finding check_clock_source(const SystemPaths& paths) {
  const fs::path folder = paths.sys / "devices/system/clocksource/clocksource0";
  const std::string current = first_line(folder / "current_clocksource");
  if (std::ranges::find(kSlowClocks, current) == kSlowClocks.end())
    return {Mark::kOk, "clock source: " + (current.empty() ? "unknown" : current)};
  std::istringstream others(first_line(folder / "available_clocksource"));
  std::string better;
  while (others >> better && std::ranges::find(kSlowClocks, better) != kSlowClocks.end()) better.clear();
  return {Mark::kWarn, "clock source: " + current + ", slow to read",
          better.empty() ? "sudo dmesg | grep -i clocksource shows why the processor's own is not used"
                         : "echo " + better + " | sudo tee " + (folder / "current_clocksource").string()};
}

Finding check_throttling(bool busy_wait, const SystemPaths& paths) {
  const auto runtime_us = number_in(paths.proc / "sys/kernel/sched_rt_runtime_us");
  const auto period_us = number_in(paths.proc / "sys/kernel/sched_rt_period_us");
  if (!runtime_us || !period_us || *runtime_us < 0 || *runtime_us >= *period_us)
    return {Mark::kOk, "real-time share: not limited"};
  const std::string share = "real-time share: " + std::to_string(*runtime_us / 1000) + " ms of each " +
                            std::to_string(*period_us / 1000) + " ms";
  const std::string no_limit = "sudo sysctl kernel.sched_rt_runtime_us=-1";
  if (*runtime_us == 0) return {Mark::kFail, share, no_limit};
  if (busy_wait) return {Mark::kWarn, share + ", and ethercat.busy_wait takes all of a core", no_limit};
  return {Mark::kOk, share};
}

std::optional<Finding> check_governor(std::optional<int> cpu, const SystemPaths& paths) {
  const fs::path folder = paths.sys / "devices/system/cpu";
  std::map<std::string, int> governors;
  std::error_code unreadable;
  for (fs::directory_iterator entry(folder, unreadable), end; !unreadable && entry != end;
       entry.increment(unreadable)) {
    const std::string core = entry->path().filename().string();
    if (!is_core(core) || (cpu && core != "cpu" + std::to_string(*cpu))) continue;
    const std::string governor = first_line(entry->path() / "cpufreq/scaling_governor");
    if (!governor.empty()) ++governors[governor];
  }
  if (governors.empty()) return std::nullopt;
  std::string found = "processor clock:";
  for (const auto& [governor, cores] : governors)
    found += " " + governor + " on " + std::to_string(cores) + (cores == 1 ? " core" : " cores");
  if (governors.size() == 1 && governors.begin()->first == "performance") return Finding{Mark::kOk, found};
  const std::string cores = cpu ? "cpu" + std::to_string(*cpu) : "cpu[0-9]*";
  return Finding{Mark::kWarn, found + "; the first cycles after a rest are slower",
                 "echo performance | sudo tee " + (folder / cores / "cpufreq/scaling_governor").string()};
}

}  // namespace youbotd
