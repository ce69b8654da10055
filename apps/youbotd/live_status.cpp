#include "apps/youbotd/live_status.h"

#include <variant>

#include "apps/youbotd/status_json.h"

namespace youbotd {

void LiveStatus::hear(const operation::LiveSample& sample) {
  phase_ = std::visit([](const auto& record) { return name(record.phase); }, sample.record);
}

void LiveStatus::complete(nlohmann::json& status) const {
  status["cycle_us"] = {{"bounds", operation::LiveHistogram::kBounds_us},
                        {"wake_up", feed_.wake_up().counts()},
                        {"step", feed_.step().counts()}};
  status["samples_lost"] = reader_.lost();
  if (commanded_) return;
  status["phase"] = status.value("ended", false) ? "ended" : phase_;
  feed_.with_robot([&](const hal::Robot& robot) {
    status["robot_trouble"] = robot.device_faults();
    status["devices"] = json_of(robot.devices());
    status["bus"] = json_of(robot.losses());
  });
}

}  // namespace youbotd
