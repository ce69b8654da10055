// Cost of a step of each friction law: youBot wheel parameters, 1 ms, a velocity through pre-sliding,
// reversal and sliding up to 5 rad/s. Target: below 100 ns with at most ten states.
#include <benchmark/benchmark.h>

#include <array>
#include <cmath>
#include <string>

#include "model/friction/any_law.h"
#include "model/friction/law_compensator.h"

namespace friction_bench {

using model::friction::AnyLaw;
using model::friction::State;

constexpr std::size_t kPeriod = 4096;

/// Decades of speed from 1e-4 to 5 rad/s in either direction, as much time in each.
std::array<double, kPeriod> velocities() {
  std::array<double, kPeriod> result{};
  for (std::size_t i = 0; i < kPeriod; ++i) {
    const double phase = 8 * static_cast<double>(i) / kPeriod;  // four swings
    const double height = std::abs(std::fmod(phase, 1.0) - 0.5) * 2;
    result[i] = std::copysign(5 * std::pow(10, -4.7 * height), std::fmod(phase, 2.0) - 1);
  }
  return result;
}

void step_of(benchmark::State& state, const AnyLaw& law) {
  static const std::array<double, kPeriod> kVelocities = velocities();
  State memory;
  state.SetLabel("step of a friction law");
  std::size_t n = 0;
  for (auto _ : state) {
    benchmark::DoNotOptimize(law.step(memory, {kVelocities[n], 0.05}, 1e-3));
    n = (n + 1) % kPeriod;
  }
}

/// All ten elements.
AnyLaw with_ten_elements(const char* name) {
  AnyLaw law = model::friction::make_law(name);
  for (int i = 1; i <= 10; ++i)
    law = law.with("share_" + std::to_string(i), 0.1)
              .with("stiffness_" + std::to_string(i) + "_Nm_per_rad", 250.0 / (i + 1));
  return law;
}

void CompensationFromLaw(benchmark::State& state) {
  const model::friction::LawCompensator compensator(model::friction::make_law("lugre"), {});
  double velocity = -5;
  for (auto _ : state) {
    benchmark::DoNotOptimize(compensator.from_measured_Nm(velocity));
    velocity = velocity > 5 ? -5 : velocity + 0.01;
  }
}
BENCHMARK(CompensationFromLaw);

const bool kRegistered = [] {
  for (const auto& description : model::friction::law_descriptions())
    benchmark::RegisterBenchmark(("FrictionLaw/" + std::string(description.name)).c_str(), step_of,
                                 model::friction::make_law(description.name));
  for (const char* name : {"leuven", "gms"})
    benchmark::RegisterBenchmark(("FrictionLaw/" + std::string(name) + "_ten_elements").c_str(), step_of,
                                 with_ten_elements(name));
  return true;
}();

}  // namespace friction_bench
