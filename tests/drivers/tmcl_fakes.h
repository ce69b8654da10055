/// @file
/// A small drive for the tests of drivers/tmcl: one axis with an end stop, its mailbox and its flags. Can be
/// scripted to fail in every way that the sequences must survive.
#pragma once
#include <algorithm>
#include <array>
#include <chrono>
#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "drivers/tmcl/axis_parameters.h"
#include "drivers/tmcl/process_data.h"
#include "drivers/tmcl/sequence.h"
#include "drivers/tmcl/transport.h"

namespace fake {

using namespace std::chrono_literals;
namespace tmcl = drivers::tmcl;

class Clock final : public tmcl::Clock {
 public:
  std::chrono::nanoseconds now() noexcept override { return now_; }
  void wait(std::chrono::nanoseconds duration) noexcept override { now_ += std::max(duration, 1ns); }

 private:
  std::chrono::nanoseconds now_{0};
};

/// Answers like a module with a memory. Each request is answered `latency` polls later. `script` replaces the
/// answers to the first requests; an empty entry means lost.
class Module final : public tmcl::Transport {
 public:
  bool post(const tmcl::Request& request) noexcept override {
    if (refuse_posts > 0) {
      --refuse_posts;
      return false;
    }
    requests.push_back(request);
    std::optional<tmcl::Reply> reply = answer(request);
    if (!script.empty()) {
      reply = script.front();
      script.pop_front();
    }
    if (reply) pending.emplace_back(polls_ + latency, *reply);
    return true;
  }
  std::optional<tmcl::Reply> poll() noexcept override {
    if (pending.empty() || polls_++ < pending.front().first) return std::nullopt;
    const tmcl::Reply reply = pending.front().second;
    pending.pop_front();
    return reply;
  }
  std::chrono::nanoseconds reply_age() const noexcept override { return age; }
  const std::string& name() const noexcept override { return name_; }

  tmcl::Reply answer(const tmcl::Request& request) {
    tmcl::Reply reply{0, request.module, tmcl::Status::kOk, request.command, request.value, {}};
    const auto key = std::pair(request.type, request.motor);
    switch (request.command) {
      case tmcl::Command::kSetAxisParameter:
      case tmcl::Command::kSetGlobalParameter: values[key] = request.value; break;
      case tmcl::Command::kGetAxisParameter:
      case tmcl::Command::kGetGlobalParameter: reply.value = values[key]; break;
      case tmcl::Command::kGetFirmwareVersion: std::copy_n(version.begin(), 8, reply.text.begin()); break;
      default: break;
    }
    return reply;
  }

  std::vector<tmcl::Request> requests;
  std::deque<std::optional<tmcl::Reply>> script;
  std::deque<std::pair<int, tmcl::Reply>> pending;  // with the poll at which it becomes available
  std::map<std::pair<std::uint8_t, std::uint8_t>, std::int32_t> values;
  std::string version = "1610V148";
  std::chrono::nanoseconds age{};
  int latency = 0;
  int refuse_posts = 0;

 private:
  int polls_ = 0;
  std::string name_ = "slave 3 (TMCM-1610)";
};

/// One axis, 1 ms per step. It follows a velocity at once; at the stop, or blocked, the current rises. It
/// does not allocate, so that cycles can be checked with it.
class Drive final : public tmcl::Transport {
 public:
  // The axis.
  double position = -50'000;  // ticks
  double stop_at = 0;
  double obstacle_at = 1e12;  // gives way slowly
  double floor_at = -1e12;
  bool blocked = false;
  bool dead = false;  // neither moves nor pushes
  bool reversed = false;
  double sag_per_ms = 0;      // without current
  double sinking_per_ms = 0;  // whatever the drive does; decreases by this share each ms:
  double sinking_share = 1;
  int break_away_ms = 0;  // duration of sticking when commanded to move from rest
  bool unsigned_current = true;
  // Commutation.
  int initializes_after_ms = 20;  // -1: never
  bool parameter_15_lies = false;
  tmcl::Firmware firmware = tmcl::Firmware::k148;
  // Mailbox.
  bool silent = false;
  bool refuses = false;
  int latency = 3;
  std::int32_t thermal_time_ms = 1000;
  bool timeout_sticks = false;
  bool counter_ignored = false;

  tmcl::StatusFlags flags() const { return tmcl::StatusFlags(flags_); }
  void set(tmcl::StatusFlag flag, bool on = true) {
    const std::uint32_t bit = 1U << static_cast<unsigned>(flag);
    flags_ = on ? flags_ | bit : flags_ & ~bit;
  }
  std::int32_t user_variable_16 = 0;
  std::array<std::int32_t, 256> requests_seen{};  // SAP by number

  tmcl::DriveInput step(const tmcl::DriveOutput& output) {
    const auto per_ms = [](double rpm) { return rpm * 4000 / 60'000; };
    double velocity_rpm = 0;
    current_mA_ = 0;
    position -= sinking_per_ms;
    sinking_per_ms *= sinking_share;
    const bool may_move = flags().has(tmcl::StatusFlag::kInitialized) || firmware == tmcl::Firmware::k200;
    const bool held = flags().has(tmcl::StatusFlag::kTimeout) || flags().has(tmcl::StatusFlag::kI2tExceeded);
    if (output.mode == tmcl::ControllerMode::kVelocity && output.value != 0 && may_move && !held && !dead) {
      velocity_rpm = reversed ? -output.value : output.value;
      if (sticking_ms_ < break_away_ms) {
        ++sticking_ms_;
        velocity_rpm = 0;
        current_mA_ = 3000;
      }
      double next = position + per_ms(velocity_rpm);
      if (next > obstacle_at) next = std::max(position, obstacle_at) + 1;
      if (blocked) next = position;
      next = std::clamp(next, floor_at, stop_at);
      if (next - position < 0.9 * per_ms(velocity_rpm) && velocity_rpm > 0) current_mA_ = 3000;
      if (blocked || (next <= floor_at && velocity_rpm < 0)) current_mA_ = output.value > 0 ? 3000 : -3000;
      velocity_rpm = (next - position) / per_ms(1);
      position = next;
    } else {
      sticking_ms_ = 0;
    }
    if (output.mode == tmcl::ControllerMode::kCurrent && output.value == 0) position -= sag_per_ms;

    const bool starting = firmware == tmcl::Firmware::k148
                              ? output.mode == tmcl::ControllerMode::kInitialize
                              : output.mode == tmcl::ControllerMode::kVelocity && output.value == 100;
    if (starting && initializes_after_ms >= 0 && ++started_ms_ > initializes_after_ms) {
      set(tmcl::StatusFlag::kInitialized);
    }
    if (hot_ms_ > 0) --hot_ms_;

    tmcl::DriveInput input;
    input.position_ticks = static_cast<std::int32_t>(static_cast<std::int64_t>(position) + offset_);
    input.current_mA = unsigned_current ? std::abs(current_mA_) : current_mA_;
    input.velocity_rpm = static_cast<std::int32_t>(velocity_rpm);
    input.flags = flags();
    return input;
  }
  void overheat() {
    set(tmcl::StatusFlag::kI2tExceeded);
    hot_ms_ = thermal_time_ms;
  }

  bool post(const tmcl::Request& request) noexcept override {
    if (pending_) return false;
    pending_ = answer(request);
    wait_ = silent ? 1'000'000 : latency;
    return true;
  }
  std::optional<tmcl::Reply> poll() noexcept override {
    if (!pending_ || wait_-- > 0) return std::nullopt;
    return std::exchange(pending_, std::nullopt);
  }
  const std::string& name() const noexcept override { return name_; }

 private:
  tmcl::Reply answer(const tmcl::Request& request) noexcept {
    tmcl::Reply reply{0, 0, tmcl::Status::kOk, request.command, request.value, {}};
    if (refuses) {
      reply.status = tmcl::Status::kInvalidCommand;
    } else if (request.command == tmcl::Command::kSetAxisParameter) {
      ++requests_seen[request.type];
      if (request.type == 1 && !counter_ignored)
        offset_ = request.value - static_cast<std::int64_t>(position);
      if (request.type == 158 && !timeout_sticks) set(tmcl::StatusFlag::kTimeout, false);
      if (request.type == 29 && hot_ms_ == 0) set(tmcl::StatusFlag::kI2tExceeded, false);
    } else if (request.command == tmcl::Command::kGetAxisParameter) {
      if (request.type == 15) {
        reply.value = flags().has(tmcl::StatusFlag::kInitialized) && !parameter_15_lies ? 1 : 0;
      }
      if (request.type == 25) reply.value = thermal_time_ms;
    } else if (request.command == tmcl::Command::kSetGlobalParameter) {
      user_variable_16 = request.value;
    } else if (request.command == tmcl::Command::kGetGlobalParameter) {
      reply.value = user_variable_16;
    }
    return reply;
  }

  std::uint32_t flags_ = 0;
  std::int64_t offset_ = 0;
  std::int32_t current_mA_ = 0;
  int started_ms_ = 0;
  int sticking_ms_ = 0;
  int hot_ms_ = 0;
  int wait_ = 0;
  std::optional<tmcl::Reply> pending_;
  std::string name_ = "slave 7 (TMCM-1610)";
};

/// The owner's work in each cycle. Returns the number of cycles; the limit means that it hangs.
struct Owner {
  tmcl::RequestQueue queue;
  tmcl::DriveOutput output;
  tmcl::DriveInput input;
  std::vector<tmcl::DriveOutput> outputs;  // as commanded, without repetitions

  void cycle(tmcl::Sequence& sequence, Drive& drive) {
    input = drive.step(output);
    queue.step(drive);
    const auto completion = queue.pop();
    const tmcl::Action action = sequence.step(input, completion ? &*completion : nullptr);
    if (action.drive) output = *action.drive;
    if (action.ask) queue.push(*action.ask);
  }
  int run(tmcl::Sequence& sequence, Drive& drive, int limit_ms = 200'000) {
    for (int i = 0; i < limit_ms; ++i) {
      cycle(sequence, drive);
      if (outputs.empty() || outputs.back() != output) outputs.push_back(output);
      if (sequence.progress() != tmcl::Progress::kRunning) return i;
    }
    return limit_ms;
  }
};

}  // namespace fake
