/// @file
/// The demonstrations in a recording of a teleoperation, as frames at a regular rate.
#pragma once
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace youbotctl {

/// What becomes of the rows between two frames.
///
/// A policy that runs on the robot reads its state at an instant and does not know the future. So no value of
/// a frame is later than its time, and none is interpolated: quaternions keep their length, and openings of
/// the gripper are those that were commanded. Poses need no filter, because next to nothing of them is faster
/// than half the frame rate (below 0.1 mm and 0.1 mrad in the demo). Torques and forces have ripple and
/// contacts. Their mean over the frame damps what would alias, has no ripple at multiples of the frame rate,
/// and keeps the impulse: the sum over the frames times their period.
enum class Resampling : std::uint8_t {
  kNewest,  ///< that of the newest row at the time of the frame
  kMean,    ///< the mean of the rows since the frame before; of the first frame, its row alone
};

struct Feature {
  std::string name;
  Resampling resampling = Resampling::kNewest;
  std::vector<std::string> columns;
};
/// What a frame has of a teleoperation. Policies take every feature that begins with `observation` as input.
const std::vector<Feature>& teleoperation_features();
/// Only known with a simulated robot, or a gripper that a button moves; NaN otherwise.
bool may_be_missing(const std::string& column);

struct Episode {
  std::filesystem::path recording;
  double begin_s = 0;  ///< time of the first frame in the recording
  std::size_t frames = 0;
  std::vector<std::vector<float>> values;  ///< of each feature, frame by frame
};

struct Demonstrations {
  std::vector<Episode> episodes;
  std::vector<std::string> warnings;
};

struct FrameOptions {
  int fps = 30;
  bool all_phases = false;  ///< each row; otherwise from the first to the last one of the phase `operating`
};

/// Reads CSV, MCAP, or the one in the directory of a run. Rows that are missing for longer than a frame, or
/// another phase than `let go`, end an episode.
/// @throws runtime::ConfigError naming the file, and what to do, if it is damaged, no teleoperation, slower
/// than `fps` or has no two frames of operation.
Demonstrations read_demonstrations(const std::filesystem::path& path, const FrameOptions& options);

}  // namespace youbotctl
