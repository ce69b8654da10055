#include "runtime/station/link_options.h"

#include <spdlog/fmt/fmt.h>

#include <cmath>

#include "hal/seconds.h"

namespace runtime {
void read_link(TomlTable& table, Role role, const std::filesystem::path& folder, LinkOptions& options) {
  table.text("listen", options.listen);
  table.text("peer", options.peer);
  std::string key_file;
  table.text("key_file", key_file);
  if (!key_file.empty()) options.key_file = folder / key_file;
  double silence_s = hal::seconds(options.endpoint.silence);
  table.number("silence_s", silence_s, {.min = 0.05, .max = 0.5});
  options.endpoint.silence = std::chrono::milliseconds(std::llround(1e3 * silence_s));
  table.integer("redundancy_max", options.endpoint.most_repeated,
                {.min = 0, .max = drivers::station::kMaxRepeated});
  table.boolean("passivity", options.port.active);
  table.number("reserve_J", options.port.tank.reserve_J, {.min = 1e-4, .max = 0.1});
  table.number("surplus_J", options.port.surplus_J, {.min = 0, .max = 1});
  table.number("damping_N_s_per_m", options.port.tank.damping_N_s_per_m, {.min = 0, .max = 50});
  if (role == Role::kBoth) return;
  if (options.key_file.empty())
    table.refuse("key_file", "is missing: two stations need one; `youbotd --make-key FILE` makes it");
  if (role == Role::kRobot && options.listen.empty())
    table.refuse("listen", "is missing: the robot's station waits for the operator's at HOST:PORT");
  if (role == Role::kOperator && options.peer.empty())
    table.refuse("peer", "is missing: the operator's station looks for the robot's at HOST:PORT");
}

std::string describe(const drivers::station::LinkReport& report) {
  if (!report.connected) return "not connected";
  return fmt::format(
      "connected, round trip {:.1f} ms (least {:.1f}), clock offset {:.1f} ms, {:.1f} % lost here and {:.1f} "
      "% "
      "there, {} states repeated",
      hal::milliseconds(report.round_trip), hal::milliseconds(report.shortest_round_trip),
      hal::milliseconds(report.clock_offset), 0.1 * report.lost_permille, 0.1 * report.lost_there_permille,
      report.repeated);
}

}  // namespace runtime
