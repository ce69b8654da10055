/// @file
/// The cycle of a daemon that is told what to do: idle with the drives off, or one run after the other.
#pragma once
#include <chrono>
#include <cstdint>
#include <optional>

#include "drivers/ethercat/pcap_ring.h"
#include "hal/haptic_device.h"
#include "hal/newest_value.h"
#include "hal/robot.h"
#include "operation/run.h"

namespace youbotd {

/// A level: what is to be done now.
struct Orders {
  std::uint64_t serial = 0;       ///< grows by one with each order given
  std::uint64_t number = 0;       ///< of the run; each is done once. 0: none
  operation::Run* run = nullptr;  ///< lives until Told::ended says its number
  bool stop = false;              ///< comes to rest, then drives off
  bool off = false;               ///< drives off at once
  bool leave_master = false;      ///< no exchange with the master, so that it can be opened again
};

struct Told {
  std::uint64_t heard = 0;  ///< serial of the orders that this cycle followed; what is told is as new as they
  std::uint64_t cycles = 0;
  std::uint64_t ended = 0;       ///< number of the last run that is over
  bool unheard = false;          ///< the newest run comes, or came, to rest because no orders were heard
  operation::Progress progress;  ///< of the run under way
  hal::CycleStatus robot{};      ///< while there is none
  hal::HapticStatus master{};
  bool master_left = false;
};

/// Stands between two threads: one steps it, as runtime::run_loop() wants it, the other gives orders and is
/// told.
class ServedLoop {
 public:
  /// `master` and `capture`, which keeps still from the end of a run to the next, may be null. All outlive
  /// the loop. A run without orders for longer than `silence`, or that this loop did not step for as long,
  /// comes to rest, because nothing else could stop it.
  ServedLoop(hal::Robot& robot, hal::HapticDevice* master, drivers::ethercat::PcapRing* capture,
             std::chrono::nanoseconds silence)
      : robot_(robot), master_(master), capture_(capture), silence_(silence) {}

  // The other thread.
  void order(const Orders& orders) noexcept { orders_channel_.publish(orders); }
  bool take(Told& told) noexcept { return told_channel_.take(told); }

  // Cycle.
  void step(std::chrono::nanoseconds now) noexcept;
  /// Ends the run under way, then the loop.
  void request_stop() noexcept { ending_ = true; }
  bool finished() const noexcept { return ending_ && run_ == nullptr; }
  runtime::CycleTimes& record() noexcept { return times_; }
  /// After step(), when `record()` is complete.
  void keep() noexcept;

 private:
  void heed(std::chrono::nanoseconds now) noexcept;
  void call_off() noexcept;
  void idle() noexcept;

  hal::Robot& robot_;
  hal::HapticDevice* master_;
  drivers::ethercat::PcapRing* capture_;
  std::chrono::nanoseconds silence_;
  hal::NewestValue<Orders> orders_channel_;
  hal::NewestValue<Told> told_channel_;
  Orders orders_;
  std::optional<std::chrono::nanoseconds> last_order_;
  std::chrono::nanoseconds last_step_{};
  operation::Run* run_ = nullptr;  // the one under way
  std::uint64_t number_ = 0;       // its number
  Told told_;
  runtime::CycleTimes times_;
  hal::RobotSample robot_sample_;
  hal::HapticSample master_sample_;
  bool ending_ = false;
};

}  // namespace youbotd
