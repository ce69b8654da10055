// The vendor's symbols. None of them calls another by name, so that a test may remove any of them.
#include <array>
#include <atomic>
#include <cmath>
#include <cstdint>
#include <limits>

#include "sim/devices/force_dimension_stand_in/distant_hand.h"
#include "sim/devices/force_dimension_stand_in/stand_in_device.h"

namespace sim::devices {
namespace {

enum Error {
  kNone = 0,
  kGeneric = 1,
  kCommunication = 2,
  kControllerBusy = 3,
  kNoDevice = 5,
  kNotAvailable = 6,
  kTimeout = 7,
  kExpertModeDisabled = 9,
  kNotImplemented = 10,
  kNotReady = 12,
  kInvalidIndex = 15,
  kNullArgument = 17,
  kDeviceInUse = 20,
  kInvalid = 21,
};
constexpr int kTimeGuard = 1;
constexpr int kMotorSaturated = 2;
constexpr int kStatusSlots = 17;
constexpr double kWristTilt_rad = 0.785398163397448;  // 45 degrees, the sign by handedness [G]

std::array<StandInDevice, kMaxStandInDevices> devices;
int device_count = 1;
int opened_last = -1;
bool expert = false;
std::array<int, 4> sdk_version{3, 17, 5, 0};
ForceDimensionCalls calls;
std::atomic<bool> holding{false};
std::atomic<int> held_calls{0};
thread_local int last_error = kNone;

int fail(int error) {
  last_error = error;
  return -1;
}
int succeed(int result = 0) {
  last_error = kNone;
  return result;
}

void hold(bool on) noexcept {
  holding = on;
  holding.notify_all();
}
int held() noexcept { return held_calls; }
ForceDimensionCalls* the_calls() noexcept { return &calls; }

void reset(int count) noexcept {
  hold(false);
  calls = {};
  device_count = count;
  opened_last = -1;
  expert = false;
  sdk_version = {3, 17, 5, 0};
  last_error = kNone;
  ForceDimensionScript script;
  for (StandInDevice& device : devices) {
    device.reset(script);
    script.type = 36;
    ++script.serial;
  }
}
void set_sdk_version(int major, int minor, int release, int revision) noexcept {
  sdk_version = {major, minor, release, revision};
}
void advance(double seconds) noexcept {
  for (StandInDevice& device : devices) device.advance(seconds);
}
ForceDimensionScript* script_of(int device) noexcept {
  return &devices.at(static_cast<std::size_t>(device)).script;
}
const ForceDimensionState* state_of(int device) noexcept {
  StandInDevice& found = devices.at(static_cast<std::size_t>(device));
  found.state.expert = expert;
  return &found.state;
}
constexpr ForceDimensionControl kControl{reset,    set_sdk_version, advance, script_of,
                                         state_of, the_calls,       hold,    held};

/// char is unsigned on some machines.
bool is_default(char id) { return static_cast<signed char>(id) == -1; }
int index_of(char id) { return is_default(id) ? opened_last : id; }

/// Null, with the error set, if it is not open or does not answer.
StandInDevice* find(char id) {
  const int index = index_of(id);
  if (index < 0 || index >= device_count || !devices[static_cast<std::size_t>(index)].state.open) {
    fail(kNoDevice);
    return nullptr;
  }
  StandInDevice& device = devices[static_cast<std::size_t>(index)];
  if (!device.reachable()) {
    fail(kCommunication);
    return nullptr;
  }
  return &device;
}

/// Common path of all calls that can fail.
template <typename Work>
int call(Work work) {
  if (holding) {
    ++held_calls;
    holding.wait(true);
    --held_calls;
  }
  static DistantHandLink distant_hand;
  advance(calls.cost_s + distant_hand.take(devices.front().script));
  const bool fails = ++calls.made == calls.failing;
  if (fails && !calls.failing_works) return fail(calls.failing_code);
  const int result = work();
  return fails ? fail(calls.failing_code) : result;
}

template <typename Work>
int call_on(char id, Work work) {
  return call([&] {
    StandInDevice* device = find(id);
    return device == nullptr ? -1 : work(*device);
  });
}

template <typename Work>
int call_as_expert(char id, Work work) {
  return call([&] {
    if (!expert) return fail(kExpertModeDisabled);
    StandInDevice* device = find(id);
    return device == nullptr ? -1 : work(*device);
  });
}

template <typename Work>
int call_drd(char id, Work work) {
  return call_on(id, [&](StandInDevice& device) {
    if (device.script.drd_needs_its_own_open && !device.state.opened_by_drd) return fail(kNoDevice);
    return work(device);
  });
}

int open(int index) {
  if (index < 0 || index >= device_count) return fail(kNoDevice);
  StandInDevice& device = devices[static_cast<std::size_t>(index)];
  if (!device.script.connected) return fail(kNoDevice);
  if (device.script.held_by_other) return fail(kDeviceInUse);
  if (!device.state.open) device.open();
  opened_last = index;
  return succeed(index);
}

template <typename Matches>
int open_first(Matches matches) {
  int error = kNoDevice;
  for (int i = 0; i < device_count; ++i) {
    const ForceDimensionScript& script = devices[static_cast<std::size_t>(i)].script;
    if (!script.connected || !matches(script)) continue;
    if (!script.held_by_other) return open(i);
    error = kDeviceInUse;
  }
  return fail(error);
}

template <typename Counts>
int count_devices(Counts counts) {
  int count = 0;
  for (int i = 0; i < device_count; ++i) count += counts(devices[static_cast<std::size_t>(i)]) ? 1 : 0;
  return succeed(count);
}

using Matrix = std::array<Axes, 3>;
Matrix product(const Matrix& a, const Matrix& b) {
  Matrix c{};
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t j = 0; j < 3; ++j) {
      for (std::size_t k = 0; k < 3; ++k) c[i][j] += a[i][k] * b[k][j];
    }
  }
  return c;
}
Matrix about_x(double angle_rad) {
  const double c = std::cos(angle_rad);
  const double s = std::sin(angle_rad);
  return {{{1, 0, 0}, {0, c, -s}, {0, s, c}}};
}
Matrix about_y(double angle_rad) {
  const double c = std::cos(angle_rad);
  const double s = std::sin(angle_rad);
  return {{{c, 0, s}, {0, 1, 0}, {-s, 0, c}}};
}
Matrix about_z(double angle_rad) {
  const double c = std::cos(angle_rad);
  const double s = std::sin(angle_rad);
  return {{{c, -s, 0}, {s, c, 0}, {0, 0, 1}}};
}

int scripted_failure(int& left, int code) {
  if (left <= 0) return kNone;
  --left;
  return code;
}

int read_pose(StandInDevice& device, Axes* position_m, double (*rotation)[3]) {
  ForceDimensionScript& script = device.script;
  if (const int code = scripted_failure(script.failing_poses, script.failing_code)) return fail(code);
  const bool guarded = device.read_guarded();
  const auto poisoned = [&script](double value, std::size_t number) {
    const bool poison = script.pose_is_nan && static_cast<int>(number) == script.nan_value;
    return poison ? std::numeric_limits<double>::quiet_NaN() : value;
  };
  if (position_m != nullptr) {
    for (std::size_t i = 0; i < 3; ++i) (*position_m)[i] = poisoned(device.position_m()[i], i);
  }
  if (rotation != nullptr) {
    const Axes wrist_rad = device.wrist_rad();
    const double tilt_rad = script.type == 36 ? -kWristTilt_rad : kWristTilt_rad;
    Matrix r = product(about_x(wrist_rad[0]), product(about_y(wrist_rad[1]), about_z(wrist_rad[2])));
    r = product(about_y(tilt_rad), product(r, about_y(-tilt_rad)));
    for (std::size_t i = 0; i < 3; ++i) {
      for (std::size_t j = 0; j < 3; ++j) rotation[i][j] = poisoned(r[i][j], 3 + 3 * i + j);
    }
  }
  return succeed(guarded ? kTimeGuard : 0);
}

int close(char id, bool by_drd) {
  const int index = index_of(id);
  if (index < 0 || index >= device_count) return fail(kNoDevice);
  StandInDevice& device = devices[static_cast<std::size_t>(index)];
  if (!device.state.open) return fail(kNoDevice);
  if (device.script.drd_needs_its_own_open && device.state.opened_by_drd != by_drd) return fail(kNoDevice);
  device.close();
  return succeed();
}

}  // namespace
}  // namespace sim::devices

// NOLINTBEGIN(readability-identifier-naming): the names are the vendor's.
extern "C" {
using namespace sim::devices;  // NOLINT(google-build-using-namespace): this file ends with its use

const ForceDimensionControl* fd_stand_in_control() { return &kControl; }

void dhdGetSDKVersion(int* major, int* minor, int* release, int* revision) {
  if (major != nullptr) *major = sdk_version[0];
  if (minor != nullptr) *minor = sdk_version[1];
  if (release != nullptr) *release = sdk_version[2];
  if (revision != nullptr) *revision = sdk_version[3];
}
int dhdErrorGetLast() { return last_error; }

int dhdGetDeviceCount() {
  return call(
      [] { return count_devices([](const StandInDevice& device) { return device.script.connected; }); });
}
int dhdGetAvailableCount() {
  return call([] {
    return count_devices(
        [](const StandInDevice& device) { return device.script.connected && !device.script.held_by_other; });
  });
}
int dhdGetSystemType(char id) {
  return call_on(id, [](StandInDevice& device) { return succeed(device.script.type); });
}
int dhdGetSerialNumber(std::uint16_t* serial, char id) {
  return call_on(id, [serial](StandInDevice& device) {
    if (serial == nullptr) return fail(kNullArgument);
    *serial = device.script.serial;
    return succeed();
  });
}
int dhdGetVersion(double* firmware, char id) {
  return call_on(id, [firmware](StandInDevice& device) {
    if (firmware == nullptr) return fail(kNullArgument);
    *firmware = device.script.firmware;
    return succeed();
  });
}

int dhdOpenID(char index) {
  return call([index] { return open(is_default(index) ? 0 : index); });
}
int dhdOpenType(int type) {
  return call([type] {
    return open_first([type](const ForceDimensionScript& script) { return script.type == type; });
  });
}
int dhdOpenSerial(int serial) {
  return call([serial] {
    return open_first([serial](const ForceDimensionScript& script) { return script.serial == serial; });
  });
}
int dhdClose(char id) {
  return call([id] { return close(id, false); });
}

int dhdGetStatus(int* status, char id) {
  return call_on(id, [status](StandInDevice& device) {
    if (status == nullptr) return fail(kNullArgument);
    for (int i = 0; i < kStatusSlots; ++i) status[i] = 0;
    const ForceDimensionMode mode = device.reported_mode();
    const ForceDimensionScript& script = device.script;
    status[0] = script.powered && !script.status_says_no_power ? 1 : 0;
    status[1] = script.status_says_not_connected ? 0 : 1;
    status[2] = 1;
    status[3] = mode == ForceDimensionMode::kReset || script.status_says_reset ? 1 : 0;
    status[4] = mode == ForceDimensionMode::kIdle ? 1 : 0;
    status[5] = mode == ForceDimensionMode::kForce && !script.status_says_braked ? 1 : 0;
    status[6] = mode == ForceDimensionMode::kBrake ? 1 : 0;
    status[8] = 1;
    status[9] = script.error;
    status[10] = device.state.gravity_compensation ? 1 : 0;
    status[12] = script.wrist_calibrated ? 1 : 0;
    status[14] = device.state.force_off_cause;
    return succeed();
  });
}
std::uint32_t dhdGetButtonMask(char id) {
  std::uint32_t buttons = 0;
  const int result = call_on(id, [&buttons](StandInDevice& device) {
    buttons = device.script.buttons;
    return succeed();
  });
  return result < 0 ? 0 : buttons;
}
int dhdGetButton(int index, char id) {
  return call_on(id, [index](StandInDevice& device) {
    if (index < 0 || index >= 32) return fail(kInvalidIndex);
    return succeed(static_cast<int>(device.script.buttons >> index & 1U));
  });
}

int dhdGetPosition(double* x_m, double* y_m, double* z_m, char id) {
  return call_on(id, [=](StandInDevice& device) {
    if (x_m == nullptr || y_m == nullptr || z_m == nullptr) return fail(kNullArgument);
    Axes position_m{};
    const int result = read_pose(device, &position_m, nullptr);
    if (result < 0) return result;
    *x_m = position_m[0];
    *y_m = position_m[1];
    *z_m = position_m[2];
    return result;
  });
}
int dhdGetOrientationFrame(double rotation[3][3], char id) {
  return call_on(id, [rotation](StandInDevice& device) {
    return rotation == nullptr ? fail(kNullArgument) : read_pose(device, nullptr, rotation);
  });
}
int dhdGetPositionAndOrientationFrame(double* x_m, double* y_m, double* z_m, double rotation[3][3], char id) {
  return call_on(id, [=](StandInDevice& device) {
    if (x_m == nullptr || y_m == nullptr || z_m == nullptr || rotation == nullptr) return fail(kNullArgument);
    Axes position_m{};
    const int result = read_pose(device, &position_m, rotation);
    if (result < 0) return result;
    *x_m = position_m[0];
    *y_m = position_m[1];
    *z_m = position_m[2];
    return result;
  });
}

int dhdEnableForce(std::uint8_t on, char id) {
  return call_on(id, [on](StandInDevice& device) {
    if (on != 0 && (device.script.refuses_to_enable || device.state.mode == ForceDimensionMode::kReset))
      return fail(kNotReady);
    device.enable_force(on != 0);
    return succeed();
  });
}
int dhdStop(char id) {
  return call_on(id, [](StandInDevice& device) {
    ++device.state.stop_calls;
    if (const int code = scripted_failure(device.script.failing_stops, device.script.failing_code))
      return fail(code);
    device.enable_force(false);
    return succeed();
  });
}
int dhdSetForce(double x_N, double y_N, double z_N, char id) {
  return call_on(id, [=](StandInDevice& device) {
    if (const int code = scripted_failure(device.script.failing_forces, device.script.failing_code))
      return fail(code);
    if (device.state.regulation) return fail(kControllerBusy);
    if (!std::isfinite(x_N) || !std::isfinite(y_N) || !std::isfinite(z_N)) return fail(kInvalid);
    if (device.script.refuses_force_when_braked && device.state.mode != ForceDimensionMode::kForce)
      return fail(kNotReady);
    return succeed(device.set_force({x_N, y_N, z_N}) ? kMotorSaturated : 0);
  });
}
int dhdSetMaxForce(double force_N, char id) {
  return call_on(id, [force_N](StandInDevice& device) {
    device.state.max_force_N = force_N;
    return succeed();
  });
}
int dhdSetGravityCompensation(int on, char id) {
  return call_on(id, [on](StandInDevice& device) {
    device.state.gravity_compensation = on != 0;
    return succeed();
  });
}
int dhdSetEffectorMass(double mass_kg, char id) {
  return call_on(id, [mass_kg](StandInDevice& device) {
    device.state.effector_mass_kg = mass_kg;
    return succeed();
  });
}
double dhdGetComFreq(char id) {
  double rate_kHz = 0.0;
  const int result = call_on(id, [&rate_kHz](StandInDevice& device) {
    rate_kHz = device.force_rate_kHz();
    return succeed();
  });
  return result < 0 ? 0.0 : rate_kHz;
}

int drdOpenID(char index) {
  return call([index] {
    const int number = is_default(index) ? 0 : index;
    const bool otherwise = devices[0].script.drd_counts_otherwise;
    const int opened = open(otherwise ? device_count - 1 - number : number);
    if (opened >= 0) devices[static_cast<std::size_t>(opened)].state.opened_by_drd = true;
    return opened;
  });
}
int drdClose(char id) {
  return call([id] { return close(id, true); });
}
bool drdIsInitialized(char id) {
  const int result = call_drd(id, [](StandInDevice& device) {
    return succeed(device.script.calibrated && device.script.drd_agrees ? 1 : 0);
  });
  return result > 0;
}
int drdAutoInit(char id) {
  return call_drd(id, [](StandInDevice& device) {
    if (device.script.calibration_fails) return fail(kTimeout);
    device.calibrate();
    if (device.script.calibration_fails_half_way) {
      device.script.calibrated = false;
      return fail(kTimeout);
    }
    return succeed();
  });
}
int drdStop(bool keep_force, char id) {
  return call_drd(id, [keep_force](StandInDevice& device) {
    if (const int code = scripted_failure(device.script.failing_drd_stops, device.script.failing_code))
      return fail(code);
    device.state.regulation = false;
    if (!keep_force) device.enable_force(false);
    return succeed();
  });
}

int dhdEnableExpertMode() {
  return call([] {
    expert = true;
    return succeed();
  });
}
int dhdDisableExpertMode() {
  return call([] {
    expert = false;
    return succeed();
  });
}
int dhdSetWatchdog(std::uint8_t ticks, char id) {
  return call_as_expert(id, [ticks](StandInDevice& device) {
    if (device.script.firmware < 3.0) return fail(kNotImplemented);
    device.state.watchdog_ticks = ticks;
    return succeed();
  });
}
int dhdGetWatchdog(std::uint8_t* ticks, char id) {
  return call_as_expert(id, [ticks](StandInDevice& device) {
    if (ticks == nullptr) return fail(kNullArgument);
    const int reads_back = device.script.watchdog_reads_back;
    *ticks = static_cast<std::uint8_t>(reads_back >= 0 ? reads_back : device.state.watchdog_ticks);
    return succeed();
  });
}
int dhdGetVelocityThreshold(std::uint32_t* threshold, char id) {
  return call_as_expert(id, [threshold](StandInDevice& device) {
    if (threshold == nullptr) return fail(kNullArgument);
    *threshold = device.script.velocity_threshold_mm_per_s;
    return succeed();
  });
}
/// Exported so that a test can check that it is never called.
int dhdSetVelocityThreshold(std::uint32_t threshold, char id) {
  return call_as_expert(id, [threshold](StandInDevice& device) {
    ++device.state.velocity_threshold_writes;
    device.script.velocity_threshold_mm_per_s = threshold;
    return succeed();
  });
}
int dhdSetTimeGuard(int guard_us, char id) {
  return call_as_expert(id, [guard_us](StandInDevice& device) {
    if (guard_us < 0) return fail(kInvalid);
    device.set_time_guard(guard_us);
    return succeed();
  });
}
}
// NOLINTEND(readability-identifier-naming)
