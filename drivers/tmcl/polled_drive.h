/// @file
/// A drive without process data: its commands and measurements travel as axis parameters.
#pragma once
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "drivers/tmcl/process_data.h"
#include "drivers/tmcl/request_batch.h"

namespace drivers::tmcl {

struct PolledDriveOptions {
  std::uint8_t motor = 0;
  int requests_per_cycle = 3;  ///< 1 to 5
  int patience_cycles = 3;     ///< for the answers of a cycle's requests; see RequestBatch
  /// User variable (bank 2) that tells a restart: it holds kMemoryMark until the module loses its memory.
  std::uint8_t mark_variable = 55;
};

/// What a cycle reads.
enum class DriveReading : std::uint8_t { kPosition, kCurrent, kVelocity, kStatus, kMark };

/// Each cycle sends the command and, in turn, as many reads as are left:
///
///   requests     reads, cycle after cycle                      position  current  velocity  status, mark
///   1            as 2, command and read in turn                4         8        16        32
///   2            P C P V P C P S P C P V P C P M               2         4        8         16
///   3            PC PV PC PS PC PV PC PM                       1         2        4         8
///   4            PCV PCS PCV PCM                               1         1        2         4
///   5            PCVS PCVM                                     1         1        1         2
///
/// The figures are the cycles between two readings; a value is known one cycle after it was asked for. A
/// command is renewed each cycle, with one request every other. While the answers of a cycle are late nothing
/// new is sent.
/// Cycle: all of it. One thread.
class PolledDrive {
 public:
  static constexpr int kMaxRequests = 5;
  static constexpr std::int32_t kMemoryMark = 0x59B0'7ADE;
  static constexpr int cycles_between_positions(int requests_per_cycle) noexcept {
    return requests_per_cycle == 1 ? 4 : requests_per_cycle == 2 ? 2 : 1;
  }

  /// `transport` outlives the drive; nobody else uses it meanwhile.
  PolledDrive(Transport& transport, const PolledDriveOptions& options) noexcept;

  /// First. True when a cycle's requests have been answered.
  bool receive() noexcept;
  /// Then, as `output` is to be: sends this cycle's requests, unless the last ones are still unanswered.
  void send(const DriveOutput& output, std::chrono::nanoseconds now) noexcept;
  /// Motor stop, at once, whatever is on its way.
  void stop() noexcept;

  /// In the place of a reading, as soon as there is room; repeated while it goes unanswered.
  void ask(const Request& request) noexcept { asked_ = request; }
  void forget_ask() noexcept { asked_.reset(); }
  /// Of the last receive(): what came of it.
  const std::optional<Completion>& answer() const noexcept { return answer_; }

  /// The latest of every reading. Set it from elsewhere before the first cycle.
  DriveInput& input() noexcept { return input_; }
  const DriveInput& input() const noexcept { return input_; }
  /// The last receive() brought a position; and when that was asked for.
  bool position_is_fresh() const noexcept { return fresh_; }
  std::chrono::nanoseconds stamp() const noexcept { return stamp_; }
  /// How long before that receive() it had come, at least.
  std::chrono::nanoseconds position_age() const noexcept { return position_age_; }

  /// A command or reading of the last receive() was refused.
  const std::optional<Completion>& refusal() const noexcept { return refusal_; }
  /// The last receive() has shown that the module lost its memory. It is marked anew by itself.
  bool has_restarted() const noexcept { return restarted_; }

 private:
  void take_in(const Completion& done) noexcept;
  void post(const Request& request) noexcept;
  Request next_read() noexcept;

  Transport& transport_;
  PolledDriveOptions options_;
  RequestBatch batch_;
  std::span<const DriveReading> turns_;
  std::size_t turn_ = 0;
  bool command_turn_ = true;  // with one request a cycle
  bool check_mark_ = false;   // answers were lost: who knows why
  bool marked_ = true;
  std::uint64_t lost_seen_ = 0;
  std::optional<DriveOutput> last_sent_;
  std::optional<Request> asked_;
  std::chrono::nanoseconds asked_at_{};

  DriveInput input_;
  std::optional<Completion> answer_;
  std::optional<Completion> refusal_;
  std::chrono::nanoseconds stamp_{};
  std::chrono::nanoseconds position_age_{};
  bool fresh_ = false;
  bool restarted_ = false;
};

/// The request that stands for a mode of the process data; none for kNoMoreAction.
std::optional<Request> request_for(const DriveOutput& output, std::uint8_t motor) noexcept;

}  // namespace drivers::tmcl
