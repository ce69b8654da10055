/// @file
/// Whether what was recorded is what happened.
#pragma once
#include <array>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "tests/faults/world.h"

namespace faults {

/// What the boards counted, period by period, and when runs began: kept beside the daemon.
class TrueMotion {
 public:
  void add(World& world);
  void run_granted() { first_cycles_.push_back(nanoseconds{-1}); }
  void cycle_begins(nanoseconds now) {
    if (!first_cycles_.empty() && first_cycles_.back().count() < 0) first_cycles_.back() = now;
  }
  std::size_t runs() const noexcept { return first_cycles_.size(); }

  /// What is wrong with the recordings below `folder`, empty when nothing is: torn rows and time that does
  /// not go on; and, where no sample was spoiled on its way (`samples_are_true`), positions that the joints
  /// did not have within two periods of the row's time.
  std::vector<std::string> compare(const std::filesystem::path& folder, bool samples_are_true) const;

 private:
  struct Moment {
    nanoseconds at{};
    std::array<double, 9> position_rad{};
  };
  void compare_file(const std::filesystem::path& file, nanoseconds first_cycle, bool samples_are_true,
                    std::vector<std::string>& problems) const;
  bool was_at(std::size_t joint, nanoseconds time, double from_start_rad, nanoseconds start) const;
  std::size_t index_of(nanoseconds time) const;

  std::vector<Moment> moments_;
  std::vector<nanoseconds> first_cycles_;  // of each granted run; negative: none yet
};

}  // namespace faults
