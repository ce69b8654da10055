/// @file
/// Which velocities from the network may steer the base.
#pragma once
#include <chrono>
#include <cstdint>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>

#include "apps/youbotd/freshness.h"
#include "control/link_map.h"

namespace youbotd {

/// Everyone on the network can send messages, in any number and with any content, and the network may deliver
/// late. So one publisher steers at a time: the first one, until it is silent for as long as a commander may
/// be. After a silence, what arrives within Freshness::kLongSilence moves nothing. A message counts only if
/// its six numbers are finite and none exceeds kLargest: random bytes hardly ever pass.
///
/// Any thread.
class CmdVel {
 public:
  using Time = Freshness::Time;
  /// m/s and rad/s: the robot's own limits are far below.
  static constexpr double kLargest = 100;
  enum class Form : std::uint8_t { kTwist, kTwistStamped };
  struct Command {
    control::PlanarVector twist_B = control::PlanarVector::Zero();
    std::uint64_t publisher = 0;
    Form form = Form::kTwist;
  };
  struct Refused {
    std::uint64_t invalid = 0;  ///< messages of the publisher that steers, or would
    std::uint64_t others = 0;   ///< messages of others meanwhile
    friend bool operator==(const Refused&, const Refused&) = default;
  };

  /// `silence`: loop.commander_timeout_s.
  explicit CmdVel(std::chrono::nanoseconds silence) : silence_(silence) {}

  /// A message that has arrived.
  void hear(std::uint64_t publisher, Form form, std::string_view payload, Time now);
  /// The newest command that may steer and was not taken yet.
  std::optional<Command> take();
  Refused refused() const;

 private:
  mutable std::mutex mutex_;
  std::chrono::nanoseconds silence_;
  std::optional<std::uint64_t> steers_;  // the publisher
  Time heard_{};
  Freshness freshness_;
  std::optional<Command> newest_;
  Refused refused_;
};

}  // namespace youbotd
