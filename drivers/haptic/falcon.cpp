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
using falcon::Vector3;
using std::chrono::nanoseconds;
using usb::TransferResult;
using usb::TransferStatus;

// Reads in one exchange. The device has one packet a millisecond to send, with or without bytes, and the port
// holds a few that came since the last exchange.
constexpr int kMaxReads = 32;

constexpr int kZeroAttempts = 5;

// Around what the legs reach in use, in F: a position beyond it comes of counts that are wrong.
// Outwards the legs themselves end, at 0.183 m.
constexpr double kLowest_m = 0.05;
constexpr double kRadius_m = 0.09;

bool in_reach(const Vector3& p_FG_m) noexcept {
  return p_FG_m[2] >= kLowest_m && std::hypot(p_FG_m[0], p_FG_m[1]) <= kRadius_m;
}

bool is_finite(const Vector3& v) noexcept {
  return std::ranges::all_of(v, [](double value) { return std::isfinite(value); });
}

Vector3 times(const Vector3& v, double factor) noexcept {
  return {v[0] * factor, v[1] * factor, v[2] * factor};
}

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
  require(ramp >= 100ms && ramp <= 60s, "ramp must be 0.1 s to 60 s");
  require(ramp_again >= 100ms && ramp_again <= 60s, "ramp_again must be 0.1 s to 60 s");
  require(boot.alive_packets >= 1 && boot.query_attempts >= 1 && boot.load_attempts >= 1,
          "boot: alive_packets, query_attempts and load_attempts must be 1 or more");
  require(boot.alive_timeout > 0ms && boot.query_timeout > 0ms && boot.echo_timeout > 0ms &&
              boot.write_timeout > 0ms,
          "boot: all time-outs must be above 0");
  return found;
}

const char* describe(FalconFault fault) noexcept {
  switch (fault) {
    case FalconFault::kNone: return "no fault";
    case FalconFault::kIdle: return "not activated";
    case FalconFault::kBadForce: return "force not finite, zero sent";
    case FalconFault::kMissed: return "no reply";
    case FalconFault::kNoPosition: return "encoder counts fit no position in reach";
    case FalconFault::kLost: return "lost: several replies missing in a row";
    case FalconFault::kUnplugged: return "unplugged";
  }
  return "unknown fault";
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
  latched_ = {FalconFault::kIdle, {}, 0};
  // What follows may fail before it comes to the motors.
  if (may_push_) (void)send_zero();
  may_push_ = true;  // who used the device before may have left a force on
  falcon::Firmware firmware{};
  try {
    firmware = falcon::start_firmware(port_, image, config_.boot);
  } catch (...) {
    (void)send_zero();
    throw;
  }
  may_push_ = false;                       // its last packet was zero, and replies came
  owed_ = config_.boot.alive_packets - 1;  // at most: it does not tell how often it asked
  misses_ = 0;
  homed_ = false;  // until a reply says otherwise
  located_ = false;
  ramp_begin_.reset();
  ramp_time_ = config_.ramp;
  latched_ = {};
  return firmware;
}

bool Falcon::deactivate() noexcept {
  latched_ = {FalconFault::kIdle, {}, 0};
  return !may_push_ || send_zero();
}

/// True when two packets in a row went out: the rest of one that was torn may swallow the first.
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

FalconStatus Falcon::exchange(const Vector3& f_G_F_N, FalconSample& sample) noexcept {
  if (!latched_.ok()) {
    if (latched_.fault == FalconFault::kLost) (void)send_zero();
    return latched_;
  }
  const nanoseconds begin = port_.now();
  if (too_old(begin)) located_ = false;
  const bool good_force = is_finite(f_G_F_N);
  if (!good_force || !located_) interrupt_ramp(begin);
  const Drive sent = good_force && located_ ? drive(f_G_F_N, gain(begin)) : Drive{at_rest(), {}, false};

  // Whatever became of the late ones, the packet has to go out: it may be the zero that somebody waits for.
  const TransferResult late = discard_late_replies();
  ++owed_;  // also when the write fails: the packet may have gone out all the same
  TransferResult result = write(sent.command);
  if (result.ok() || sent.force_N != Vector3{}) sent_N_ = sent.force_N;
  if (!result.ok()) return miss(result);
  if (!late.ok() && late.status != TransferStatus::kTimeout) return miss(late);
  falcon::Reply reply;
  result = receive(reply, begin + config_.reply_deadline);
  if (!result.ok()) return miss(result);
  misses_ = 0;

  if (!locate(reply)) return {FalconFault::kNoPosition, {}, 0};
  sample.stamp = reply_stamp_;
  sample.homed = homed_;
  for (std::size_t axis = 0; axis < falcon::kAxes; ++axis) {
    sample.axis_homed[axis] = (reply.homed >> axis & 1U) != 0;
  }
  sample.p_OG_m = p_OG_m_;
  sample.counts = reply.counts;
  sample.buttons = reply.buttons;
  sample.f_G_F_N = sent.force_N;
  sample.limited = sent.limited;
  return {good_force ? FalconFault::kNone : FalconFault::kBadForce, {}, 0};
}

/// The hand may have moved the grip far since then, or the clock was set.
bool Falcon::too_old(nanoseconds now) const noexcept {
  return now < reply_stamp_ || now - reply_stamp_ > config_.lost_after_misses * config_.reply_deadline;
}

falcon::Command Falcon::at_rest() const noexcept {
  falcon::Command command;
  command.leds = {.green = homed_, .red = !homed_};
  return command;
}

/// 0 in the first packet after an interruption.
double Falcon::gain(nanoseconds now) noexcept {
  if (!ramp_begin_) ramp_begin_ = now;
  using Seconds = std::chrono::duration<double>;
  return std::clamp(Seconds(now - *ramp_begin_) / Seconds(ramp_time_), 0.0, 1.0);
}

void Falcon::interrupt_ramp(nanoseconds now) noexcept {
  if (ramp_begin_ && now - *ramp_begin_ >= ramp_time_) ramp_time_ = config_.ramp_again;
  ramp_begin_.reset();
}

Falcon::Drive Falcon::drive(const Vector3& wanted_N, double gain) const noexcept {
  Drive result{at_rest(), {}, false};
  const double magnitude_N = std::hypot(wanted_N[0], wanted_N[1], wanted_N[2]);
  if (magnitude_N == 0.0) return result;
  // Finite numbers may have an infinite magnitude: that leaves no force.
  const bool limited = magnitude_N > config_.force_limit_N;
  const double share = limited ? config_.force_limit_N / magnitude_N : 1.0;
  const Vector3 force_N = times(times(wanted_N, share), gain);
  const auto torques_Nm = falcon::leg_torques_Nm(p_FG_m_, force_N);
  if (!torques_Nm) {
    result.limited = true;
    return result;
  }
  const Vector3 motors = times(*torques_Nm, config_.command_per_Nm);
  const double largest = std::max({std::abs(motors[0]), std::abs(motors[1]), std::abs(motors[2])});
  const bool saturated = largest > falcon::kMotorLimit;
  const double part = saturated ? falcon::kMotorLimit / largest : 1.0;
  for (std::size_t i = 0; i < falcon::kAxes; ++i) {
    result.command.motors[i] = static_cast<std::int32_t>(std::lround(motors[i] * part));
  }
  result.force_N = times(force_N, part);
  result.limited = limited || saturated;
  return result;
}

/// False when the counts of homed axes fit no place in reach.
bool Falcon::locate(const falcon::Reply& reply) noexcept {
  homed_ = reply.all_homed();
  located_ = false;
  if (!homed_) {
    ramp_begin_.reset();
    ramp_time_ = config_.ramp;
    return true;
  }
  const auto grip = falcon::grip_position(falcon::angles_rad(reply.counts), p_FG_m_);
  if (!grip.converged || !in_reach(grip.p_FG_m)) return false;
  located_ = true;
  p_FG_m_ = grip.p_FG_m;
  for (std::size_t k = 0; k < 3; ++k) p_OG_m_[k] = p_FG_m_[k] - config_.p_FO_m[k];
  return true;
}

FalconStatus Falcon::miss(const TransferResult& result) noexcept {
  FalconStatus status{FalconFault::kMissed, result.status, result.code};
  if (result.status == TransferStatus::kUnplugged) {
    status.fault = FalconFault::kUnplugged;
    latched_ = status;
  } else if (++misses_ >= config_.lost_after_misses) {
    status.fault = FalconFault::kLost;
    latched_ = status;
    (void)send_zero();
  }
  return status;
}

TransferResult Falcon::write(const falcon::Command& command) noexcept {
  // Also when it fails, as above.
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

/// Replies carry no number, but each command gets one and they keep their order: a late one that is still on
/// its way comes first, and would pass for the next one's, and so on for ever. So all that are owed are
/// waited for. When nothing comes for half a deadline behind one of them, the others were lost.
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
