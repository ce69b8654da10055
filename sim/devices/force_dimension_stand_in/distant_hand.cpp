#include "sim/devices/force_dimension_stand_in/distant_hand.h"

#include <fcntl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <cstddef>
#include <cstdio>
#include <cstdlib>

namespace sim::devices {

DistantHandLink::DistantHandLink() {
  const char* const path = std::getenv(kDistantHandVariable);
  if (path == nullptr) return;
  const int file = ::open(path, O_RDONLY | O_CLOEXEC);
  void* const mapped =
      file < 0 ? MAP_FAILED : ::mmap(nullptr, sizeof(DistantHand), PROT_READ, MAP_SHARED, file, 0);
  if (mapped == MAP_FAILED) {
    std::perror(path);
    std::abort();
  }
  ::close(file);
  hand_ = static_cast<const DistantHand*>(mapped);
}

double DistantHandLink::take(ForceDimensionScript& script) {
  if (hand_ == nullptr) return 0.0;
  // The device moves in steps of 50 us; a call is shorter.
  constexpr double kMin_s = 250e-6;
  constexpr double kMax_s = 5e-3;
  const auto now = std::chrono::steady_clock::now();
  const double passed_s = std::chrono::duration<double>(now - updated_).count();
  if (passed_s < kMin_s) return 0.0;
  updated_ = now;
  script.hand_holds = true;
  script.hand_stiffness_N_per_m = 3000.0;
  script.hand_damping_N_s_per_m = 80.0;
  for (std::size_t i = 0; i < 3; ++i) script.hand_m[i] = hand_->p_HD_m[i].load(std::memory_order_relaxed);
  script.buttons = hand_->buttons.load(std::memory_order_relaxed);
  return std::min(passed_s, kMax_s);
}

}  // namespace sim::devices
