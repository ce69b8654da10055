/// @file
/// A bench rig: one joint on one Trinamic module, over SocketCAN.
#pragma once
#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "hal/clock.h"
#include "hal/robot.h"
#include "hal/youbot_axes.h"

namespace drivers::can {
class SocketCan;
}  // namespace drivers::can
namespace drivers::tmcl {
class Clock;
}  // namespace drivers::tmcl

namespace hal {

struct CanOptions {
  std::string joint_name = "wheel-1";
  std::uint32_t module_id = 1;  ///< the module's global parameter 71
  std::uint32_t reply_id = 2;   ///< its global parameter 70
  std::uint8_t motor = 0;
  AxisData axis = kWheelAxis;
  /// The user states that axis.range is in the module's own count since power-up. The module does not find an
  /// end stop, so it does not know where the joint is in its range.
  bool range_is_stated = false;
  /// Required bit rate of the interface; 0: any. Setting it takes an administrator.
  std::uint32_t bitrate_bit_per_s = 1'000'000;
  /// 1 to 5: one command, the rest reads, pipelined. With 1 they alternate.
  int requests_per_cycle = 3;
  /// Time-out for the answers to a cycle's requests; then they count as lost, and the bus pauses for the same
  /// time.
  int patience_cycles = 3;
  /// Cycles without a full answer that are bridged with the last sample. One lost frame costs twice the
  /// patience.
  int tolerated_cycles = 10;
  /// Total time for all attempts to get the motor stop in deactivate() acknowledged.
  std::chrono::milliseconds stop_timeout{300};
  /// The module reports only the current's magnitude (depends on the firmware).
  bool unsigned_current = false;
};

/// Shortest period that leaves a fifth of the bus free: 250 bits per request and answer. At 1 Mbit/s and
/// three requests 0.94 ms, at 250 kbit/s 3.75 ms.
std::chrono::nanoseconds shortest_can_period(std::uint32_t bit_per_s, int requests_per_cycle) noexcept;

/// TMCL has no process data on CAN: commands and measurements are axis parameters, one request and one reply
/// each. exchange() reads the answers to the requests of the previous cycle and sends this cycle's; it never
/// waits. With three requests per cycle, the default:
///
///   each cycle        target (155 mA, 2 rpm or 0 ticks; motor stop while off), actual position (1)
///   in rotation       150 current, 3 velocity, 150, 156 status, 150, 3, 150, mark
///   sample, cycles    position 1, torque 1 to 2, velocity 1 to 4, fault 1 to 8
///
/// `stamp` is the time of the position request. The other settings: drivers/tmcl/polled_drive.h. The mark is
/// user variable 55, in RAM: a module that has restarted no longer holds it.
///
/// - activate() stops the motor of a known module. It rejects a bit rate too slow for the period, an unknown
///   module (known: TMCM-174, -1632, -KR-841, -1610 with firmware 1.48 and 2.0; TMCM-1630), an encoder that
///   differs from the axis data, and a module that cannot take a cycle's requests at once: the TMCL manual
///   allows one at a time, which is requests_per_cycle = 1.
/// - Every 10 ms the angle of the motor's Hall sensors (210) takes the place of one other reading:
///   control::HallAgreement compares it with the encoder. A module that refuses it is not asked
///   again until the next activate().
/// - `enable` clears the time-out flag, lets a winding cool whose I²t limit was exceeded and finds the
///   commutation where needed, as on EtherCAT: with firmware 2.0 the motor turns slightly. The TMCM-1630
///   finds it by itself.
/// - Lost answers, bus-off, a refused request, an error flag or a restarted module stop the motor and are
///   latched. After a restart the position has a new origin.
/// - deactivate() stops the motor and waits for the acknowledgement; if there is none, report() says so
///   afterwards.
/// - NO WATCHDOG: a module that receives nothing keeps its last target. If the cable breaks or this program
///   dies, only the emergency stop helps.
///
/// `open_socket` is called by activate(); `clock` must outlive the robot, and so must `setup_clock`, used for
/// waits in set-up and deactivate() (null: the machine's clock).
std::unique_ptr<Robot> make_can_robot(std::function<drivers::can::SocketCan()> open_socket,
                                      const CanOptions& options, const Clock& clock,
                                      std::chrono::nanoseconds period,
                                      drivers::tmcl::Clock* setup_clock = nullptr);

/// On a network interface, "can0".
std::unique_ptr<Robot> make_can_robot(const std::string& interface, const CanOptions& options,
                                      const Clock& clock, std::chrono::nanoseconds period);

/// Setup. Text for a status of such a robot: "no answer from the bus: bus off (check wiring ...)", "SAP
/// target_speed (2) refused: invalid value". The detail of
///   kFrameLost            CAN error classes (linux/can/error.h) | errno << 16
///   kJointFault           the JointFault; with kRefused | TMCL status << 8 | parameter << 16 | command << 24
std::string describe_can(const CycleStatus& status);

}  // namespace hal
