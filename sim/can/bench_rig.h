/// @file
/// The bench rig: one motor controller on a CAN bus, one joint behind it.
#pragma once
#include <linux/can.h>

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <utility>

#include "sim/bus/arm_joint.h"
#include "sim/bus/axis_data.h"
#include "sim/bus/tmcm_board.h"
#include "sim/can/ring.h"

namespace sim::can {

/// A youBot wheel on its gear, turning freely; its friction is an assumption.
inline constexpr bus::ArmJointData kBenchWheel{.axis = bus::kWheelBoardAxis,
                                               .lower_stop_rad = -1e6,
                                               .upper_stop_rad = 1e6,
                                               .load_inertia_kg_m2 = 1.61e-3,
                                               .coulomb_Nm = 0.08,
                                               .viscous_Nm_s_per_rad = 0.02};

struct BenchRigOptions {
  bus::ArmJointData joint = kBenchWheel;
  bus::TmcmOptions board = {.controller = 1610, .axis = kBenchWheel.axis};
  std::uint32_t module_id = 1;
  std::uint32_t reply_id = 2;
  std::uint32_t bit_per_s = 1'000'000;
  /// From the end of a request until its reply is ready; one after the other.
  std::chrono::nanoseconds processing_time = std::chrono::microseconds(30);
  /// Requests that wait during the processing of another one; further ones are dropped silently.
  std::size_t buffered_requests = 8;
  std::uint64_t noise_seed = 1;
};

/// The bus carries one frame at a time, each as long as worst-case stuffing makes it; of two waiting frames
/// the lower identifier goes first. Only the module acknowledges: while its power is off or the cable is
/// unplugged, the host's frame stays and an error frame reports it every millisecond, as passed on by the
/// kernel; the queue behind it fills. Board and joint advance in periods of a millisecond. One thread. Cycle:
/// all except the constructor.
class BenchRig {
 public:
  static constexpr std::size_t kHostQueue = 10;  // txqueuelen of a CAN interface

  /// @throws std::invalid_argument see bus::ArmJoint
  explicit BenchRig(const BenchRigOptions& options = {});
  BenchRig(const BenchRig&) = delete;
  BenchRig& operator=(const BenchRig&) = delete;

  // ---- the host's interface ----

  /// False if its queue is full.
  bool send(const can_frame& frame) noexcept { return to_bus_.push(frame); }
  /// False if nothing was received.
  bool receive(can_frame& frame) noexcept;
  void advance(std::chrono::nanoseconds step) noexcept;
  std::chrono::nanoseconds now() const noexcept { return now_; }

  // ---- for scripts and tests ----

  bus::TmcmBoard& board() noexcept { return board_; }
  const bus::ArmJoint& joint() const noexcept { return joint_; }
  /// Time since the board last executed a request.
  std::chrono::nanoseconds unheard() const noexcept { return now_ - last_request_; }
  /// Setup: called at the end of each period, after joint and board.
  void after_each_period(std::function<void()> look) noexcept { look_ = std::move(look); }
  /// Off: forgets everything that is not in its EEPROM; the joint coasts.
  void set_power(bool on) noexcept;
  void set_cable(bool in) noexcept { cable_in_ = in; }
  /// The next ones are lost.
  void lose_replies(int count) noexcept { replies_to_lose_ = count; }
  void lose_requests(int count) noexcept { requests_to_lose_ = count; }
  /// The controller of the host's interface disconnects, as after many errors; or is restarted.
  void set_bus_off(bool off) noexcept;

 private:
  struct Transfer {
    can_frame frame;
    bool from_host;
    std::chrono::nanoseconds until;
  };
  struct Work {
    can_frame reply;
    std::chrono::nanoseconds until;
  };
  static constexpr std::size_t kBuffer = 64;

  bool acknowledged() const noexcept { return powered_ && cable_in_ && !bus_off_; }
  void start_transfer() noexcept;
  void end_transfer() noexcept;
  void start_work() noexcept;
  void tick() noexcept;
  void report_error(std::uint32_t classes) noexcept;
  std::chrono::nanoseconds frame_time(const can_frame& frame) const noexcept;

  BenchRigOptions options_;
  bus::ArmJoint joint_;
  bus::TmcmBoard board_;
  std::chrono::nanoseconds now_{};
  std::chrono::nanoseconds next_tick_ = bus::TmcmBoard::kPeriod;
  std::chrono::nanoseconds last_request_{};
  std::function<void()> look_;

  Ring<can_frame, kHostQueue> to_bus_;
  Ring<can_frame, kBuffer> to_host_;
  Ring<can_frame, kBuffer> requests_;
  Ring<can_frame, kBuffer> replies_;
  std::optional<Transfer> transfer_;  // on the bus
  std::optional<Work> work_;          // in the board

  bool powered_ = true;
  bool cable_in_ = true;
  bool bus_off_ = false;
  int replies_to_lose_ = 0;
  int requests_to_lose_ = 0;
};

}  // namespace sim::can
