/// @file
/// Checks whether a recording is true.
#pragma once
#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "tests/faults/world.h"

namespace faults {

/// Counters and commands of the boards, period by period, and starts of runs: stored beside the daemon.
class TrueMotion {
 public:
  static constexpr std::size_t kJoints = 9;

  void add(World& world);
  void run_granted() { first_cycles_.push_back(nanoseconds{-1}); }
  void cycle_begins(nanoseconds now) {
    if (!first_cycles_.empty() && first_cycles_.back().count() < 0) first_cycles_.back() = now;
  }
  std::size_t runs() const noexcept { return first_cycles_.size(); }

  /// Errors in the recordings below `folder`, empty if there are none: torn rows, time that does not increase
  /// and a negative tank; and, if no sample was falsified (`samples_are_true`), values that the joints did
  /// not have within two periods of the row's time: positions of the wheels to 0.2 mrad, torques to 1 mA of
  /// the motor, if commanded as such. A command is sent in the next cycle, which may be late: it has until
  /// the next row.
  std::vector<std::string> compare(const std::filesystem::path& folder, bool samples_are_true) const;

 private:
  enum class Quantity : std::uint8_t { kTank, kArmMode, kPosition, kCommand, kMeasured };
  struct Column {
    std::string_view name;
    std::size_t index = 0;
    Quantity quantity{};
    std::size_t joint = 0;
  };
  struct Moment {
    nanoseconds at{};
    std::array<double, kJoints> position_rad{};
    std::array<bool, kJoints> in_torque_mode{};
    std::array<double, kJoints> command_Nm{};  // zero in other modes
    std::array<double, kJoints> measured_Nm{};
  };
  /// The moments within two periods of one.
  using Window = std::span<const Moment>;
  /// A file that is being read.
  struct Reading {
    std::vector<Column> columns;
    Window begin;
    bool samples_are_true = false;
    bool arm_in_torque_mode = false;
    Window last{};  // of the row before
    bool arm_was_in_torque_mode = false;
    std::array<double, kJoints> commands{};  // of the row before
    std::array<std::optional<double>, kJoints> first_rad{};
    std::array<bool, kJoints> obeyed{};
    std::array<bool, kJoints> unsent{};  // the row before
  };

  static std::vector<Column> columns_of(std::string_view header);
  Window around(nanoseconds time) const;
  static bool ends_torque_mode(Window window, std::size_t joint);
  bool is_true(const Column& column, double value, Reading& reading, Window now) const;
  void compare_file(const std::filesystem::path& file, nanoseconds first_cycle, bool samples_are_true,
                    std::vector<std::string>& problems) const;

  std::array<double, kJoints> milliampere_Nm_{};  // of each motor
  std::vector<Moment> moments_;
  std::vector<nanoseconds> first_cycles_;  // of each granted run; negative: none yet
};

}  // namespace faults
