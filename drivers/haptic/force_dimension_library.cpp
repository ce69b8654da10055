#include "drivers/haptic/force_dimension_library.h"

#include <dlfcn.h>
#include <sys/utsname.h>

#include <algorithm>
#include <charconv>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <system_error>
#include <utility>

#include "drivers/setup_error.h"

namespace drivers::haptic {
namespace {

namespace fs = std::filesystem;

constexpr const char* kLibrary = "Force Dimension SDK";
constexpr const char* kRemedy =
    "get the SDK (version 3, Linux) from forcedimension.com, unpack it and set FDSDK to its folder, the one "
    "that holds lib/release; or name the libdrd file. If it is there and does not load, libusb-1.0 is what "
    "is "
    "usually missing: sudo apt install libusb-1.0-0";

struct CloseLibrary {
  void operator()(void* library) const noexcept { ::dlclose(library); }
};
using LoadedLibrary = std::unique_ptr<void, CloseLibrary>;

fs::path library_folder(const std::string& sdk_folder) {
  utsname system{};
  const bool known = ::uname(&system) == 0;
  return fs::path(sdk_folder) / "lib" / "release" /
         ("lin-" + std::string(known ? system.machine : "x86_64") + "-gcc");
}

/// Empty when it is not numbers between dots: "3.17.5" is {3, 17, 5}, a backup's "3.17.5~" is nothing.
std::vector<int> numbers_of(std::string_view version) {
  std::vector<int> numbers;
  const char* at = version.data();
  const char* const end = at + version.size();
  while (true) {
    int number = 0;
    const auto [after, error] = std::from_chars(at, end, number);
    if (error != std::errc{} || number < 0) return {};
    numbers.push_back(number);
    if (after == end) return numbers;
    if (*after != '.') return {};
    at = after + 1;
  }
}

std::vector<std::string> newest_first(const fs::path& folder) {
  constexpr std::string_view kStem = "libdrd.so.";
  std::vector<std::pair<std::vector<int>, std::string>> found;
  std::error_code error;  // no folder: nothing found
  for (fs::directory_iterator entry(folder, error), end; !error && entry != end; entry.increment(error)) {
    const std::string name = entry->path().filename().string();
    if (!name.starts_with(kStem)) continue;
    std::vector<int> numbers = numbers_of(std::string_view(name).substr(kStem.size()));
    if (!numbers.empty()) found.emplace_back(std::move(numbers), entry->path().string());
  }
  std::sort(found.rbegin(), found.rend());
  std::vector<std::string> paths;
  paths.reserve(found.size());
  for (auto& [numbers, path] : found) paths.push_back(std::move(path));
  return paths;
}

template <typename Function>
bool find(void* library, const char* symbol, Function*& function) {
  function = reinterpret_cast<Function*>(::dlsym(library, symbol));
  return function != nullptr;
}

std::vector<MissingSymbol> resolve(void* library, SdkFunctions& f) {
  std::vector<MissingSymbol> missing;
  const auto look_up = [&](auto*& function, const char* symbol, const char* feature) {
    if (!find(library, symbol, function)) missing.push_back({symbol, feature});
  };
  look_up(f.get_sdk_version, "dhdGetSDKVersion", "telling the SDK's version");
  look_up(f.error_get_last, "dhdErrorGetLast", "telling why a call failed");
  look_up(f.get_device_count, "dhdGetDeviceCount", "counting devices");
  look_up(f.get_available_count, "dhdGetAvailableCount", "telling which devices are held by others");
  look_up(f.get_system_type, "dhdGetSystemType", "telling the type of a device");
  look_up(f.get_serial_number, "dhdGetSerialNumber", "telling the serial number");
  look_up(f.get_version, "dhdGetVersion", "telling the firmware's version");
  look_up(f.open_id, "dhdOpenID", "opening a device by its number");
  look_up(f.open_type, "dhdOpenType", "opening the first omega.6");
  look_up(f.open_serial, "dhdOpenSerial", "opening a device by its serial number");
  look_up(f.close, "dhdClose", "closing a device");
  look_up(f.get_status, "dhdGetStatus", "seeing that the force went off");
  look_up(f.get_button_mask, "dhdGetButtonMask", "reading all buttons at once");
  look_up(f.get_button, "dhdGetButton", "reading one button");
  look_up(f.get_position, "dhdGetPosition", "reading the position alone");
  look_up(f.get_orientation_frame, "dhdGetOrientationFrame", "reading the orientation alone");
  look_up(f.get_position_and_orientation_frame, "dhdGetPositionAndOrientationFrame",
          "reading the pose in one call");
  look_up(f.enable_force, "dhdEnableForce", "switching the force on and off");
  look_up(f.stop, "dhdStop", "stopping the device");
  look_up(f.set_force, "dhdSetForce", "rendering force");
  look_up(f.set_max_force, "dhdSetMaxForce", "limiting the force");
  look_up(f.set_gravity_compensation, "dhdSetGravityCompensation", "holding the handle's weight");
  look_up(f.set_effector_mass, "dhdSetEffectorMass", "setting the handle's mass");
  look_up(f.drd_open_id, "drdOpenID", "handing a device to libdrd");
  look_up(f.drd_close, "drdClose", "closing a device of libdrd");
  look_up(f.drd_is_initialized, "drdIsInitialized", "telling whether the device is calibrated");
  look_up(f.drd_auto_init, "drdAutoInit", "calibrating by moving the handle");
  look_up(f.drd_stop, "drdStop", "taking over after calibration");
  look_up(f.enable_expert_mode, "dhdEnableExpertMode", "setting the watchdog or the time guard");
  look_up(f.disable_expert_mode, "dhdDisableExpertMode", "leaving expert mode");
  look_up(f.set_watchdog, "dhdSetWatchdog", "setting the watchdog");
  look_up(f.get_watchdog, "dhdGetWatchdog", "checking the watchdog");
  look_up(f.get_velocity_threshold, "dhdGetVelocityThreshold", "checking the velocity threshold");
  look_up(f.set_time_guard, "dhdSetTimeGuard", "setting the time guard");
  return missing;
}

}  // namespace

std::string to_string(const SdkVersion& version) {
  return std::to_string(version.major) + "." + std::to_string(version.minor) + "." +
         std::to_string(version.release) + "." + std::to_string(version.revision);
}

SdkSearch sdk_search_from_environment(std::string file) {
  const char* folder = std::getenv("FDSDK");
  return {std::move(file), folder != nullptr ? folder : ""};
}

std::vector<std::string> sdk_candidates(const SdkSearch& search) {
  if (!search.file.empty()) return {search.file};
  std::vector<std::string> candidates;
  if (!search.sdk_folder.empty()) candidates = newest_first(library_folder(search.sdk_folder));
  candidates.insert(candidates.end(), {"libdrd.so.3", "libdrd.so"});
  return candidates;
}

ForceDimensionLibrary::ForceDimensionLibrary(const SdkSearch& search) {
  std::string refusals;
  const auto refuse = [&refusals](const std::string& why) {
    refusals += (refusals.empty() ? "" : "; ") + why;
  };
  const std::vector<std::string> candidates = sdk_candidates(search);
  if (search.file.empty() && !search.sdk_folder.empty() && candidates.front() == "libdrd.so.3")
    refuse("no libdrd.so.<version> in " + library_folder(search.sdk_folder).string());

  for (const std::string& candidate : candidates) {
    LoadedLibrary library(::dlopen(candidate.c_str(), RTLD_NOW | RTLD_LOCAL));
    if (!library) {
      const char* why = ::dlerror();
      refuse(candidate + " does not load (" + (why != nullptr ? why : "no reason given") + ")");
      continue;
    }
    if (!find(library.get(), "dhdGetSDKVersion", functions_.get_sdk_version)) {
      refuse(candidate + " has no dhdGetSDKVersion and is not this SDK");
      continue;
    }
    functions_.get_sdk_version(&version_.major, &version_.minor, &version_.release, &version_.revision);
    if (version_.major != kNeededSdkMajor) {
      refuse(candidate + " is version " + to_string(version_) + ", needed is " +
             std::to_string(kNeededSdkMajor));
      continue;
    }
    path_ = candidate;
    missing_ = resolve(library.get(), functions_);
    static_cast<void>(library.release());  // stays loaded, see the class
    return;
  }
  throw SetupError({kLibrary, "load the library", "a libdrd.so of version " + std::to_string(kNeededSdkMajor),
                    refusals, kRemedy});
}

bool ForceDimensionLibrary::has(std::string_view symbol) const noexcept {
  return std::none_of(missing_.begin(), missing_.end(),
                      [symbol](const MissingSymbol& missing) { return missing.symbol == symbol; });
}

void ForceDimensionLibrary::require(std::initializer_list<std::string_view> symbols) const {
  std::string found;
  for (const MissingSymbol& missing : missing_) {
    if (std::find(symbols.begin(), symbols.end(), missing.symbol) == symbols.end()) continue;
    found += (found.empty() ? "without " : ", ") + std::string(missing.symbol) + " (" + missing.feature + ")";
  }
  if (found.empty()) return;
  throw SetupError({kLibrary, "look up functions in " + path_, "all that this needs",
                    "version " + to_string(version_) + " " + found,
                    "install a newer SDK of version " + std::to_string(kNeededSdkMajor) + "; " + kRemedy});
}

}  // namespace drivers::haptic
