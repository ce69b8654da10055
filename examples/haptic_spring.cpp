// A spring of 100 N/m pulls the handle of a haptic device to its initial position. IT PUSHES ON A HAND.
//   haptic_spring [DEVICE [FIRMWARE]]
// DEVICE: loopback (a simulated hand), omega.6 (its library in $FDSDK), falcon (with its firmware file after
// each power-on).
#include <youbot/haptic.h>
#include <youbot/robot.h>

#include <chrono>
#include <csignal>
#include <cstdio>
#include <exception>
#include <memory>
#include <string>

namespace {
volatile std::sig_atomic_t stop_requested = 0;
}

int main(int argc, char** argv) try {
  constexpr std::chrono::milliseconds kPeriod{1};
  constexpr double kStiffness_N_per_m = 100;
  constexpr double kDamping_N_s_per_m = 2;
  youbot::HapticOptions options;
  if (argc > 1) options.name = argv[1];
  if (argc > 2) options.falcon.firmware = argv[2];
  options.thread.fifo_priority = 0;  // 85 on a real-time machine
  std::unique_ptr<youbot::Clock> clock;
  if (options.name == "loopback")
    clock = std::make_unique<youbot::VirtualClock>();
  else
    clock = std::make_unique<youbot::SteadyClock>();

  youbot::OpenedHaptic opened = youbot::open_haptic(options, *clock, kPeriod);
  youbot::HapticDevice& device = *opened.device;
  device.activate();
  // A Falcon may keep its last force when the program dies.
  for (const int signal : {SIGINT, SIGTERM}) std::signal(signal, [](int) { stop_requested = 1; });
  std::printf("%s, up to %.1f N\n", device.info().name.c_str(), device.info().force_limit_N);
  for (const std::string& warning : device.info().warnings) std::printf("note: %s\n", warning.c_str());
  // The simulated hand, itself a spring of 300 N/m, pulls with 2 N.
  if (opened.hand) opened.hand->push({2.0, 0.0, 0.0});

  youbot::HapticCommand command;
  youbot::HapticSample sample;
  Eigen::Vector3d origin_m = Eigen::Vector3d::Zero();
  std::chrono::nanoseconds deadline = clock->now();
  int n = 0;  // cycles with a position
  for (int cycles = 0; n < 5000 && cycles < 60'000 && !stop_requested; ++cycles) {
    clock->sleep_until(deadline += kPeriod);
    const youbot::HapticStatus status = device.exchange(command, sample);
    if (!status.ok() && status.fault != youbot::HapticFault::kNotReady) {
      std::fprintf(stderr, "%s\n", device.describe(status).c_str());
      return 1;
    }
    if (!status.ok()) {
      if (cycles % 5000 == 0) std::printf("%s\n", device.describe(status).c_str());
      continue;
    }
    if (!command.enable) {
      command.enable = true;  // the force fades in from here on
      origin_m = sample.p_HD_m;
    }
    command.f_D_H_N =
        kStiffness_N_per_m * (origin_m - sample.p_HD_m) - kDamping_N_s_per_m * sample.v_HD_H_m_per_s;
    if (n++ % 500 == 0)
      std::printf("%.1f s  %.1f mm away  %.2f N\n", 1e-3 * (n - 1), 1e3 * (sample.p_HD_m - origin_m).norm(),
                  status.f_D_H_N.norm());
  }
  return device.deactivate() ? 0 : 1;
} catch (const std::exception& error) {
  std::fprintf(stderr, "haptic_spring: %s\n", error.what());
  return 1;
}
