/// @file
/// Copies of the stand-in for the vendor's libdrd, each with its own device and virtual time.
#pragma once
#include <dlfcn.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "sim/devices/force_dimension_stand_in.h"
#include "tests/support/built_paths.h"
#include "tests/support/temporary_directory.h"

namespace drivers::haptic {

/// Loaded, so that a test can control it before and after the driver loads the same file.
class StandIn {
 public:
  /// `name`: file name in `folder`. `without`: symbols that cannot be found in this copy, because their names
  /// are changed.
  StandIn(const support::TemporaryDirectory& folder, std::string_view name,
          const std::vector<std::string>& without = {}) {
    std::ifstream original(support::stand_in_library(), std::ios::binary);
    std::string bytes{std::istreambuf_iterator<char>(original), {}};
    for (const std::string& symbol : without) {
      const std::string spelled = '\0' + symbol + '\0';
      std::size_t at = bytes.find(spelled);
      if (at == std::string::npos) throw std::runtime_error("the stand-in has no " + symbol);
      for (; at != std::string::npos; at = bytes.find(spelled, at)) bytes[at + 1] = 'x';
    }
    path_ = folder.write(name, bytes).string();
    library_ = ::dlopen(path_.c_str(), RTLD_NOW | RTLD_LOCAL);
    if (library_ == nullptr) throw std::runtime_error(::dlerror());
    const auto control = reinterpret_cast<sim::devices::StandInControlFunction*>(
        ::dlsym(library_, sim::devices::kStandInControl));
    if (control == nullptr) throw std::runtime_error(path_ + " has no controls");
    control_ = control();
    control_->reset(1);
  }
  StandIn(const StandIn&) = delete;
  StandIn& operator=(const StandIn&) = delete;
  ~StandIn() { ::dlclose(library_); }

  const std::string& path() const { return path_; }
  const sim::devices::ForceDimensionControl& control() const { return *control_; }
  sim::devices::ForceDimensionCalls& calls() const { return *control_->calls(); }
  /// A function that the driver does not look up.
  template <typename Function>
  Function* symbol(const char* name) const {
    return reinterpret_cast<Function*>(::dlsym(library_, name));
  }
  sim::devices::ForceDimensionScript& script(int device = 0) const { return *control_->script(device); }
  const sim::devices::ForceDimensionState& state(int device = 0) const { return *control_->state(device); }

 private:
  std::string path_;
  void* library_ = nullptr;
  const sim::devices::ForceDimensionControl* control_ = nullptr;
};

}  // namespace drivers::haptic
