/// @file
/// Where a command puts its results: made before the work begins, and never over older ones.
#pragma once
#include <filesystem>
#include <string>
#include <vector>

namespace runtime {

/// The directory itself, or the nearest above it that exists.
std::filesystem::path existing_ancestor(const std::filesystem::path& directory);

/// Makes a file there and takes it away again. Empty: it can; else the system's reason.
std::string why_not_writable(const std::filesystem::path& directory);

/// Makes the directory, with those it is in, and sees that files can be made in it. Returns those that were
/// missing, outermost first. @throws hal::SetupError naming path and cause; nothing is left behind then.
std::vector<std::filesystem::path> make_output_directory(const std::filesystem::path& directory);

/// For results that come later: as above, and takes away again what was missing.
/// @throws hal::SetupError as above.
void try_output_directory(const std::filesystem::path& directory);

/// What a result is made of may have taken long: none is ever replaced.
/// @throws std::invalid_argument naming the first of these files that is in the directory.
void require_no_results(const std::filesystem::path& directory, const std::vector<std::string>& files);

/// For a command whose files have many names: @throws std::invalid_argument when anything is in it.
void require_empty(const std::filesystem::path& directory);

}  // namespace runtime
