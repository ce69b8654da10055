/// @file
/// Inputs of youbot-gap: a model and recordings of one drive.
#pragma once
#include <filesystem>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "identification/gap/gap.h"
#include "model/effects/drive_model.h"

namespace analysis {

struct InputPaths {
  std::filesystem::path model{};
  std::vector<std::filesystem::path> data{};      ///< recordings, or directories of them
  std::vector<std::filesystem::path> held_out{};  ///< the same; may be empty
  std::string joint{};                            ///< of MCAP files with several
  std::filesystem::path columns{};                ///< column map of tables of other programs; empty: none
};

/// Recordings of a search, and those that only judge.
struct RecordingFiles {
  std::vector<std::filesystem::path> data;
  std::vector<std::filesystem::path> held_out;
  std::vector<std::string> names;  ///< of `data`, then of `held_out`: the shortest that differ
};
/// For directories all recordings in them, as in read_inputs().
/// @throws std::invalid_argument for files that are given twice, and directories without recordings.
RecordingFiles recording_files(const std::vector<std::filesystem::path>& data,
                               const std::vector<std::filesystem::path>& held_out);

struct Inputs {
  model::effects::DriveModel model;
  std::string rig;  ///< of the recordings, empty if none names it
  std::vector<identification::gap::Source> data;
  std::vector<identification::gap::Source> held_out;
  std::vector<std::string> warnings;
};

/// For a directory all recordings in it, by name, without its subdirectories; of one without recordings, all
/// logs of bam (.json). The sources are named after
/// their files, with as many parent directories as are needed to distinguish them.
/// @throws runtime::ConfigError with all errors in the model and every recording; std::invalid_argument for
/// files that are given twice or do not fit together.
/// `progress`: called with the current file, and NaN, because the duration is unknown.
Inputs read_inputs(const InputPaths& paths,
                   const std::function<void(std::string_view what, double done)>& progress = {});

}  // namespace analysis
