// The transport thread between a loop and a device that blocks. In real time: every wait ends with an event,
// and only a failure takes long. Also run under the thread sanitizer.
#include "hal/threaded_haptic_device.h"

#include <gtest/gtest.h>
#include <sched.h>

#include <atomic>
#include <chrono>
#include <limits>
#include <memory>
#include <semaphore>
#include <string>
#include <thread>
#include <utility>

#include "hal/setup_error.h"
#include "tests/support/no_alloc_guard.h"

namespace threaded_haptic_device_test {

using namespace std::chrono_literals;
using Eigen::Vector3d;
using hal::HapticCommand;
using hal::HapticFault;
using hal::HapticSample;
using hal::HapticStatus;
using hal::ThreadedHapticDevice;
using std::chrono::nanoseconds;

/// What the link saw, for the test's thread, which may outlive it.
struct Seen {
  std::atomic<int> exchanges{0};
  std::atomic<int> enabled{0};
  std::atomic<int> disabled_after_enabled{0};
  std::atomic<double> force_N{0.0};
  std::atomic<int> opens{0};
  std::atomic<int> closes{0};
  std::atomic<int> policy{-1};
  std::atomic<bool> hang{false};
  std::atomic<bool> hangs{false};  // the call has begun and waits for let_go
  std::atomic<bool> close_fails{false};
  std::counting_semaphore<1000> let_go{0};  // one for each exchange while `hang`
};

class SlowLink final : public hal::HapticLink {
 public:
  explicit SlowLink(std::shared_ptr<Seen> seen) : seen_(std::move(seen)) {}
  const hal::HapticInfo& info() const noexcept override { return info_; }
  void open() override { ++seen_->opens; }
  bool close() noexcept override {
    ++seen_->closes;
    return !seen_->close_fails;
  }
  HapticStatus exchange(const HapticCommand& command, nanoseconds now,
                        HapticSample& sample) noexcept override {
    if (seen_->hang) {
      seen_->hangs = true;
      seen_->let_go.acquire();
      seen_->hangs = false;
    }
    seen_->policy = ::sched_getscheduler(0);
    if (command.enable) {
      ++seen_->enabled;
    } else if (seen_->enabled > 0) {
      ++seen_->disabled_after_enabled;
    }
    seen_->force_N = command.f_D_H_N.x();
    sample.stamp = now;
    sample.p_HD_m.x() = 0.01;
    ++seen_->exchanges;
    return {};
  }

 private:
  std::shared_ptr<Seen> seen_;
  hal::HapticInfo info_{.name = "slow", .force_limit_N = 8.0};
};

template <typename Happened>
bool wait_until(Happened happened) {
  const auto deadline = std::chrono::steady_clock::now() + 60s;
  while (!happened()) {
    if (std::chrono::steady_clock::now() > deadline) return false;
    std::this_thread::sleep_for(200us);
  }
  return true;
}

struct ThreadedHapticDeviceTest : testing::Test {
  // Time itself is no reason on a busy machine, but where it is the point.
  static constexpr hal::HapticLimits kPatient{.ramp_in = 0ms, .stale_after = 100ms, .command_timeout = 100ms};

  HapticStatus exchange(const HapticCommand& command) { return device->exchange(command, sample); }
  /// Exchanges until this fault shows.
  bool shows(HapticFault fault, const HapticCommand& command) {
    return wait_until([&] { return exchange(command).fault == fault; });
  }
  /// Exchanges until this force reaches the link; a thread that was held up for long has let go of it.
  bool pushes(double force_N) {
    return wait_until([&] {
      const bool commanded = exchange({true, Vector3d(force_N, 0, 0)}).ok();
      if (!commanded) (void)exchange({});
      return commanded && seen->force_N == force_N;
    });
  }
  void make(const hal::HapticThreadOptions& options = {}) {
    device = std::make_unique<ThreadedHapticDevice>(std::make_unique<SlowLink>(seen), kPatient, options);
  }
  /// Exchanges until the thread is in a call that does not return.
  bool hangs(const HapticCommand& command) {
    seen->hang = true;
    return wait_until([&] {
      (void)exchange(command);
      return seen->hangs.load();
    });
  }

  std::shared_ptr<Seen> seen = std::make_shared<Seen>();
  HapticSample sample;
  std::unique_ptr<ThreadedHapticDevice> device;
};

const HapticCommand kPush{true, Vector3d(3, 0, 0)};

TEST_F(ThreadedHapticDeviceTest, RefusesOptionsThatMakeNoSense) {
  EXPECT_THROW(make({.period = 0ns}), hal::SetupError);
  EXPECT_THROW(make({.period = 51ms}), hal::SetupError) << "each sample would be stale";
  EXPECT_THROW(make({.fifo_priority = 100}), hal::SetupError);
}

TEST_F(ThreadedHapticDeviceTest, CarriesSamplesOneWayAndForcesTheOther) {
  make();
  EXPECT_EQ(exchange({}).fault, HapticFault::kNotActive);
  device->activate();
  ASSERT_TRUE(shows(HapticFault::kNone, {}));
  EXPECT_EQ(sample.p_HD_m.x(), 0.01);
  ASSERT_TRUE(pushes(3.0));
  EXPECT_GE(exchange(kPush).age, 0ns);
  EXPECT_TRUE(device->deactivate());
  EXPECT_EQ(seen->closes, 1);
  EXPECT_EQ(exchange(kPush).fault, HapticFault::kNotActive);
  const int exchanges = seen->exchanges;
  device->activate();
  EXPECT_TRUE(wait_until([&] { return seen->exchanges > exchanges; }));
  device.reset();
  EXPECT_EQ(seen->closes, 2);
}

TEST_F(ThreadedHapticDeviceTest, SaysWhenNothingConfirmedThatTheForceIsOff) {
  make();
  device->activate();
  seen->close_fails = true;
  EXPECT_FALSE(device->deactivate());
  EXPECT_FALSE(device->deactivate()) << "nor by asking again";
}

TEST_F(ThreadedHapticDeviceTest, ADeviceThatHangsFromTheStartIsStale) {
  make({.patience = 50ms});
  seen->hang = true;
  const auto before = std::chrono::steady_clock::now();
  device->activate();
  const HapticFault first = exchange({}).fault;
  // On a busy machine even the first exchange may come too late.
  const bool late = std::chrono::steady_clock::now() - before > kPatient.stale_after;
  EXPECT_TRUE(first == HapticFault::kNotReady || (late && first == HapticFault::kStale))
      << hal::describe(first);
  EXPECT_TRUE(shows(HapticFault::kStale, {}));
  seen->hang = false;
  seen->let_go.release(1);
}

TEST_F(ThreadedHapticDeviceTest, AfterACallThatTookTooLongThereIsNoForceUntilDisabledOnce) {
  make();
  device->activate();
  ASSERT_TRUE(pushes(3.0));
  ASSERT_TRUE(hangs(kPush));
  ASSERT_TRUE(shows(HapticFault::kStale, kPush));
  seen->hang = false;
  seen->let_go.release(1);
  const int exchanges = seen->exchanges;
  // The first may still be with the command that was the newest before the call.
  ASSERT_TRUE(wait_until([&] {
    EXPECT_FALSE(exchange(kPush).ok());
    return seen->exchanges > exchanges + 2;
  }));
  const int enabled = seen->enabled;
  ASSERT_TRUE(wait_until([&] {
    EXPECT_FALSE(exchange(kPush).ok());
    return seen->exchanges > exchanges + 20;
  }));
  EXPECT_EQ(seen->enabled, enabled);
  EXPECT_EQ(seen->force_N, 0.0);
  EXPECT_TRUE(pushes(3.0)) << "disabled once, it is forgotten";
}

TEST_F(ThreadedHapticDeviceTest, ALoopThatStopsGivingCommandsLosesTheForce) {
  make();
  device->activate();
  ASSERT_TRUE(pushes(3.0));
  ASSERT_TRUE(wait_until([&] { return seen->force_N == 0.0; })) << "exchange() was not called";
  // The thread publishes the outcome of that exchange before it begins the next one.
  const int exchanges = seen->exchanges;
  ASSERT_TRUE(wait_until([&] { return seen->exchanges > exchanges + 1; }));
  ASSERT_TRUE(wait_until([&] {
    const HapticFault fault = exchange(kPush).fault;
    // On a busy machine its own thread may have been late before.
    EXPECT_TRUE(fault == HapticFault::kNoCommand || fault == HapticFault::kStale) << hal::describe(fault);
    return seen->exchanges > exchanges + 20;
  }));
  EXPECT_EQ(seen->force_N, 0.0) << "latched";
  EXPECT_TRUE(pushes(3.0));
}

TEST_F(ThreadedHapticDeviceTest, ADisabledCommandBetweenTwoExchangesIsNotLost) {
  make();
  device->activate();
  ASSERT_TRUE(pushes(3.0));
  seen->disabled_after_enabled = 0;
  seen->hang = true;
  const int before = seen->exchanges;
  // The thread waits in the device now, at the latest in its next exchange.
  seen->let_go.release(1);
  ASSERT_TRUE(wait_until([&] {
    (void)exchange(kPush);
    return seen->exchanges > before;
  }));
  (void)exchange({});
  (void)exchange(kPush);  // overwrites it
  seen->hang = false;
  seen->let_go.release(1);
  EXPECT_TRUE(wait_until([&] {
    (void)exchange(kPush);
    return seen->disabled_after_enabled > 0;
  }));
}

TEST_F(ThreadedHapticDeviceTest, ACallThatNeverReturnsIsStaleAndIsNotWaitedForForEver) {
  make({.patience = 50ms});
  device->activate();
  ASSERT_TRUE(shows(HapticFault::kNone, {}));
  ASSERT_TRUE(hangs({}));
  EXPECT_TRUE(shows(HapticFault::kStale, {}));
  EXPECT_FALSE(device->deactivate());
  EXPECT_EQ(seen->closes, 0);
  EXPECT_FALSE(device->deactivate()) << "still";
  try {
    device->activate();
    FAIL();
  } catch (const hal::SetupError& error) {
    EXPECT_NE(std::string(error.what()).find("never returned"), std::string::npos) << error.what();
  }
  seen->hang = false;
  seen->let_go.release(1);  // it does return after all: its thread closes the device
  EXPECT_TRUE(wait_until([&] { return seen->closes == 1; }));
  EXPECT_TRUE(wait_until([&] {
    try {
      device->activate();
      return true;
    } catch (const hal::SetupError&) {
      return false;  // the thread has not ended yet
    }
  }));
  device.reset();
  // The last of its memory goes with the thread.
  EXPECT_TRUE(wait_until([&] { return seen.use_count() == 1; }));
}

TEST_F(ThreadedHapticDeviceTest, ThePriorityIsTakenOrRefusedInWords) {
  make({.fifo_priority = 10});
  try {
    device->activate();
  } catch (const hal::SetupError& error) {
    EXPECT_NE(std::string(error.what()).find("SCHED_FIFO"), std::string::npos) << error.what();
    EXPECT_EQ(seen->closes, 1);
    return;
  }
  EXPECT_TRUE(wait_until([&] { return seen->policy == SCHED_FIFO; }));
}

TEST_F(ThreadedHapticDeviceTest, ExchangeNeitherAllocatesNorLocks) {
  if (!support::NoAllocGuard::kActive) GTEST_SKIP() << "the sanitizer owns malloc";
  make();
  device->activate();
  ASSERT_TRUE(shows(HapticFault::kNone, {}));
  const support::NoAllocGuard guard;
  for (int i = 0; i < 1000; ++i) (void)exchange(kPush);
  const long violations = guard.violations();
  EXPECT_EQ(violations, 0);
}

}  // namespace threaded_haptic_device_test
