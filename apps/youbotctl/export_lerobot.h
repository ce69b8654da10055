/// @file
/// Datasets in the format of LeRobot, version 3.0, for learning from demonstrations.
#pragma once
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "apps/youbotctl/export_frames.h"

namespace youbotctl {

inline constexpr std::uint64_t kDataFile_MB = 100;  ///< LeRobot's default

struct LerobotOptions {
  FrameOptions frames;
  std::string task = "teleoperation";  ///< what the operator did, in words
  /// A file of frames ends with the episode that exceeds this size.
  std::uint64_t data_file_bytes = kDataFile_MB << 20;
};

/// Writes data/chunk-000/file-000.parquet, …, meta/episodes/chunk-000/file-000.parquet, meta/tasks.parquet,
/// meta/stats.json and, when they are complete, meta/info.json, without which LeRobot reads none of them. The
/// layout is that of LeRobot's own writer, field by field (src/lerobot/datasets/ at its commit 7427f318).
/// @throws std::invalid_argument if `out` has files or the task is no text; hal::SetupError if it cannot be
/// written. Nothing is left behind then.
void write_lerobot(const Demonstrations& demonstrations, const std::filesystem::path& out,
                   const LerobotOptions& options);

/// The command. @throws as above and read_demonstrations().
int export_lerobot(const std::vector<std::filesystem::path>& recordings, const std::filesystem::path& out,
                   const LerobotOptions& options, bool quiet);

}  // namespace youbotctl
