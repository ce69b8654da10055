/// @file
/// A drive without process data: commands and measurements are axis parameters.
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
  int patience_cycles = 3;     ///< time-out for the answers of a cycle's requests; see RequestBatch
  /// User variable (bank 2) to detect a restart: it holds kMemoryMark until the module loses its memory.
  std::uint8_t mark_variable = 55;
};

/// Values that a cycle reads.
enum class DriveReading : std::uint8_t { kPosition, kCurrent, kVelocity, kStatus, kMark };

/// Each cycle sends the command and, in rotation, as many reads as are left:
///
///   requests     reads, cycle after cycle                      position  current  velocity  status, mark
///   1            as 2, command and read alternating            4         8        16        32
///   2            P C P V P C P S P C P V P C P M               2         4        8         16
///   3            PC PV PC PS PC PV PC PM                       1         2        4         8
///   4            PCV PCS PCV PCM                               1         1        2         4
///   5            PCVS PCVM                                     1         1        1         2
///
/// The figures are the cycles between two readings; a value is available one cycle after its request. The
/// command is sent in each cycle, with one request in every other. While the answers of a cycle are late,
/// nothing new is sent. Cycle: all of it. One thread.
class PolledDrive {
 public:
  static constexpr int kMaxRequests = 5;
  static constexpr std::int32_t kMemoryMark = 0x59B0'7ADE;
  static constexpr int cycles_between_positions(int requests_per_cycle) noexcept {
    return requests_per_cycle == 1 ? 4 : requests_per_cycle == 2 ? 2 : 1;
  }

  /// `transport` must outlive the drive and must not be used by others meanwhile.
  PolledDrive(Transport& transport, const PolledDriveOptions& options) noexcept;

  /// Call first. True once a cycle's requests have been answered.
  bool receive() noexcept;
  /// Call next, with the new `output`: sends this cycle's requests, unless the last ones are still
  /// unanswered.
  void send(const DriveOutput& output, std::chrono::nanoseconds now) noexcept;
  /// Motor stop, immediately, whatever is under way.
  void stop() noexcept;

  /// Sent in place of a reading, with more than two requests per cycle never of the position, and with fewer
  /// than five of current or velocity only; repeated while unanswered.
  void ask(const Request& request) noexcept { asked_ = request; }
  void forget_ask() noexcept { asked_.reset(); }
  /// Its result, from the last receive().
  const std::optional<Completion>& answer() const noexcept { return answer_; }

  /// Latest value of every reading. Set initial values before the first cycle.
  DriveInput& input() noexcept { return input_; }
  const DriveInput& input() const noexcept { return input_; }
  /// True if the last receive() brought a position; stamp() is the time of its request.
  bool position_is_fresh() const noexcept { return fresh_; }
  std::chrono::nanoseconds stamp() const noexcept { return stamp_; }
  /// Minimum age of that position at receive().
  std::chrono::nanoseconds position_age() const noexcept { return position_age_; }

  /// A command or reading that the drive refused, in the last receive().
  const std::optional<Completion>& refusal() const noexcept { return refusal_; }
  /// The last receive() showed that the module lost its memory. The mark is written again automatically.
  bool has_restarted() const noexcept { return restarted_; }

 private:
  void take_in(const Completion& done) noexcept;

  Transport& transport_;
  PolledDriveOptions options_;
  RequestBatch batch_;
  std::span<const DriveReading> turns_;
  std::size_t turn_ = 0;
  bool command_turn_ = true;  // with one request per cycle
  bool check_mark_ = false;   // answers were lost: possibly by a restart
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

/// The request equivalent to a mode of the process data; empty for kNoMoreAction.
std::optional<Request> request_for(const DriveOutput& output, std::uint8_t motor) noexcept;

}  // namespace drivers::tmcl
