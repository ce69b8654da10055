// Cost of each part of the base's cycle, and the speed of the simulation.
#include <benchmark/benchmark.h>

#include <chrono>

#include "control/base_controller.h"
#include "drivers/latency_histogram.h"
#include "hal/clock.h"
#include "model/friction/wheel_curve.h"
#include "operation/base_task.h"
#include "runtime/open_robot.h"
#include "sim/base.h"
#include "tests/bench/quantiles.h"

namespace control_bench {

using namespace std::chrono_literals;
using std::chrono::nanoseconds;

void WheelCurveAsPublished(benchmark::State& state) {
  state.SetLabel("wheel curve as published");
  double velocity = -10;
  for (auto _ : state) {
    benchmark::DoNotOptimize(model::friction::wheel_curve_Nm(1, velocity));
    velocity = velocity > 10 ? -10 : velocity + 0.01;
  }
}
BENCHMARK(WheelCurveAsPublished);

void WheelCurveFromTable(benchmark::State& state) {
  state.SetLabel("wheel curve from the table");
  const model::friction::SlidingTable table = model::friction::wheel_table(1);
  double velocity = -10;
  for (auto _ : state) {
    benchmark::DoNotOptimize(table.level_Nm(velocity));
    velocity = velocity > 10 ? -10 : velocity + 0.01;
  }
}
BENCHMARK(WheelCurveFromTable);

void ControllerStep(benchmark::State& state) {
  state.SetLabel("control step of the base");
  control::BaseController controller(control::BaseController::Config{});
  control::WheelVector position = control::WheelVector::Zero();
  control::BaseReference reference;
  reference.X_WB.x_m = 0.1;
  for (auto _ : state) {
    position += control::WheelVector(-1e-3, 1e-3, -1e-3, 1e-3);
    benchmark::DoNotOptimize(controller.step(position, reference));
  }
}
BENCHMARK(ControllerStep);

/// One millisecond of the simulated base with all wheels turning.
void SimulatedMillisecond(benchmark::State& state) {
  sim::BaseParameters parameters;
  parameters.on_ground = state.range(0) != 0;
  state.SetLabel(parameters.on_ground ? "simulation of the base on the ground"
                                      : "simulation of the wheels in the air");
  sim::Base base(parameters);
  const std::array<hal::JointCommand, 4> commands{
      hal::JointCommand::torque_Nm(-0.3), hal::JointCommand::torque_Nm(0.3),
      hal::JointCommand::torque_Nm(-0.3), hal::JointCommand::torque_Nm(0.3)};
  for (auto _ : state) base.advance(commands, true, 1ms);
  state.counters["simulated_s_per_s"] =
      benchmark::Counter(static_cast<double>(state.iterations()) * 1e-3, benchmark::Counter::kIsRate);
}
BENCHMARK(SimulatedMillisecond)->ArgName("on_ground")->Arg(0)->Arg(1);

class CirclingMotion final : public operation::MotionSource {
 public:
  void begin(nanoseconds now, const control::PlanarPose&) noexcept override { begin_ = now; }
  operation::Motion read(nanoseconds now, const control::PlanarPose&) noexcept override {
    return {now, path_.at(std::fmod(std::chrono::duration<double>(now - begin_).count(), path_.duration_s())),
            false};
  }

 private:
  control::BasePath path_{{{}, {{0.5, 0, 0}, {0, 0.5, 0}, {-0.5, 0, 0}, {0, -0.5, 0}}, 0.5, {}}};
  nanoseconds begin_{};
};

/// All that youbotd does in a cycle on `robot`: exchange() with the simulated base, observers, controller,
/// compensation. The counters are quantiles over single cycles, the time is their mean.
void whole_cycle(benchmark::State& state, const char* robot_name) {
  hal::VirtualClock clock;
  runtime::RobotOptions options;
  options.name = robot_name;
  const runtime::OpenedRobot opened = runtime::open_robot(options, clock, 1ms);
  opened.robot->activate();
  CirclingMotion motion;
  operation::Cycle cycle(operation::Cycle::Config{}, *opened.robot, motion, opened.truth);
  const hal::SteadyClock stopwatch;
  drivers::LatencyHistogram histogram;
  for (auto _ : state) {
    clock.sleep_until(clock.now() + 1ms);
    const nanoseconds begin = stopwatch.now();
    cycle.step(clock.now());
    histogram.add(stopwatch.now() - begin);
  }
  if (cycle.stop_reason()) state.SkipWithError("the cycle stopped");
  bench::set_quantiles(state, histogram);
}

void WholeLoopbackCycle(benchmark::State& state) {
  state.SetLabel("whole loopback cycle: exchange, simulated base, observers, control");
  whole_cycle(state, "loopback");
}
BENCHMARK(WholeLoopbackCycle)->MinTime(2.0);

/// The same through the EtherCAT master and five emulated slaves, whose own work is in the figure.
void WholeWireCycle(benchmark::State& state) {
  state.SetLabel("the same through every byte of the EtherCAT master, five emulated slaves");
  whole_cycle(state, "wire");
}
BENCHMARK(WholeWireCycle)->MinTime(2.0);

}  // namespace control_bench
