/// @file
/// The last cycles, kept in memory for the report after a fault.
#pragma once
#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

#include "hal/setup_error.h"
#include "runtime/program/build_info.h"
#include "runtime/recording/record_rows.h"
#include "runtime/recording/recording_file.h"

namespace runtime {

/// Cycle: add(). Call the others after the loop has ended.
template <typename Record>
class FlightRecorder {
 public:
  explicit FlightRecorder(std::size_t cycles) : ring_(cycles) {}

  void add(const Record& record) noexcept {
    ring_[next_] = record;
    next_ = (next_ + 1) % ring_.size();
    if (kept_ < ring_.size()) ++kept_;
  }
  std::size_t size() const noexcept { return kept_; }

  /// Oldest first, with the columns of the record; `started`: when the run was made. @throws hal::SetupError
  /// naming path and cause, also if the file is incomplete.
  void write(const std::filesystem::path& path, const std::string& rig, const RecordingFile::Comment& started,
             const std::string& reason) const {
    RecordingFile file(path,
                       {{"rig", rig},
                        {"experiment", "fault report"},
                        {"reason", reason},
                        started,
                        {"software", build_version()}},
                       columns_of(Record{}));
    const std::size_t oldest = (next_ + ring_.size() - kept_) % ring_.size();
    for (std::size_t i = 0; i < kept_; ++i) append_record(file, ring_[(oldest + i) % ring_.size()]);
    file.close();
    if (const std::string problem = file.error(); !problem.empty())
      throw hal::SetupError(path.string(), "write the last cycles", problem);
  }

 private:
  std::vector<Record> ring_;
  std::size_t next_ = 0;
  std::size_t kept_ = 0;
};

}  // namespace runtime
