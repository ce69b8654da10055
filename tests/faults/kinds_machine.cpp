#include <filesystem>
#include <fstream>

#include "tests/faults/kinds.h"
#include "tests/faults/wall_clock.h"

namespace faults {
namespace {

using namespace std::chrono_literals;

void push_base(World& world, const control::PlanarVector& wrench_B) {
  world.emulation().base().push(wrench_B);
}

void remove_recordings(const World& world) {
  std::error_code ignored;
  std::filesystem::remove_all(world.folder() / "runs", ignored);
}

}  // namespace

std::vector<Kind> machine_kinds() {
  return {
      {.name = "base-pushed",
       .on = Kind::On::kBase,
       .longest = 1500ms,
       .begin =
           [](World& world, const Event& event) {
             push_base(world, {40 * event.size - 20, 30 * event.size - 15, 4});
           },
       .end = [](World& world, const Event&) { push_base(world, control::PlanarVector::Zero()); }},
      {.name = "base-held",
       .on = Kind::On::kBase,
       .longest = 2000ms,
       .strikes = "mechanics",
       .begin =
           [](World& world, const Event&) {
             world.each_period = [&world] {
               world.emulation().base().set_twist(control::PlanarVector::Zero());
             };
           },
       .end = [](World& world, const Event&) { world.each_period = nullptr; }},
      {.name = "wheel-blocked",
       .where = Kind::Where::kJoint,
       .on = Kind::On::kBase,
       .longest = 2000ms,
       .strikes = "mechanics",
       .begin =
           [](World& world, const Event& event) {
             world.each_period = [&world, wheel = static_cast<int>(event.place)] {
               world.emulation().base().wheel(wheel).set_velocity(0);
             };
           },
       .end = [](World& world, const Event&) { world.each_period = nullptr; }},
      {.name = "base-lifted",
       .longest = 2000ms,
       .begin = [](World& world, const Event&) { world.emulation().set_on_ground(false); },
       .end = [](World& world, const Event&) { world.emulation().set_on_ground(true); }},
      {.name = "tip-pushed",
       .on = Kind::On::kManipulator,
       .longest = 1500ms,
       .begin =
           [](World& world, const Event& event) {
             world.emulation().manipulator()->push_tip({20 * event.size - 10, 10 * event.size - 5, -8});
           },
       .end = [](World& world,
                 const Event&) { world.emulation().manipulator()->push_tip(Eigen::Vector3d::Zero()); }},
      {.name = "loop-held-up",
       .longest = 1500ms,
       .last_torque_after = kLoss,
       .strikes = "threads",
       .begin = [](World& world,
                   const Event& event) { world.loop_paused_until = world.now() + event.duration; }},
      {.name = "loop-jitters",
       .strikes = "threads",
       .begin =
           [](World& world, const Event& event) {
             world.loop_paused_until =
                 world.now() + std::chrono::microseconds(static_cast<long>(1500 + 10000 * event.size));
           }},
      {.name = "service-thread-held-up",
       .longest = 2500ms,
       .strikes = "threads",
       .begin = [](World& world,
                   const Event& event) { world.beats_paused_until = world.now() + event.duration; }},
      {.name = "everything-held-up",
       .longest = 2500ms,
       .last_torque_after = kLoss,
       .strikes = "threads",
       .begin =
           [](World& world, const Event& event) {
             world.loop_paused_until = world.beats_paused_until = world.now() + event.duration;
           }},
      {.name = "everything-held-up-while-orders-wait",
       .longest = 2500ms,
       .last_torque_after = kLoss,
       .strikes = "threads",
       .begin =
           [](World& world, const Event& event) {
             world.loop_paused_until = world.beats_paused_until = world.now() + event.duration;
             for (const char* order : {"acknowledge", "enable", "status", "acknowledge", "enable"})
               world.leave(1, order);
           }},
      {.name = "wall-clock-jumps",
       .begin = [](World&,
                   const Event& event) { jump_wall_clock(std::chrono::hours(24) * (2 * event.size - 1)); }},
      {.name = "daemon-killed",
       .longest = 1500ms,
       .last_torque_after = kLoss,
       .strikes = "process",
       .begin =
           [](World& world, const Event&) {
             world.daemon_held_down = true;
             world.kill_daemon();
           },
       .end = [](World& world, const Event&) { world.daemon_held_down = false; }},
      {.name = "daemon-killed-and-restarted",
       .strikes = "process",
       .begin =
           [](World& world, const Event&) {
             world.kill_daemon();
             world.start_daemon();
           }},
      {.name = "daemon-ended",
       .last_torque_after = kStop,
       .lowering = kLowering,
       .strikes = "process",
       .begin = [](World& world, const Event&) { world.end_daemon(); }},
      {.name = "files-cannot-grow",
       .longest = 3000ms,
       .spoils_recordings = true,
       .begin =
           [](World& world, const Event& event) {
             world.limit_files(static_cast<std::uint64_t>(1 + 4e4 * event.size));
           },
       .end = [](World& world, const Event&) { world.restore_files(); }},
      {.name = "recordings-removed",
       .strikes = "recordings",
       .spoils_recordings = true,
       .begin = [](World& world, const Event&) { remove_recordings(world); }},
      {.name = "recordings-in-the-way",
       .longest = 3000ms,
       .strikes = "recordings",
       .spoils_recordings = true,
       .begin =
           [](World& world, const Event&) {
             remove_recordings(world);
             std::ofstream(world.folder() / "runs") << "a file where a folder should be";
           },
       .end = [](World& world, const Event&) { remove_recordings(world); }},
      {.name = "configuration-torn",
       .longest = 2000ms,
       .begin =
           [](World& world, const Event& event) {
             const std::filesystem::path file = world.folder() / "youbotd.toml";
             std::filesystem::rename(file, world.folder() / "whole.toml");
             std::ofstream(file) << "[limits]\nforce_N = " << (event.size < 0.5 ? "" : "nan");
           },
       .end =
           [](World& world, const Event&) {
             std::error_code ignored;
             std::filesystem::rename(world.folder() / "whole.toml", world.folder() / "youbotd.toml", ignored);
           }},
  };
}

}  // namespace faults
