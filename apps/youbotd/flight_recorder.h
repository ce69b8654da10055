/// @file
/// The last second of cycles, kept in memory for the report after a fault.
#pragma once
#include <cstddef>
#include <filesystem>
#include <vector>

#include "apps/youbotd/cycle_record.h"

namespace youbotd {

/// Cycle: add(). The rest after the loop has ended.
class FlightRecorder {
 public:
  explicit FlightRecorder(std::size_t cycles) : ring_(cycles) {}

  void add(const CycleRecord& record) noexcept {
    ring_[next_] = record;
    next_ = (next_ + 1) % ring_.size();
    if (kept_ < ring_.size()) ++kept_;
  }
  std::size_t size() const noexcept { return kept_; }

  /// Oldest first, all that a record holds. @throws hal::SetupError naming path and cause, also when not all
  /// of it got there.
  void write(const std::filesystem::path& path, const std::string& reason) const;

 private:
  std::vector<CycleRecord> ring_;
  std::size_t next_ = 0;
  std::size_t kept_ = 0;
};

}  // namespace youbotd
