#include "hal/hall_reader.h"

#include <algorithm>
#include <cmath>

#include "drivers/tmcl/axis_parameters.h"

namespace hal {
namespace {

constexpr std::chrono::milliseconds kHallInterval{10};
constexpr std::chrono::seconds kSilentInterval{1};

}  // namespace

HallReader::HallReader(const AxisConstants& axis, std::chrono::nanoseconds period,
                       int cycles_to_write) noexcept
    : cycles_to_write_(cycles_to_write),
      turns_per_tick_(static_cast<double>(axis.pole_pairs) / axis.ticks_per_motor_rev),
      interval_cycles_(std::max(1, static_cast<int>(kHallInterval / period))),
      patience_cycles_(std::max(1, static_cast<int>(kSilentInterval / period))) {}

drivers::tmcl::Request HallReader::request() noexcept {
  return drivers::tmcl::get(drivers::tmcl::drive_parameter("hall_angle"));
}

bool HallReader::due() noexcept {
  if (wait_cycles_ > 0) --wait_cycles_;
  if (asked_) ++cycles_;
  return wait_cycles_ == 0 && !asked_ && !refused_;
}

void HallReader::ask() noexcept {
  asked_ = true;
  answered_ = false;
  cycles_ = 0;
  low_ticks_ = high_ticks_ = position_ticks_;
  wait_cycles_ = interval_cycles_;
}

void HallReader::answer(const drivers::tmcl::Completion& completion) noexcept {
  if (!asked_) return;
  switch (completion.outcome) {
    case drivers::tmcl::Outcome::kDone:
      hall_angle_ = completion.reply.value;
      answered_ = true;
      return;
    case drivers::tmcl::Outcome::kRefused: refused_ = true; break;
    default: wait_cycles_ = patience_cycles_;
  }
  asked_ = false;
}

void HallReader::pass(std::int64_t position_ticks) noexcept {
  position_ticks_ = position_ticks;
  if (!asked_) return;
  if (cycles_ < cycles_to_write_) low_ticks_ = high_ticks_ = position_ticks;
  low_ticks_ = std::min(low_ticks_, position_ticks);
  high_ticks_ = std::max(high_ticks_, position_ticks);
  if (!answered_) return;
  asked_ = false;
  const double turn = hall_angle_ / 65536.0;
  reading_ = {.number = reading_.number + 1,
              .hall_turn = turn - std::floor(turn),
              .encoder_low_turn = static_cast<double>(low_ticks_) * turns_per_tick_,
              .encoder_high_turn = static_cast<double>(high_ticks_) * turns_per_tick_};
}

void HallReader::forget() noexcept {
  asked_ = refused_ = false;
  reading_ = {};
}

}  // namespace hal
