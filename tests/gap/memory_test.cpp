/// Memory use of rows, counted by allocations that are not yet released.
#include <gtest/gtest.h>
#include <malloc.h>

#include <atomic>
#include <charconv>
#include <cmath>
#include <cstddef>
#include <cstdlib>
#include <fstream>
#include <new>
#include <random>
#include <string>
#include <utility>

#include "identification/gap/gap.h"
#include "model/effects/effect.h"
#include "runtime/recording/recording_reader.h"
#include "tests/support/temporary_directory.h"

namespace {

std::atomic<std::size_t> held_bytes{0};
std::atomic<std::size_t> most_bytes{0};

void* counted(std::size_t size) {
  void* const memory = std::malloc(size);
  if (memory == nullptr) throw std::bad_alloc();
  const std::size_t held = held_bytes += malloc_usable_size(memory);
  std::size_t most = most_bytes;
  while (held > most && !most_bytes.compare_exchange_weak(most, held)) {
  }
  return memory;
}
void released(void* memory) {
  held_bytes -= malloc_usable_size(memory);
  std::free(memory);
}

}  // namespace

void* operator new(std::size_t size) { return counted(size); }
void* operator new[](std::size_t size) { return counted(size); }
void operator delete(void* memory) noexcept { released(memory); }
void operator delete[](void* memory) noexcept { released(memory); }
void operator delete(void* memory, std::size_t) noexcept { released(memory); }
void operator delete[](void* memory, std::size_t) noexcept { released(memory); }

namespace gap_memory_test {
namespace {

using identification::gap::Source;

/// Maximum memory held during `work`, beyond that held before.
template <class Work>
double most_bytes_of(const Work& work) {
  const std::size_t before = held_bytes;
  most_bytes = before;
  work();
  return static_cast<double>(most_bytes - before);
}

/// To and fro at changing speed, with inertia, friction and noise.
Source swinging(std::size_t rows) {
  std::mt19937_64 random(1);
  std::normal_distribution<double> noise(0, 1e-3);
  std::vector<double> time(rows), torque(rows), position(rows), velocity(rows);
  for (std::size_t i = 0; i < rows; ++i) {
    const double t = 1e-3 * static_cast<double>(i);
    time[i] = t;
    position[i] = 2 * std::sin(1.1 * t) + 0.5 * std::sin(7.3 * t);
    velocity[i] = 2.2 * std::cos(1.1 * t) + 3.65 * std::cos(7.3 * t);
    torque[i] = -0.01 * (2.42 * std::sin(1.1 * t) + 26.6 * std::sin(7.3 * t)) +
                std::copysign(0.05, velocity[i]) + 0.01 * velocity[i] + noise(random);
  }
  Source source{.name = "swinging", .recording = {}};
  source.recording.columns.push_back({"time_s", std::move(time)});
  source.recording.columns.push_back({"torque_measured_Nm", std::move(torque)});
  source.recording.columns.push_back({"position_rad", std::move(position)});
  source.recording.columns.push_back({"velocity_rad_per_s", std::move(velocity)});
  return source;
}

double analysed_bytes(std::size_t rows) {
  model::effects::DriveModel base{.name = "bench", .inertia_kg_m2 = 0.01};
  base.effects = {model::effects::make_effect("coulomb", {{"torque_Nm", 0.05}}),
                  model::effects::make_effect("viscous", {{"coefficient_Nm_s_per_rad", 0.01}})};
  identification::gap::Options options;
  options.enough = {.rows = 30'000, .samples = 15'000};
  return most_bytes_of([&] {
    std::vector<Source> data;
    data.push_back(swinging(rows));
    const auto result = identification::gap::analyse(base, std::move(data), {}, options);
    EXPECT_TRUE(result.effects.empty());
    EXPECT_FALSE(result.diagnosis.empty()) << "says what was left out";
  });
}

TEST(GapMemory, ARowTakesAFewTimesItsOwnNumbers) {
  const double of_row = (analysed_bytes(600'000) - analysed_bytes(200'000)) / 400'000;
  constexpr double kColumns = 4 * sizeof(double);
  EXPECT_GT(of_row, kColumns);
  EXPECT_LT(of_row, 4 * kColumns);
}

TEST(GapMemory, AFileIsReadWithoutBeingInMemory) {
  const support::TemporaryDirectory directory;
  const auto path = directory.path() / "long.csv";
  constexpr std::size_t kRows = 200'000;
  {
    std::ofstream file(path);
    file << "# youbot recording v1\ntime_s,torque_measured_Nm,position_rad\n";
    for (std::size_t i = 0; i < kRows; ++i) file << i << ".125,0.0123456,0.1234567\n";
  }
  const auto bytes = static_cast<double>(std::filesystem::file_size(path));
  const double most =
      most_bytes_of([&] { EXPECT_EQ(runtime::read_recording(path).recording.rows(), kRows); });
  EXPECT_GE(most, 3.0 * sizeof(double) * kRows);
  EXPECT_LT(most, 1.2 * bytes);  // reserved for the numbers, and a piece of the text
}

}  // namespace
}  // namespace gap_memory_test
