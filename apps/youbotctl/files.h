/// @file
/// Commands on recordings, without a running youbotd.
#pragma once
#include <filesystem>
#include <string>

namespace youbotctl {

/// Prints what was written unless `quiet`. Both return an exit code.
/// @throws as runtime::mcap::convert() and recover().
int convert(const std::filesystem::path& in, const std::filesystem::path& out, const std::string& joint,
            bool quiet);
/// A table of another program, by its column map, or a log of bam (`.json`), with or without one, as a
/// recording.
/// @throws runtime::RecordingError or ConfigError if they cannot be used; hal::SetupError if `out` exists or
/// cannot be written.
int import_table(const std::filesystem::path& in, const std::filesystem::path& out,
                 const std::filesystem::path& columns, bool quiet);
int recover(const std::filesystem::path& in, const std::filesystem::path& out, bool quiet);

}  // namespace youbotctl
