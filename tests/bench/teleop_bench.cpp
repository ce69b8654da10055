// Cost of a teleoperation cycle, and the simulation speed of base and arm.
#include <benchmark/benchmark.h>

#include <chrono>
#include <memory>

#include "drivers/latency_histogram.h"
#include "hal/clock.h"
#include "hal/loopback_robot.h"
#include "tests/bench/quantiles.h"
#include "tests/operation/teleop_rig.h"

namespace teleop_bench {

using namespace std::chrono_literals;
using std::chrono::nanoseconds;

/// The full control step of base and arm, eight axes: kinematics, dynamics, stiffness, null space, mapping,
/// passivity, friction. It goes through the rig's own start-up first; then the hand moves, and the robot,
/// which costs nothing here, stands.
void TeleoperationStep(benchmark::State& state) {
  state.SetLabel("control step of teleoperation: eight axes, kinematics, dynamics, passivity");
  teleop_rig::Rig rig;
  if (!rig.run_until(control::TeleopPhase::kOperating)) return state.SkipWithError("no start");
  control::Teleoperation teleoperation(teleop_rig::quick_config().control);
  teleoperation.request_start();
  const hal::SteadyClock stopwatch;
  drivers::LatencyHistogram histogram;
  const auto input_of = [](const operation::TeleopRecord& record) {
    control::TeleopInput input;
    input.drives_obey = input.master_ready = input.grip_fresh = true;
    for (Eigen::Index i = 0; i < 4; ++i)
      input.wheel_position_rad[i] = record.position_rad[static_cast<std::size_t>(i)];
    for (Eigen::Index i = 0; i < 5; ++i)
      input.arm_position_rad[i] = record.position_rad[static_cast<std::size_t>(4 + i)];
    return input;
  };
  for (const operation::TeleopRecord& record : rig.records) (void)teleoperation.step(input_of(record));
  control::TeleopInput input = input_of(rig.last());
  int n = 0;
  for (auto _ : state) {
    input.grip.p_HD_m.y() = 1e-5 * (n++ % 1000);
    const nanoseconds begin = stopwatch.now();
    benchmark::DoNotOptimize(teleoperation.step(input));
    histogram.add(stopwatch.now() - begin);
  }
  if (teleoperation.phase() != control::TeleopPhase::kOperating)
    return state.SkipWithError("it does not operate");
  bench::set_quantiles(state, histogram);
}
BENCHMARK(TeleoperationStep)->MinTime(1.0);

/// From a sample of the handle to the force command, at 4 kHz: exchange with the loopback device, whose
/// handle keeps moving, and the whole control step. Without the robot's exchange.
void HapticPathAt4kHz(benchmark::State& state) {
  state.SetLabel("from a sample of the handle to its force at 4 kHz, on the loopback device");
  constexpr std::chrono::microseconds kFast{250};
  control::Teleoperation::Config config = teleop_rig::quick_config().control;
  config.period_s = config.robot.period_s = config.mapping.period_s = config.smoothing.period_s =
      config.presence.period_s = config.robot.base.observer.filter.period_s = 250e-6;
  control::Teleoperation teleoperation(config);
  teleoperation.request_start();

  const teleop_rig::Scene scene = teleop_rig::unfolded_scene();
  hal::VirtualClock clock;
  sim::MobileManipulator plant(scene.robot, scene.environment);
  sim::Hand hand(scene.hand);
  hal::LoopbackRobot robot(plant, clock, kFast, teleop_rig::joints());
  hal::LockstepHapticDevice master(
      std::make_unique<hal::LoopbackHapticLink>(
          hand, kFast, hal::HapticInfo{.name = "pen", .force_limit_N = 8.0, .senses_rotation = true}),
      clock);
  robot.activate();
  master.activate();

  const hal::SteadyClock stopwatch;
  drivers::LatencyHistogram histogram;
  hal::RobotCommand robot_command;
  hal::RobotSample robot_sample;
  hal::HapticCommand command;
  hal::HapticSample sample;
  int n = 0;
  const auto cycle = [&](bool timed) {
    clock.sleep_until(clock.now() + kFast);
    control::TeleopInput input;
    input.robot_fault = !robot.exchange(robot_command, robot_sample).ok();
    input.drives_obey = robot_sample.enabled;
    for (Eigen::Index i = 0; i < 9; ++i) {
      const double position_rad = robot_sample.joints[static_cast<std::size_t>(i)].position_rad;
      (i < 4 ? input.wheel_position_rad[i] : input.arm_position_rad[i - 4]) = position_rad;
    }
    const nanoseconds begin = stopwatch.now();
    const hal::HapticStatus status = master.exchange(command, sample);
    input.master_fault = !status.ok();
    input.master_ready = input.grip_fresh = status.ok();
    input.grip = {sample.p_HD_m, sample.q_HD, sample.v_HD_H_m_per_s};
    input.held_H_N = status.f_D_H_N;
    const control::TeleopOutput& output = teleoperation.step(input);
    command = {output.enable_master, output.force_H_N};
    if (timed) histogram.add(stopwatch.now() - begin);

    robot_command.enable = output.enable_drives;
    for (Eigen::Index i = 0; i < 9; ++i)
      robot_command.joints[static_cast<std::size_t>(i)] =
          i < 4 ? hal::JointCommand::torque_Nm(output.wheel_torque_Nm[i])
          : output.arm == control::TeleopOutput::Arm::kTorque
              ? hal::JointCommand::torque_Nm(output.arm_target[i - 4])
              : hal::JointCommand::position_rad(output.arm_target[i - 4]);
  };
  while (teleoperation.phase() != control::TeleopPhase::kOperating && n++ < 200'000) cycle(false);
  for (auto _ : state) {
    if (n++ % 4000 == 0) hand.move_to({-0.02, n % 8000 < 4000 ? 0.03 : -0.03, 0}, 900ms);
    cycle(true);
  }
  if (teleoperation.phase() != control::TeleopPhase::kOperating) return state.SkipWithError("it stopped");
  bench::set_quantiles(state, histogram);
}
BENCHMARK(HapticPathAt4kHz)->MinTime(1.0);

/// One millisecond of base, arm and contact, with all joints turning.
void SimulatedMobileManipulatorMillisecond(benchmark::State& state) {
  state.SetLabel("simulation of base, arm and contact");
  sim::MobileManipulator plant;
  std::array<hal::JointCommand, 9> commands{};
  for (std::size_t i = 0; i < 4; ++i) commands[i] = hal::JointCommand::torque_Nm(i % 2 == 0 ? -0.4 : 0.4);
  for (std::size_t i = 4; i < 9; ++i)
    commands[i] = hal::JointCommand::velocity_rad_per_s(i == 6 ? -0.01 : 0.01);
  for (auto _ : state) plant.advance(commands, true, 1ms);
  state.counters["simulated_s_per_s"] =
      benchmark::Counter(static_cast<double>(state.iterations()) * 1e-3, benchmark::Counter::kIsRate);
}
BENCHMARK(SimulatedMobileManipulatorMillisecond);

}  // namespace teleop_bench
