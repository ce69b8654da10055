#include "hal/threaded_haptic_device.h"

#include <pthread.h>
#include <sched.h>

#include <atomic>
#include <cstring>
#include <semaphore>
#include <system_error>
#include <thread>
#include <utility>

#include "hal/clock.h"
#include "hal/newest_value.h"
#include "hal/setup_error.h"

namespace hal {

using namespace std::chrono_literals;
using std::chrono::nanoseconds;

struct ThreadedHapticDevice::Shared {
  struct Given {
    HapticCommand command;
    nanoseconds stamp{};
    std::uint32_t disables = 0;  // number of commands so far that were not enabled
  };

  struct Outcome {
    HapticStatus status;
    HapticSample sample;  // the latest
    nanoseconds updated{};
  };

  Shared(std::unique_ptr<HapticLink> the_link, const HapticLimits& limits)
      : link(std::move(the_link)), servo(*link, limits) {}

  void run(nanoseconds period) noexcept;
  void step() noexcept;

  std::unique_ptr<HapticLink> link;
  HapticServo servo;
  NewestValue<Given> given;
  NewestValue<Outcome> outcomes;
  std::atomic<bool> stop{false};
  bool force_off = true;  // result of close(); read once `ended` is acquired
  std::binary_semaphore ended{0};

  // Used by the thread only.
  SteadyClock clock;
  Given newest;
  std::uint32_t disables = 0;
  HapticSample sample;
};

void ThreadedHapticDevice::Shared::run(nanoseconds period) noexcept {
  nanoseconds deadline = clock.now();
  while (!stop.load(std::memory_order_acquire)) {
    step();
    deadline += period;
    // A device slower than the period sets the rate: missed periods are not made up.
    if (const nanoseconds now = clock.now(); now > deadline) deadline = now;
    clock.sleep_until(deadline);
  }
  force_off = link->close();
  ended.release();
}

void ThreadedHapticDevice::Shared::step() noexcept {
  given.take(newest);
  HapticCommand command = newest.command;
  // A command without enable may have come and gone between two steps; it is not lost.
  if (newest.disables != disables) command.enable = false;
  disables = newest.disables;
  const nanoseconds now = clock.now();
  const HapticStatus status = servo.step(command, newest.stamp, now, sample);
  outcomes.publish({status, sample, clock.now()});
}

ThreadedHapticDevice::ThreadedHapticDevice(std::unique_ptr<HapticLink> link, const HapticLimits& limits,
                                           const HapticThreadOptions& options)
    : limits_(limits), options_(options), shared_(std::make_shared<Shared>(std::move(link), limits)) {
  if (options.period < 100us || options.period > limits.stale_after / 2)
    throw SetupError("haptic device", "check the period of its thread",
                     "it must be 0.1 ms or more, and at most half of stale_after");
  if (options.fifo_priority < 0 || options.fifo_priority > 99)
    throw SetupError("haptic device", "check the priority of its thread",
                     "it must be 1 to 99, or 0 for none");
}

const HapticInfo& ThreadedHapticDevice::info() const noexcept { return shared_->link->info(); }

std::string ThreadedHapticDevice::describe(const HapticStatus& status) const {
  return shared_->link->describe(status);
}

void ThreadedHapticDevice::activate() {
  deactivate();
  if (stuck_ && shared_->ended.try_acquire()) stuck_ = false;  // the call returned after all
  if (stuck_)
    throw SetupError(info().name, "activate",
                     "an earlier call to the device never returned; restart this program, then the device");
  shared_->link->open();
  shared_->servo.reset();
  shared_->stop = false;
  shared_->given.publish({});
  Shared::Outcome old;
  shared_->outcomes.take(old);
  shared_->sample = {};
  disables_ = 0;
  shared_->disables = 0;
  sample_ = {};
  status_ = {.fault = HapticFault::kNotReady, .age = nanoseconds::max()};
  updated_ = shared_->clock.now();
  silent_ = false;
  std::thread thread;
  try {
    thread = std::thread([shared = shared_, period = options_.period] { shared->run(period); });
  } catch (const std::system_error& error) {
    shared_->link->close();
    throw SetupError(info().name, "start its thread", error.what());
  }
  running_ = true;
  int refused = 0;
  if (options_.fifo_priority > 0) {
    const sched_param parameters{.sched_priority = options_.fifo_priority};
    refused = ::pthread_setschedparam(thread.native_handle(), SCHED_FIFO, &parameters);
  }
  thread.detach();  // deactivate() waits for `ended`, with a time-out
  if (refused != 0) {
    deactivate();
    throw SetupError(info().name, "take SCHED_FIFO for its thread",
                     std::string(std::strerror(refused)) +
                         "; grant rtprio (/etc/security/limits.d) or CAP_SYS_NICE, or run without real time");
  }
}

bool ThreadedHapticDevice::deactivate() noexcept {
  if (!running_) return force_off_;
  running_ = false;
  shared_->stop.store(true, std::memory_order_release);
  if (!shared_->ended.try_acquire_for(options_.patience)) {
    stuck_ = true;
    return force_off_ = false;
  }
  return force_off_ = shared_->force_off;
}

HapticStatus ThreadedHapticDevice::exchange(const HapticCommand& command, HapticSample& sample) noexcept {
  if (!running_) return {HapticFault::kNotActive};
  const nanoseconds now = shared_->clock.now();
  if (Shared::Outcome outcome; shared_->outcomes.take(outcome)) {
    status_ = outcome.status;
    updated_ = outcome.updated;
    sample_ = outcome.sample;
  }
  const bool has_sample = status_.age != nanoseconds::max();
  if (has_sample) sample = sample_;

  const bool silent_now = now - updated_ > limits_.stale_after;
  silent_ = command.enable && (silent_ || silent_now);
  HapticCommand passed_on = command;
  passed_on.enable = command.enable && !silent_;
  if (!passed_on.enable) ++disables_;
  shared_->given.publish({passed_on, now, disables_});

  HapticStatus status = status_;
  if (has_sample) status.age = now - sample_.stamp;
  const bool mild = status.ok() || status.fault == HapticFault::kNotReady;
  if (mild && (silent_ || silent_now)) status.fault = HapticFault::kStale;
  return status;
}

}  // namespace hal
