// The Force Dimension driver on a library whose results are the input. First byte: whether calibration may
// move the handle, and how many cycles the clutch is closed at a time.
#include <dlfcn.h>

#include <algorithm>
#include <string>

#include "drivers/haptic/force_dimension.h"
#include "drivers/setup_error.h"
#include "tests/fuzz/fuzz_target.h"
#include "tests/fuzz/lying_vendor_library.h"

namespace {

using namespace std::chrono_literals;
using drivers::haptic::DeviceSample;
using drivers::haptic::DeviceStatus;
using drivers::haptic::ForceDimension;
using drivers::haptic::ForceDimensionConfig;
using drivers::haptic::is_finite;
using fuzz::require;

constexpr double kLimit_N = 6;
/// Of one exchange, and of set-up or end.
constexpr long kMaxCallsInACycle = 40;
constexpr long kMaxCallsOfSetup = 400;

fuzz::VendorLies* lies() {
  void* const library = dlopen(YOUBOT_LYING_VENDOR_LIBRARY, RTLD_NOW | RTLD_LOCAL);
  require(library != nullptr);
  return reinterpret_cast<fuzz::VendorLiesFunction*>(dlsym(library, fuzz::kVendorLies))();
}

void check(const DeviceStatus& status, const DeviceSample& sample, const fuzz::VendorLies& vendor) {
  require(is_finite(status.f_D_H_N) && is_finite(sample.p_HD_m) &&
          std::ranges::all_of(sample.R_HD, is_finite));
  require(vendor.largest_command_N <= kLimit_N * (1 + 1e-12));
  // A fault leaves no force on: the last command is zero.
  if (!status.ok()) require(vendor.command_N == std::array<double, 3>{});
}

void drive(const drivers::haptic::ForceDimensionLibrary& library, fuzz::VendorLies& vendor,
           std::uint8_t how) {
  ForceDimensionConfig config;
  config.allow_motion = (how & 1) != 0;
  config.max_force_N = kLimit_N;
  config.wait = [](std::chrono::nanoseconds) {};
  ForceDimension device(library, config);
  const auto& info = device.info();
  require(vendor.calls < kMaxCallsOfSetup && info.force_limit_N == kLimit_N);
  const bool known_to_have_none =
      info.firmware && *info.firmware < drivers::haptic::kFirstFirmwareWithWatchdog;
  require(info.watchdog_ticks == (known_to_have_none ? 0 : config.watchdog_ticks()));
  DeviceSample sample;
  std::chrono::nanoseconds now = 1s;
  for (int cycle = 0; cycle < 3000 && (cycle < 1500 || !vendor.left.empty()); ++cycle) {
    const long before = vendor.calls;
    const bool enable = cycle / (100 + how) % 8 != 7;
    check(device.exchange({.enable = enable, .f_D_H_N = {9, -3, 1e3}}, now += 1ms, sample), sample, vendor);
    require(vendor.calls - before <= kMaxCallsInACycle);
  }
  const long before = vendor.calls;
  require(device.stop() != vendor.refuses_stop && vendor.calls - before < kMaxCallsOfSetup);
}

}  // namespace

std::vector<fuzz::Bytes> fuzz::seeds() {
  std::vector<Bytes> seeds{{0}, {1}};
  for (const std::size_t at : {6U, 10U, 20U, 40U, 60U, 100U, 200U}) {
    seeds.emplace_back(at, std::uint8_t{0});
    seeds.back().insert(seeds.back().end(), {224, 225, 231});
  }
  return seeds;
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const drivers::haptic::ForceDimensionLibrary library(
      {.file = YOUBOT_LYING_VENDOR_LIBRARY, .sdk_folder = {}});
  fuzz::Input input(data, size);
  const std::uint8_t how = input.byte();
  const fuzz::Bytes answers = input.rest();
  fuzz::VendorLies& vendor = *lies();
  vendor.left = answers;
  try {
    drive(library, vendor, how);
  } catch (const drivers::SetupError& error) {
    require(std::string(error.what()).size() > 20 && vendor.calls < kMaxCallsOfSetup);
  }
  return 0;
}
