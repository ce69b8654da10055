/// @file
/// Finds and loads the Force Dimension SDK at run time, so that nothing needs it to build or to start.
///
/// Only libdrd is loaded: it holds the functions of libdhd too, and both at once might keep two device
/// tables. Everything here is set-up: it blocks, allocates and throws.
#pragma once
#include <initializer_list>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "drivers/haptic/force_dimension_sdk.h"

namespace drivers::haptic {

struct SdkVersion {
  int major = 0;
  int minor = 0;
  int release = 0;
  int revision = 0;
};
std::string to_string(const SdkVersion& version);  ///< "3.17.5.0"
inline constexpr int kNeededSdkMajor = 3;

/// Where to look. If a file is named, nothing else is tried.
struct SdkSearch {
  std::string file;        ///< empty: search
  std::string sdk_folder;  ///< with `lib/release/lin-MACHINE-gcc/libdrd.so.VERSION`, newest first
};
/// `file` and what $FDSDK says.
SdkSearch sdk_search_from_environment(std::string file = {});
/// What is handed to the dynamic loader, in this order: a named file, or the SDK folder's libraries, highest
/// version first and counted as numbers (3.17 is after 3.9), then libdrd.so.3 and libdrd.so.
std::vector<std::string> sdk_candidates(const SdkSearch& search);

struct MissingSymbol {
  const char* symbol;   ///< "dhdSetWatchdog"
  const char* feature;  ///< what cannot be done without it: "setting the watchdog"
};

/// The first candidate that loads and has the right version. The SDK stays loaded until the process ends,
/// because nobody promises that its threads end with the last device.
class ForceDimensionLibrary {
 public:
  /// @throws SetupError saying what was tried, why each was refused, and where to get the SDK.
  explicit ForceDimensionLibrary(const SdkSearch& search);

  const SdkFunctions& functions() const noexcept { return functions_; }
  const SdkVersion& version() const noexcept { return version_; }
  /// The candidate as it was loaded.
  const std::string& path() const noexcept { return path_; }
  /// Of all that SdkFunctions lists.
  std::span<const MissingSymbol> missing() const noexcept { return missing_; }
  bool has(std::string_view symbol) const noexcept;
  /// @throws SetupError naming those of `symbols` that are missing and their features.
  void require(std::initializer_list<std::string_view> symbols) const;

 private:
  SdkFunctions functions_;
  SdkVersion version_;
  std::string path_;
  std::vector<MissingSymbol> missing_;
};

}  // namespace drivers::haptic
