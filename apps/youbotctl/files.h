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
int recover(const std::filesystem::path& in, const std::filesystem::path& out, bool quiet);

}  // namespace youbotctl
