/// @file
#pragma once
#include "runtime/recording/recording_file.h"

namespace runtime {

/// For the header of a recording that is opened now: "started: 2026-11-26T22:03:08.250Z", in UTC.
RecordingFile::Comment started_now();

}  // namespace runtime
