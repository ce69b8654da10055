#include "sim/can/bench_rig.h"

#include <linux/can/error.h>

#include <algorithm>
#include <span>

#include "drivers/tmcl/telegram.h"

namespace sim::can {
namespace {

using std::chrono::nanoseconds;

/// Identifier, substitute bits, length, check sum and their worst-case stuff bits: Bosch CAN 2.0, part A,
/// counted bit by bit, independent of drivers/can/frame_time.h.
constexpr std::int64_t worst_bits(int bytes) noexcept {
  const int stuffable = 1 + 11 + 1 + 1 + 1 + 4 + 8 * bytes + 15;
  const int plain = 1 + 2 + 7 + 3;  // delimiter, acknowledge, end of frame, interframe space
  return stuffable + (stuffable - 1) / 4 + plain;
}

}  // namespace

BenchRig::BenchRig(const BenchRigOptions& options)
    : options_(options), joint_(options.joint, 0.0, options.noise_seed), board_(joint_, options.board) {}

bool BenchRig::receive(can_frame& frame) noexcept {
  if (to_host_.empty()) return false;
  frame = to_host_.front();
  to_host_.pop();
  return true;
}

nanoseconds BenchRig::frame_time(const can_frame& frame) const noexcept {
  return nanoseconds(worst_bits(frame.can_dlc) * 1'000'000'000 / options_.bit_per_s);
}

void BenchRig::advance(nanoseconds step) noexcept {
  const nanoseconds end = now_ + step;
  while (true) {
    if (!transfer_) start_transfer();
    if (!work_) start_work();
    nanoseconds next = std::min(end, next_tick_);
    if (transfer_) next = std::min(next, transfer_->until);
    if (work_) next = std::min(next, work_->until);
    now_ = next;
    if (transfer_ && transfer_->until <= now_) {
      end_transfer();
    } else if (work_ && work_->until <= now_) {
      (void)replies_.push(work_->reply);
      work_.reset();
    } else if (next_tick_ <= now_) {
      tick();
    } else {
      return;
    }
  }
}

void BenchRig::start_transfer() noexcept {
  if (!acknowledged() || (to_bus_.empty() && replies_.empty())) return;
  const bool from_host =
      replies_.empty() || (!to_bus_.empty() && to_bus_.front().can_id < replies_.front().can_id);
  const can_frame frame = from_host ? to_bus_.front() : replies_.front();
  transfer_ = {frame, from_host, now_ + frame_time(frame)};
}

void BenchRig::end_transfer() noexcept {
  const Transfer done = *transfer_;
  transfer_.reset();
  if (!acknowledged()) return;  // aborted; the host's frame stays in its queue
  if (!done.from_host) {
    replies_.pop();
    if (replies_to_lose_ > 0) {
      --replies_to_lose_;
    } else {
      (void)to_host_.push(done.frame);
    }
    return;
  }
  to_bus_.pop();
  if (done.frame.can_id != options_.module_id) return;
  if (requests_to_lose_ > 0) {
    --requests_to_lose_;
  } else if (requests_.size() < options_.buffered_requests) {
    (void)requests_.push(done.frame);
  }
}

/// The request takes effect at its start; its reply is ready at its end.
void BenchRig::start_work() noexcept {
  if (!powered_ || requests_.empty()) return;
  const can_frame frame = requests_.front();
  const auto request = drivers::tmcl::decode_can_request(static_cast<std::uint8_t>(options_.module_id),
                                                         {frame.data, frame.can_dlc});
  requests_.pop();
  if (!request) return;
  // The telegram without its first byte, the host's address; a text has no such byte.
  last_request_ = now_;
  const drivers::tmcl::MailboxBytes telegram = board_.execute(*request);
  const bool text = drivers::tmcl::asks_for_text(*request);
  can_frame reply{};
  reply.can_id = options_.reply_id;
  reply.can_dlc = text ? frame.can_dlc : std::uint8_t{7};
  std::copy_n(telegram.begin() + (text ? 0 : 1), reply.can_dlc, reply.data);
  work_ = {reply, now_ + options_.processing_time};
}

void BenchRig::tick() noexcept {
  next_tick_ += bus::TmcmBoard::kPeriod;
  joint_.advance(bus::TmcmBoard::kPeriod);
  board_.advance(bus::TmcmBoard::kPeriod);
  if (look_) look_();
  if (!acknowledged() && !bus_off_ && !to_bus_.empty()) report_error(CAN_ERR_ACK);
}

void BenchRig::set_power(bool on) noexcept {
  powered_ = on;
  requests_.clear();
  replies_.clear();
  work_.reset();
  board_.power_changed(on);
}

void BenchRig::set_bus_off(bool off) noexcept {
  bus_off_ = off;
  report_error(off ? CAN_ERR_BUSOFF : CAN_ERR_RESTARTED);
}

void BenchRig::report_error(std::uint32_t classes) noexcept {
  can_frame frame{};
  frame.can_id = CAN_ERR_FLAG | classes;
  frame.can_dlc = CAN_ERR_DLC;
  (void)to_host_.push(frame);
}

}  // namespace sim::can
