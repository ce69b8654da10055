/// @file
/// The cycle of the daemon: idle with the drives off, or one run after the other.
#pragma once
#include <chrono>
#include <cstdint>
#include <optional>

#include "drivers/ethercat/pcap_ring.h"
#include "hal/haptic_device.h"
#include "hal/newest_value.h"
#include "hal/robot.h"
#include "operation/live_feed.h"
#include "operation/run.h"

namespace youbotd {

/// The current orders, as levels.
struct Orders {
  std::uint64_t serial = 0;       ///< incremented with each order
  std::uint64_t number = 0;       ///< of the run; each is done once. 0: none
  operation::Run* run = nullptr;  ///< valid until LoopReport::ended has its number
  bool stop = false;              ///< come to rest, then switch the drives off
  bool off = false;               ///< switch the drives off at once
  bool leave_master = false;      ///< no exchange with the haptic device, so that it can be reopened
};

struct LoopReport {
  std::uint64_t heard = 0;  ///< serial of the orders that this cycle followed
  std::uint64_t cycles = 0;
  std::uint64_t ended = 0;       ///< number of the last finished run
  bool unheard = false;          ///< the newest run comes, or came, to rest because orders were missing
  operation::Progress progress;  ///< of the current run
  hal::CycleStatus robot{};      ///< without a run
  hal::HapticStatus master{};
  bool master_left = false;
};

/// Connects two threads: one steps it, for runtime::run_loop(), the other gives orders and reads reports.
class ServedLoop {
 public:
  /// `master` (haptic device), `capture`, which does not record between runs, and `live` may be null. All
  /// must outlive the loop. A run comes to rest if it has no orders for longer than `silence`, or this loop
  /// did not step it for as long, because nothing else could stop it.
  ServedLoop(hal::Robot& robot, hal::HapticDevice* master, drivers::ethercat::PcapRing* capture,
             std::chrono::nanoseconds silence, operation::LiveFeed* live = nullptr)
      : robot_(robot), master_(master), capture_(capture), silence_(silence), live_(live) {}

  // Called by the other thread.
  void order(const Orders& orders) noexcept { orders_channel_.publish(orders); }
  bool take(LoopReport& report) noexcept { return reports_.take(report); }

  // Cycle.
  void step(std::chrono::nanoseconds now) noexcept;
  /// From now on: brings the current run to rest and begins no other. The loop goes on.
  void rest() noexcept { resting_ = true; }
  /// Likewise, and ends the loop after it.
  void request_stop() noexcept { resting_ = ending_ = true; }
  bool finished() const noexcept { return ending_ && run_ == nullptr; }
  runtime::CycleTimes& record() noexcept { return times_; }
  /// After step(), once `record()` is complete.
  void keep() noexcept;

 private:
  void heed(std::chrono::nanoseconds now) noexcept;
  void call_off() noexcept;
  void idle() noexcept;
  void show_idle() noexcept;

  hal::Robot& robot_;
  hal::HapticDevice* master_;
  drivers::ethercat::PcapRing* capture_;
  std::chrono::nanoseconds silence_;
  operation::LiveFeed* live_;
  hal::NewestValue<Orders> orders_channel_;
  hal::NewestValue<LoopReport> reports_;
  Orders orders_;
  std::optional<std::chrono::nanoseconds> last_order_;
  std::chrono::nanoseconds last_step_{};
  operation::Run* run_ = nullptr;  // the one under way
  std::uint64_t number_ = 0;       // its number
  LoopReport report_;
  runtime::CycleTimes times_;
  hal::RobotSample robot_sample_;
  hal::HapticSample master_sample_;
  bool resting_ = false;
  bool ending_ = false;
};

}  // namespace youbotd
