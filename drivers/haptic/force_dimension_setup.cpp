#include "drivers/haptic/force_dimension_setup.h"

#include <array>
#include <charconv>
#include <cmath>
#include <initializer_list>
#include <thread>
#include <utility>

#include "drivers/setup_error.h"

namespace drivers::haptic {
namespace {

using namespace std::chrono_literals;

constexpr const char* kDevice = "Force Dimension omega.6";

std::string last_error(const SdkFunctions& f) {
  if (f.error_get_last == nullptr) return "an error (this library does not tell which)";
  const int code = f.error_get_last();
  return std::string(describe_sdk_error(code)) + " (SDK error " + std::to_string(code) + ")";
}

std::string type_in_words(int type) {
  return std::string(describe_system_type(type)) + " (type " + std::to_string(type) + ")";
}

std::string one_decimal(double value) {
  std::array<char, 32> text{};
  const auto result =
      std::to_chars(text.data(), text.data() + text.size(), value, std::chars_format::fixed, 1);
  return {text.data(), result.ptr};
}

/// libdrd may know only devices that it opened itself: who calls it has it open them. A library with half of
/// that pair is used as one without.
bool libdrd_has_it(const SdkFunctions& f) noexcept {
  return f.drd_open_id != nullptr && f.drd_close != nullptr;
}

bool is_omega6(int type) noexcept { return type == kOmega6Right || type == kOmega6Left; }

SetupError not_opened(const SdkFunctions& f, const std::string& wanted) {
  const std::string why = last_error(f);
  const int all = f.get_device_count != nullptr ? f.get_device_count() : -1;
  const int available = f.get_available_count != nullptr ? f.get_available_count() : -1;
  std::string counted;
  if (all >= 0) counted = ", " + std::to_string(all) + " connected";
  if (available >= 0) counted += ", " + std::to_string(available) + " available";
  std::string hint =
      "connect its USB cable, switch it on, and see that the user may access vendor 1451 (udev)";
  if (all > 0 && available == 0) hint = "another program has it open: end that program";
  if (available > 0) hint = "name another device, or none to take the first omega.6";
  return SetupError({kDevice, "open " + wanted, "a device", why + counted, hint});
}

/// @throws SetupError when that fails, with the device closed.
void hand_to_libdrd(const SdkFunctions& f, char id) {
  const int taken = f.drd_open_id(id);
  if (taken == id) return;
  const std::string found = sdk_failed(taken) ? last_error(f) : "device " + std::to_string(taken);
  f.drd_close(sdk_failed(taken) ? id : static_cast<char>(taken));  // the answer alone may have been lost
  f.close(id);
  throw SetupError({kDevice, "hand it to libdrd, which calibrates", "device " + std::to_string(id), found,
                    "unplug other haptic devices, or install a newer SDK"});
}

/// One device under preparation: calls that name their step when they fail.
class Preparation {
 public:
  Preparation(const ForceDimensionLibrary& library, char id, const ForceDimensionConfig& config)
      : library_(library), f_(library.functions()), id_(id), config_(config) {}

  ForceDimensionInfo run() {
    identify();
    check_state();
    calibrate();
    set_expert_values();
    limit_force();
    for (const MissingSymbol& missing : library_.missing()) {
      info_.warnings.push_back("this SDK (" + to_string(info_.sdk) + ") has no " + missing.symbol + ": " +
                               missing.feature + " is not possible");
    }
    return std::move(info_);
  }

 private:
  void check(int result, const std::string& step, const std::string& hint) const {
    if (sdk_failed(result)) fail(step, "success", last_error(f_), hint);
  }
  /// A calibration that fails half-way may leave the SDK's regulation pushing.
  void check_regulation(int result, const std::string& step, const std::string& hint) const {
    if (!sdk_failed(result)) return;
    const std::string why = last_error(f_);
    fail(step, "success", why,
         stop_regulation() ? hint : "the SDK may still be driving the handle: switch the device off");
  }
  bool stop_regulation() const {
    for (int attempt = 0; attempt < kStopAttempts; ++attempt) {
      if (attempt > 0) wait_without_throwing(config_.wait, kStopRetry);
      if (!sdk_failed(f_.drd_stop(false, id_))) return true;
    }
    return false;
  }
  [[noreturn]] void fail(const std::string& step, const std::string& expected, const std::string& found,
                         const std::string& hint) const {
    throw SetupError({info_.name.empty() ? kDevice : info_.name, step, expected, found, hint});
  }
  void warn(std::string warning) { info_.warnings.push_back(std::move(warning)); }

  void identify() {
    info_.sdk = library_.version();
    info_.type = f_.get_system_type(id_);
    if (!is_omega6(info_.type)) {
      fail("check the type", "omega.6 (34 or 36)",
           info_.type < 0 ? last_error(f_) : type_in_words(info_.type),
           "name the omega.6 by its serial number, or connect one");
    }
    info_.left_handed = info_.type == kOmega6Left;
    info_.name = describe_system_type(info_.type);
    std::uint16_t serial = 0;
    if (f_.get_serial_number != nullptr && !sdk_failed(f_.get_serial_number(&serial, id_))) {
      info_.serial = serial;
      info_.name += " (serial " + std::to_string(serial) + ")";
    }
    double firmware = 0.0;
    // What is no version says nothing about the watchdog, which is then set or refused.
    if (f_.get_version != nullptr && !sdk_failed(f_.get_version(&firmware, id_)) && std::isfinite(firmware) &&
        firmware > 0)
      info_.firmware = firmware;
  }

  std::array<int, kStatusCapacity> status() const {
    std::array<int, kStatusCapacity> slots{};
    check(f_.get_status(slots.data(), id_), "read the status", "reconnect the USB cable");
    return slots;
  }

  void check_state() {
    const auto slots = status();
    if (slots[status_slot::kConnected] == 0)
      fail("check the state", "connected", "not connected", "reconnect the USB cable");
    if (slots[status_slot::kPower] == 0)
      fail("check the state", "power", "no power", "switch the device on and check its supply");
    if (slots[status_slot::kError] != 0) {
      fail("check the state", "no error",
           "the device reports error " + std::to_string(slots[status_slot::kError]),
           "switch the device off and on");
    }
  }

  /// Both have to agree: forces computed from a pose that is not calibrated are worse than a refusal.
  bool is_calibrated() const {
    if (status()[status_slot::kReset] != 0) return false;
    return !libdrd_has_it(f_) || f_.drd_is_initialized == nullptr || f_.drd_is_initialized(id_);
  }

  void calibrate() {
    if (!is_calibrated()) {
      constexpr const char* kStep = "check the calibration";
      if (!config_.allow_motion) {
        fail(kStep, "a calibrated device", "none since it was switched on",
             "put the handle into its rest until the light stops blinking; or allow motion (allow_motion), "
             "keep clear, and the device calibrates itself");
      }
      library_.require({"drdOpenID", "drdClose", "drdAutoInit", "drdStop"});
      check_regulation(f_.drd_auto_init(id_), "calibrate by moving the handle",
                       "let go of the handle and keep it clear");
      // Hands the force back with the motors still on; set-up ends with them off.
      check_regulation(f_.drd_stop(true, id_), "take over from calibration", "switch the device off and on");
      if (!is_calibrated())
        fail(kStep, "a calibrated device", "none after calibration", "switch the device off and on");
    }
    const auto slots = status();
    if (slots[status_slot::kWristDetected] != 0 && slots[status_slot::kWristInitialised] == 0)
      warn("the wrist is not calibrated: its orientation means nothing; switch the device off and on");
  }

  /// Expert mode for as long as this lives, thrown through or not: it is one for the whole process.
  class ExpertMode {
   public:
    explicit ExpertMode(const Preparation& preparation) : f_(preparation.f_) {
      preparation.check(f_.enable_expert_mode(), "enter expert mode", "use a newer SDK");
    }
    ExpertMode(const ExpertMode&) = delete;
    ExpertMode& operator=(const ExpertMode&) = delete;
    ~ExpertMode() { f_.disable_expert_mode(); }

   private:
    const SdkFunctions& f_;
  };

  void set_expert_values() {
    const bool has_watchdog = !info_.firmware || *info_.firmware >= kFirstFirmwareWithWatchdog;
    if (has_watchdog) library_.require({"dhdSetWatchdog", "dhdEnableExpertMode", "dhdDisableExpertMode"});
    if (config_.time_guard)
      library_.require({"dhdSetTimeGuard", "dhdEnableExpertMode", "dhdDisableExpertMode"});
    if (!has_watchdog) {
      warn(
          "firmware " + one_decimal(*info_.firmware) +
          " has no watchdog (it came with 3.0): when this program hangs the last force stays; keep a hand on "
          "the switch");
    }
    if (!library_.has("dhdEnableExpertMode") || !library_.has("dhdDisableExpertMode")) return;

    const ExpertMode expert(*this);
    if (has_watchdog) set_watchdog();
    if (config_.time_guard) {
      check(f_.set_time_guard(static_cast<int>(config_.time_guard->count()), id_), "set the time guard",
            "leave it at the SDK's value");
    }
    read_velocity_threshold();
  }

  void set_watchdog() {
    const int wanted = config_.watchdog_ticks();
    const std::string step = "set the watchdog to " + std::to_string(wanted) + " ticks of 125 us";
    check(f_.set_watchdog(static_cast<std::uint8_t>(wanted), id_), step, "update the device's firmware");
    if (f_.get_watchdog != nullptr) {
      std::uint8_t ticks = 0;
      check(f_.get_watchdog(&ticks, id_), step, "update the device's firmware");
      if (ticks != wanted)
        fail(step, std::to_string(wanted), std::to_string(ticks), "update the device's firmware");
    }
    info_.watchdog_ticks = wanted;
  }

  void read_velocity_threshold() {
    std::uint32_t threshold = 0;
    if (f_.get_velocity_threshold == nullptr || sdk_failed(f_.get_velocity_threshold(&threshold, id_)))
      return;
    info_.velocity_threshold = threshold;
    if (threshold == 0) {
      warn(
          "some program has switched the device's velocity threshold off: switch the device off and on to "
          "have the factory's back");
    }
  }

  void limit_force() {
    if (config_.effector_mass_kg) {
      library_.require({"dhdSetEffectorMass"});
      check(f_.set_effector_mass(*config_.effector_mass_kg, id_), "set the handle's mass",
            "leave effector_mass_kg empty");
    }
    check(f_.set_gravity_compensation(1, id_), "switch gravity compensation on", "use a newer SDK");
    check(f_.set_max_force(config_.max_force_N, id_), "limit the force", "use a newer SDK");
    info_.force_limit_N = config_.max_force_N;
    // It is not documented whether this is refused while the force is off, so the result says nothing.
    f_.set_force(0.0, 0.0, 0.0, id_);
    check(f_.enable_force(0, id_), "switch the force off", "switch the device off and on");
  }

  const ForceDimensionLibrary& library_;
  const SdkFunctions& f_;
  char id_;
  const ForceDimensionConfig& config_;
  ForceDimensionInfo info_;
};

bool within(double value, double low, double high) noexcept { return value >= low && value <= high; }

}  // namespace

void sleep_for(std::chrono::nanoseconds time) { std::this_thread::sleep_for(time); }

void wait_without_throwing(const WaitFor& wait, std::chrono::nanoseconds time) noexcept {
  try {
    wait(time);
  } catch (...) {  // without a pause, then
  }
}

int ForceDimensionConfig::watchdog_ticks() const noexcept {
  return static_cast<int>(watchdog.count() / kWatchdogTick_us);
}

std::vector<std::string> ForceDimensionConfig::problems() const {
  std::vector<std::string> list;
  const auto need = [&list](bool ok, const char* what) {
    if (!ok) list.emplace_back(what);
  };
  need(watchdog.count() >= kWatchdogTick_us && watchdog.count() < kWatchdogTick_us * (kWatchdogMaxTicks + 1),
       "watchdog: 125 us to 31.875 ms, and never off");
  need(max_force_N > 0.0 && max_force_N <= kOmega6MaxForce_N, "max_force_N: above 0 and up to 12 N");
  need(!effector_mass_kg || within(*effector_mass_kg, 0.0, 1.0), "effector_mass_kg: 0 to 1 kg");
  need(!time_guard || (*time_guard >= 0us && *time_guard <= 10ms), "time_guard: 0 to 10 ms");
  need(settle >= 20ms && settle <= 10s, "settle: 20 ms to 10 s");
  need(!index || *index <= 127, "index: 0 to 127");
  need(static_cast<bool>(wait), "wait: a function");
  return list;
}

char open_force_dimension(const ForceDimensionLibrary& library, const ForceDimensionConfig& config) {
  std::string problems;
  for (const std::string& problem : config.problems()) problems += (problems.empty() ? "" : "; ") + problem;
  if (!problems.empty())
    throw SetupError(
        {kDevice, "check the configuration", "values in range", "values out of range", problems});

  library.require({"dhdGetSystemType", "dhdClose", "dhdGetStatus", "dhdEnableForce", "dhdStop", "dhdSetForce",
                   "dhdSetMaxForce", "dhdSetGravityCompensation"});
  if (!library.has("dhdGetPositionAndOrientationFrame"))
    library.require({"dhdGetPosition", "dhdGetOrientationFrame"});

  const SdkFunctions& f = library.functions();
  int id = -1;
  std::string wanted;
  if (config.serial) {
    library.require({"dhdOpenSerial"});
    wanted = "serial " + std::to_string(*config.serial);
    id = f.open_serial(*config.serial);
  } else if (config.index) {
    library.require({"dhdOpenID"});
    wanted = "device " + std::to_string(*config.index);
    id = f.open_id(static_cast<char>(*config.index));
  } else {
    library.require({"dhdOpenType"});
    wanted = "the first omega.6";
    for (const int type : {kOmega6Right, kOmega6Left}) {
      if (sdk_failed(id)) id = f.open_type(type);
    }
  }
  if (!std::in_range<signed char>(id) || sdk_failed(id)) throw not_opened(f, wanted);
  if (libdrd_has_it(f)) hand_to_libdrd(f, static_cast<char>(id));
  return static_cast<char>(id);
}

void close_force_dimension(const SdkFunctions& f, char id) noexcept {
  libdrd_has_it(f) ? f.drd_close(id) : f.close(id);
}

ForceDimensionInfo prepare_force_dimension(const ForceDimensionLibrary& library, char id,
                                           const ForceDimensionConfig& config) {
  return Preparation(library, id, config).run();
}

}  // namespace drivers::haptic
