/// @file
/// Judges the daemon by the commands that the boards follow and by the mechanics; of the daemon's own reports
/// it only uses whether a run is under way.
#pragma once
#include <array>
#include <chrono>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "tests/faults/recording_check.h"
#include "tests/faults/script.h"
#include "tests/faults/world.h"
#include "tests/support/robot_watch.h"

namespace faults {

/// The rules, each checked every millisecond:
/// - Those of every watched robot (tests/support/robot_watch.h), between a granted enable and the end of its
///   run, with the torques that the configuration allows.
/// - After a client's stop or the loss of the commanding client, the last torque comes within the time for
///   this; after the loss of the frames, within the boards' watchdog time.
/// - No wheel or arm joint and no base is faster than its limit.
/// - The recording is true.
/// - The force on the hand is finite, within the device's limit, and zero without a run.
/// The numbers are stated here independently, from data sheets and the daemon's configuration in the world.
class Checker final : public Witness {
 public:
  explicit Checker(World& world);
  ~Checker() override { world_.be_watched_by(nullptr); }

  void period_passed() override;
  void cycle_begins() override { motion_.cycle_begins(world_.now()); }
  void enable_granted() override;
  void object(const std::string& what) override { violate(what); }
  void nothing_runs() override;
  void began(const Event& event);
  void ended(const Event& event);

  const std::vector<std::string>& violations() const noexcept { return watch_.violations(); }
  void violate(const std::string& what) { watch_.violate(what); }
  /// Hash over boards and mechanics: equal in every run of a script.
  std::uint64_t digest() const noexcept { return digest_; }
  /// From the start of the first event to the last commanded torque of the run that it hit; empty while it
  /// lasts.
  std::optional<std::chrono::milliseconds> last_torque_after() const;
  /// Of the base, from the first event on.
  double travel_m() const noexcept { return travel_m_; }
  /// After the daemon's end: checks that its recordings are true. `events` are those of the script.
  void check_recordings(const std::vector<Event>& events);

 private:
  struct Deadline {
    nanoseconds began{};
    nanoseconds at{};
    const Event* event = nullptr;
    bool lasts = false;  // the event does, at least until then
    std::chrono::milliseconds allowed{};
    bool met = false;  // torque was zero once
  };

  void look_at_boards();
  void check_speeds();
  void check_hand();
  void check_deadlines();
  void mix(std::uint64_t value) noexcept;

  World& world_;
  support::RobotWatch watch_;
  std::uint64_t digest_ = 14695981039346656037U;  // FNV-1a
  std::vector<support::FollowedDrive> drives_;
  std::vector<Deadline> deadlines_;
  int active_events_ = 0;
  nanoseconds last_change_{};  // of them
  TrueMotion motion_;
  nanoseconds permitted_until_{};  // end of the permission: the hand may still feel a force
  bool works_ = false;
  std::optional<nanoseconds> first_event_;
  nanoseconds last_torque_{};
  bool met_run_is_over_ = false;
  control::PlanarPose first_pose_;
  double travel_m_ = 0.0;
};

}  // namespace faults
