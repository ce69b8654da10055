// Exchange rate and processor time of each haptic device at full speed, against its emulation. The rate
// includes the emulation's time; the processor time of the exchanging thread does not where the emulation has
// its own thread.
#include <sys/resource.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <ctime>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "drivers/haptic/haptic_usb.h"
#include "drivers/station/udp_port.h"
#include "hal/clock.h"
#include "hal/haptic/falcon_link.h"
#include "hal/haptic/force_dimension_link.h"
#include "hal/haptic/space_mouse_link.h"
#include "hal/haptic_servo.h"
#include "hal/lockstep_haptic_device.h"
#include "hal/loopback_haptic_link.h"
#include "runtime/station/operator_cycle.h"
#include "runtime/station/remote_haptic_link.h"
#include "sim/devices/emulated_falcon.h"
#include "sim/devices/emulated_space_mouse.h"
#include "sim/hand.h"
#include "tests/bench/figures.h"
#include "tests/drivers/force_dimension_fakes.h"
#include "tests/support/mock_falcon.h"
#include "tests/support/mock_hidraw_device.h"
#include "tests/support/mock_usb_device.h"

namespace haptic_bench {

using namespace std::chrono_literals;
using std::chrono::nanoseconds;

constexpr int kWarmUp = 200;

double thread_time_s() {
  timespec time{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

/// Of the calling thread, for each of many calls.
class Stopwatch {
 public:
  explicit Stopwatch(int calls) { times_us_.reserve(static_cast<std::size_t>(calls)); }
  template <typename Call>
  void time(Call&& call) {
    const double processor_begin_s = thread_time_s();
    const auto start = std::chrono::steady_clock::now();
    call();
    const std::chrono::duration<double, std::micro> took = std::chrono::steady_clock::now() - start;
    times_us_.push_back(took.count());
    processor_s_ += thread_time_s() - processor_begin_s;
  }
  double at(double share) {
    std::sort(times_us_.begin(), times_us_.end());
    return times_us_[static_cast<std::size_t>(share * static_cast<double>(times_us_.size() - 1))];
  }
  double processor_us() const { return 1e6 * processor_s_ / static_cast<double>(times_us_.size()); }

 private:
  std::vector<double> times_us_;
  double processor_s_ = 0;
};

/// Through the limits that every master has, with time passing as its device's does.
void measure(
    const char* name, hal::HapticLink& link, int exchanges, const std::function<void()>& between = [] {}) {
  hal::HapticServo servo(link, {.ramp_in = 0ms});
  hal::HapticSample sample;
  nanoseconds now = 1s;
  Stopwatch stopwatch(exchanges);
  int faults = 0;
  const auto begin = std::chrono::steady_clock::now();
  for (int i = 0; i < kWarmUp + exchanges; ++i) {
    now += 1ms;
    hal::HapticStatus status;
    const auto exchange = [&] { status = servo.step({true, {0.5, 0.0, 0.0}}, now, now, sample); };
    if (i < kWarmUp) {
      exchange();
    } else {
      stopwatch.time(exchange);
      faults += status.ok() ? 0 : 1;
    }
    between();
  }
  const std::chrono::duration<double> wall = std::chrono::steady_clock::now() - begin;
  const double per_second = static_cast<double>(kWarmUp + exchanges) / wall.count();
  const double processor_us = stopwatch.processor_us();
  std::printf("%-44s %10.0f %10.2f %10.2f %12.2f %8d\n", name, per_second, stopwatch.at(0.5),
              stopwatch.at(0.999), processor_us, faults);
  bench::add_figure(
      std::string("haptic exchange, ") + name, bench::quantiles_text(stopwatch.at(0.5), stopwatch.at(0.999)),
      "haptic_bench, " + std::to_string(exchanges) + " times flat out, " + bench::number_text(per_second) +
          " a second, " + bench::number_text(processor_us) + " µs of processor time each");
}

void loopback() {
  sim::Hand hand{{}};
  hal::LoopbackHapticLink link(hand, 1ms, {.name = "loopback", .force_limit_N = 8.0});
  link.open();
  measure("loopback: simulated hand, 1 ms", link, 200'000);
}

/// The same hand at an operator's station: what the link costs at either end, with the kernel's UDP. To it
/// the daemons of two computers add the way, and up to a cycle each until they look.
void two_stations() {
  constexpr int kExchanges = 50'000;
  const drivers::station::Key key({1});
  const std::string address = "127.0.0.1:47808";
  hal::VirtualClock clock;
  sim::Hand hand{{}};
  hal::LockstepHapticDevice device(
      std::make_unique<hal::LoopbackHapticLink>(
          hand, 1ms, hal::HapticInfo{.name = "pen", .force_limit_N = 8.0, .senses_rotation = true}),
      clock, {});
  device.activate();
  runtime::RemoteHapticLink robot(
      [&] {
        return std::make_unique<drivers::station::UdpPort>(drivers::station::UdpPort::listening(address));
      },
      key, {}, {.force_N = 8.0}, nullptr);
  robot.open();
  drivers::station::UdpPort port = drivers::station::UdpPort::towards(address);
  runtime::OperatorCycle station(device, port, key, {}, nullptr);
  Stopwatch stopwatch(kExchanges + kWarmUp);
  const auto at_operator = [&] {
    clock.sleep_until(clock.now() + 1ms);
    stopwatch.time([&] { station.step(clock.now()); });
  };
  hal::HapticSample sample;
  for (nanoseconds now{}; now <= 1s; now += 1ms) {
    at_operator();
    (void)robot.exchange({}, now, sample);
  }
  stopwatch = Stopwatch(kExchanges + kWarmUp);
  measure("two stations: the robot's end, UDP", robot, kExchanges, at_operator);
  std::printf("%-44s %10s %10.2f %10.2f %12.2f\n", "two stations: the operator's end", "", stopwatch.at(0.5),
              stopwatch.at(0.999), stopwatch.processor_us());
  bench::add_figure(
      "haptic exchange, two stations: the operator's end, with its device",
      bench::quantiles_text(stopwatch.at(0.5), stopwatch.at(0.999)),
      "haptic_bench, " + bench::number_text(stopwatch.processor_us()) + " µs of processor time each");
}

void force_dimension() {
  const support::TemporaryDirectory folder;
  const drivers::haptic::StandIn stand_in(folder, "library.so");
  hal::ForceDimensionLinkConfig config;
  config.sdk.file = stand_in.path();
  config.device.wait = [](nanoseconds) {};
  hal::ForceDimensionLink link(config);
  link.open();
  stand_in.script().hand_holds = true;
  measure("force-dimension: stand-in library", link, 20'000,
          [&stand_in] { stand_in.control().advance(1e-3); });
}

void falcon_in_process() {
  sim::devices::EmulatedFalcon falcon({.firmware_running = true});
  hal::FalconLink link([&falcon] { return std::make_unique<support::BorrowedPort>(falcon); }, {}, {});
  link.open();
  hal::HapticSample sample;
  (void)link.exchange({}, 0ms, sample);
  falcon.pull_and_push();
  measure("falcon: emulated device in the process", link, 50'000);
}

void falcon_on_usb() {
  support::MockUsbBus bus;
  support::MockFalcon far(bus, {.firmware_running = true});
  drivers::usb::UsbContext context;
  drivers::haptic::FalconConfig config;
  config.reply_deadline = 20ms;
  config.lost_after_misses = 10;
  hal::FalconLink link([&context] { return drivers::haptic::open_falcon_port(context); }, config, {});
  link.open();
  hal::HapticSample sample;
  (void)link.exchange({}, 0ms, sample);
  far.with([](sim::devices::EmulatedFalcon& device) { device.pull_and_push(); });
  measure("falcon: libusb, mocked kernel", link, 2'000);
}

void space_mouse() {
  support::MockHidrawBus bus;
  support::MockHidrawDevice& mouse =
      bus.plug({.vendor = 0x256f,
                .product = 0xc635,
                .report_descriptor = sim::devices::EmulatedSpaceMouse({}, {}).report_descriptor()});
  hal::SpaceMouseLink link({});
  link.open();
  measure("spacemouse: hidapi, mocked kernel, a report each", link, 2'000, [&mouse] {
    mouse.send({1, 10, 0, 20, 0, 30, 0});
  });
}

}  // namespace haptic_bench

int main() {
  std::printf("%-44s %10s %10s %10s %12s %8s\n", "haptic device", "per second", "median us", "99.9 % us",
              "processor us", "faults");
  haptic_bench::loopback();
  haptic_bench::two_stations();
  haptic_bench::force_dimension();
  haptic_bench::falcon_in_process();
  if (!support::in_mock_kernel()) {
    std::puts("without umockdev's library loaded first: no USB and no HID");
    bench::add_figure("haptic exchange over USB and HID", "not measured",
                      "needs umockdev's library loaded first");
    return 0;
  }
  haptic_bench::falcon_on_usb();
  haptic_bench::space_mouse();
}
