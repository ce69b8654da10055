/// @file
/// Directory for a command's results: created before the work begins; older results are never overwritten.
#pragma once
#include <filesystem>
#include <string>
#include <vector>

namespace runtime {

/// The directory itself, or its nearest existing ancestor.
std::filesystem::path existing_ancestor(const std::filesystem::path& directory);

/// Creates a file there and removes it again. Empty on success; otherwise the system's error.
std::string why_not_writable(const std::filesystem::path& directory);

/// Creates the directory, with its parents, and checks that files can be created in it. Returns those that
/// were missing, outermost first. @throws hal::SetupError naming path and cause, after removing what it
/// created.
std::vector<std::filesystem::path> make_output_directory(const std::filesystem::path& directory);

/// For results that come later: as above, then removes what it created.
/// @throws hal::SetupError as above.
void try_output_directory(const std::filesystem::path& directory);

/// Results may have taken a long time: none is ever replaced.
/// @throws std::invalid_argument naming the first of these files that exists in the directory.
void require_no_results(const std::filesystem::path& directory, const std::vector<std::string>& files);

/// For a command with many file names: @throws std::invalid_argument if the directory is not empty.
void require_empty(const std::filesystem::path& directory);

}  // namespace runtime
