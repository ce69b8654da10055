#include "drivers/haptic/falcon.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>

#include "drivers/setup_error.h"
#include "drivers/usb/ftdi_serial.h"

namespace drivers::haptic {
namespace {

using namespace std::chrono_literals;
using std::chrono::nanoseconds;
using usb::TransferResult;
using usb::TransferStatus;

// Reads in one exchange. The device sends one packet a millisecond, with or without bytes, and the port holds
// a few from the time since the last exchange.
constexpr int kMaxReads = 32;

constexpr int kZeroAttempts = 5;

// Around what the legs reach in use, in F: a position beyond it results from wrong counts.
// Outwards the legs themselves end, at 0.183 m.
constexpr double kLowest_m = 0.05;
constexpr double kRadius_m = 0.09;

bool in_reach(const Vector3& p_FG_m) noexcept {
  return p_FG_m[2] >= kLowest_m && std::hypot(p_FG_m[0], p_FG_m[1]) <= kRadius_m;
}

// Between frames F (x right, y up, z towards the user) and H: both are right-handed, so the axes only change
// places.
Vector3 from_H(const Vector3& v) noexcept { return {v[1], v[2], v[0]}; }
Vector3 to_H(const Vector3& v) noexcept { return {v[2], v[0], v[1]}; }

}  // namespace

std::vector<std::string> FalconConfig::problems() const {
  std::vector<std::string> found;
  const auto require = [&found](bool fulfilled, const char* what) {
    if (!fulfilled) found.emplace_back(what);
  };
  require(force_limit_N > 0.0 && force_limit_N <= 12.0, "force_limit_N must be above 0 and at most 12");
  require(std::isfinite(command_per_Nm) && command_per_Nm != 0.0 && std::abs(command_per_Nm) <= 5e4,
          "command_per_Nm must be other than 0 and at most 5e4 in magnitude");
  require(is_finite(p_FO_m), "p_FO_m must be finite");
  require(reply_deadline >= 3ms && reply_deadline <= 20ms, "reply_deadline must be 3 ms to 20 ms");
  require(lost_after_misses >= 1 && lost_after_misses <= 10, "lost_after_misses must be 1 to 10");
  require(boot.alive_packets >= 1 && boot.query_attempts >= 1 && boot.load_attempts >= 1,
          "boot: alive_packets, query_attempts and load_attempts must be 1 or more");
  require(boot.alive_timeout > 0ms && boot.query_timeout > 0ms && boot.echo_timeout > 0ms &&
              boot.write_timeout > 0ms,
          "boot: all time-outs must be above 0");
  return found;
}

Falcon::Falcon(usb::UsbPort& port, FalconConfig config) : port_(port), config_(std::move(config)) {
  const auto problems = config_.problems();
  if (problems.empty()) return;
  std::string all;
  for (const std::string& problem : problems) all += (all.empty() ? "" : "; ") + problem;
  throw SetupError({config_.boot.device, "check the configuration", "values that make sense", all,
                    "correct the configuration"});
}

Falcon::~Falcon() { deactivate(); }

falcon::Firmware Falcon::activate(std::span<const std::uint8_t> image) {
  latched_ = {.fault = HapticFault::kNotActive};
  // The steps below may fail before they reach the motors.
  if (may_push_) (void)send_zero();
  may_push_ = true;  // the previous user may have left a force on
  falcon::Firmware firmware{};
  try {
    firmware = falcon::start_firmware(port_, image, config_.boot);
  } catch (...) {
    (void)send_zero();
    throw;
  }
  may_push_ = false;                       // its last packet was zero, and replies came
  owed_ = config_.boot.alive_packets - 1;  // at most: start_firmware() does not report how often it asked
  misses_ = 0;
  homed_ = false;  // until a reply says otherwise
  located_ = false;
  latched_ = {};
  return firmware;
}

bool Falcon::deactivate() noexcept {
  latched_ = {.fault = HapticFault::kNotActive};
  return !may_push_ || send_zero();
}

/// True when two packets in a row went out: the rest of a torn packet may swallow the first.
bool Falcon::send_zero() noexcept {
  int in_a_row = 0;
  for (int attempt = 0; attempt < kZeroAttempts && in_a_row < 2; ++attempt) {
    const TransferResult result = write(at_rest());
    if (result.status == TransferStatus::kUnplugged) return false;
    in_a_row = result.ok() ? in_a_row + 1 : 0;
  }
  if (in_a_row < 2) return false;
  may_push_ = false;
  sent_N_ = {};
  return true;
}

DeviceStatus Falcon::exchange(const Vector3& f_D_H_N, DeviceSample& sample) noexcept {
  if (!latched_.ok()) {
    if (latched_.fault == HapticFault::kLost) (void)send_zero();
    latched_.f_D_H_N = sent_N_;
    return latched_;
  }
  const nanoseconds begin = port_.now();
  if (too_old(begin)) located_ = false;
  const bool had_position = located_;
  const bool good_force = is_finite(f_D_H_N);
  const Drive sent = had_position && good_force ? drive(f_D_H_N) : Drive{at_rest(), {}, false};

  // The packet goes out even when late replies could not be read: it may carry the zero that ends a force.
  const TransferResult late = discard_late_replies();
  ++owed_;  // also when the write fails: the packet may have gone out all the same
  TransferResult result = write(sent.command);
  if (result.ok() || sent.f_D_H_N != Vector3{}) sent_N_ = sent.f_D_H_N;
  if (!result.ok()) return miss(result);
  if (!late.ok() && late.status != TransferStatus::kTimeout) return miss(late);
  falcon::Reply reply;
  result = receive(reply, begin + config_.reply_deadline);
  if (!result.ok()) return miss(result);
  misses_ = 0;

  DeviceStatus status{.withheld = !had_position, .saturated = sent.saturated, .f_D_H_N = sent_N_};
  if (!locate(reply)) {
    status.fault = homed_ ? HapticFault::kBadSample : HapticFault::kNotReady;
    return status;
  }
  if (!good_force) status.fault = HapticFault::kBadCommand;
  status.fresh = true;
  for (std::size_t k = 0; k < 3; ++k) sample.p_HD_m[k] = p_FG_m_[k] - config_.p_FO_m[k];
  sample.p_HD_m = to_H(sample.p_HD_m);
  sample.buttons = reply.buttons;
  return status;
}

/// The hand may have moved the handle far since then, or the clock was set.
bool Falcon::too_old(nanoseconds now) const noexcept {
  return now < reply_stamp_ || now - reply_stamp_ > config_.lost_after_misses * config_.reply_deadline;
}

falcon::Command Falcon::at_rest() const noexcept {
  falcon::Command command;
  command.leds = {.green = homed_, .red = !homed_};
  return command;
}

Falcon::Drive Falcon::drive(Vector3 f_D_H_N) const noexcept {
  Drive result{at_rest(), {}, false};
  // hal::HapticServo keeps the same limit; this one keeps the torques below finite for any caller.
  result.saturated = shorten(f_D_H_N, config_.force_limit_N);
  const auto torques_Nm = falcon::leg_torques_Nm(p_FG_m_, from_H(f_D_H_N));
  if (!torques_Nm) {
    result.saturated = f_D_H_N != Vector3{};
    return result;
  }
  const Vector3 motors = times(*torques_Nm, config_.command_per_Nm);
  const double largest = std::max({std::abs(motors[0]), std::abs(motors[1]), std::abs(motors[2])});
  const bool beyond_motors = largest > falcon::kMotorLimit;
  const double part = beyond_motors ? falcon::kMotorLimit / largest : 1.0;
  for (std::size_t i = 0; i < falcon::kAxes; ++i) {
    result.command.motors[i] = static_cast<std::int32_t>(std::lround(motors[i] * part));
  }
  result.f_D_H_N = times(f_D_H_N, part);
  result.saturated = result.saturated || beyond_motors;
  return result;
}

/// False when an axis is not homed, or when the counts fit no position in reach.
bool Falcon::locate(const falcon::Reply& reply) noexcept {
  homed_ = reply.all_homed();
  located_ = false;
  if (!homed_) return false;
  const auto handle = falcon::grip_position(falcon::angles_rad(reply.counts), p_FG_m_);
  if (!handle.converged || !in_reach(handle.p_FG_m)) return false;
  located_ = true;
  p_FG_m_ = handle.p_FG_m;
  return true;
}

DeviceStatus Falcon::miss(const TransferResult& result) noexcept {
  DeviceStatus status{.fault = HapticFault::kMissed, .detail = static_cast<std::int32_t>(result.status)};
  if (result.status == TransferStatus::kUnplugged) {
    status.fault = HapticFault::kUnplugged;
    latched_ = status;
  } else if (++misses_ >= config_.lost_after_misses) {
    status.fault = HapticFault::kLost;
    latched_ = status;
    (void)send_zero();
  }
  status.f_D_H_N = sent_N_;
  return status;
}

TransferResult Falcon::write(const falcon::Command& command) noexcept {
  // Also when it fails: the packet may have gone out all the same.
  if (command.motors != at_rest().motors) may_push_ = true;
  return port_.write(falcon::encode(command), config_.reply_deadline);
}

/// One read: the latest of the replies that became complete with it, if any.
TransferResult Falcon::read(std::optional<falcon::Reply>& reply, nanoseconds timeout) noexcept {
  std::array<std::uint8_t, usb::ftdi::kPacketBytes> packet{};
  const TransferResult result = port_.read(packet, timeout);
  if (!result.ok()) return result;
  const auto bytes =
      usb::ftdi::strip_modem_status(std::span(packet).first(std::min(result.size, packet.size())));
  const std::uint64_t before = stream_.replies();
  reply = stream_.feed(bytes);
  owed_ = std::max(owed_ - static_cast<int>(stream_.replies() - before), 0);
  return result;
}

TransferResult Falcon::discard_late_replies() noexcept {
  TransferResult result;
  std::optional<falcon::Reply> late;
  for (int i = 0; i < kMaxReads && result.ok(); ++i) result = read(late, nanoseconds(0));
  return result;
}

/// Replies carry no number, but each command gets one and they keep their order: a late reply arrives first,
/// would pass for the next one, and every later reply would be one behind. So this waits for all outstanding
/// replies. When nothing comes for half a deadline behind one of them, the others were lost.
TransferResult Falcon::receive(falcon::Reply& reply, nanoseconds deadline) noexcept {
  std::optional<nanoseconds> stamp;
  for (int i = 0; i < kMaxReads && owed_ > 0; ++i) {
    const nanoseconds left = deadline - port_.now();
    std::optional<falcon::Reply> next;
    const TransferResult result =
        left > nanoseconds(0) ? read(next, left) : TransferResult{TransferStatus::kTimeout, 0, 0};
    if (result.status == TransferStatus::kTimeout) {
      if (stamp) owed_ = 0;
      break;
    }
    if (!result.ok()) return result;
    if (!next) continue;
    reply = *next;
    stamp = port_.now();
    deadline = *stamp + config_.reply_deadline / 2;
  }
  if (!stamp) return {TransferStatus::kTimeout, 0, 0};
  reply_stamp_ = *stamp;
  return {};
}

}  // namespace drivers::haptic
