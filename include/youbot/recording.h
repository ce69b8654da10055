/// @file
/// Recordings: written from a cycle without waiting for the disk, and read back (apps/FILE_FORMATS.md).
///
///     youbot::RecordingFile file("wheel-1.csv", {{"rig", "wheel-1"}}, {{"time_s", 6}, {"position_rad"}});
///     youbot::Recorder<Row> recorder(
///         8192, [&](const Row& row) { file.append_row(row); }, [&] { file.flush(); });
///     recorder.push(row);      // in the cycle: wait-free
///     recorder.stop();
///     file.close();            // file.error() says what was lost
///
///     const youbot::ReadRecording read = youbot::read_recording("wheel-1.csv");
#pragma once
#include "runtime/recording/recorder.h"
#include "runtime/recording/recording_file.h"
#include "runtime/recording/recording_reader.h"

namespace youbot {

using runtime::read_recording;
using runtime::ReadRecording;
using runtime::Recorder;
using runtime::RecordingError;
using runtime::RecordingFile;
using Recording = identification::Recording;

}  // namespace youbot
