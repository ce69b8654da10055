#include "runtime/stop_reason.h"

#include <spdlog/fmt/fmt.h>

#include <cmath>

#include "hal/seconds.h"
#include "runtime/recent_pause.h"
#include "runtime/stop_hints.h"

namespace runtime {

std::string what(const StopReason& reason, const hal::Robot& robot, const hal::HapticDevice* master) {
  using Kind = StopReason::Kind;
  const std::string joint =
      reason.joint >= 0 ? robot.joints()[static_cast<std::size_t>(reason.joint)].name : "the robot";
  switch (reason.kind) {
    case Kind::kNone: return "no stop reason";
    case Kind::kRobotFault:
      return fmt::format("{}{}: {}; drives switched off", then(reason.pause), joint,
                         robot.explain(reason.status));
    case Kind::kNotEnabled:
      return fmt::format("the drives did not start to obey within {:g} s{}", reason.value, kNotEnabledHint);
    case Kind::kNotObeying: return then(reason.pause) + "the drives went off by themselves";
    case Kind::kStalled:
      return fmt::format("this program did not run for {:.3f} s; braked or switched off{}", reason.value,
                         kStalledHint);
    case Kind::kNotAtRest:
      if (!std::isfinite(reason.value))
        return fmt::format("after braking for {:g} s it does not rest; drives switched off", reason.limit);
      return fmt::format(
          "after braking for {:g} s a joint still turns at {:.2f} rad/s; drives switched off: check for a "
          "slope or a person who pushes it",
          reason.limit, reason.value);
    default: break;
  }
  std::string of_master;
  if (reason.kind == Kind::kMasterFault && master != nullptr)
    of_master = then(reason.pause) + master->info().name + ": " + master->describe(reason.master);
  return fmt::format(fmt::runtime(reason.text), fmt::arg("joint", joint), fmt::arg("value", reason.value),
                     fmt::arg("limit", reason.limit), fmt::arg("master", of_master));
}

std::string what(const StopReason& reason, const StopReason& cut_short_by, const hal::Robot& robot,
                 const hal::HapticDevice* master) {
  std::string text = what(reason, robot, master);
  if (cut_short_by) text += "; before it came to rest, " + what(cut_short_by, robot, master);
  return text;
}

std::string describe(const StopReason& reason, const hal::Robot& robot, const hal::HapticDevice* master) {
  return describe(reason, {}, robot, master);
}

std::string describe(const StopReason& reason, const StopReason& cut_short_by, const hal::Robot& robot,
                     const hal::HapticDevice* master) {
  return fmt::format("cycle {} ({:.3f} s): {}", reason.cycle, hal::seconds(reason.time),
                     what(reason, cut_short_by, robot, master));
}

}  // namespace runtime
