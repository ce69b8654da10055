#include "runtime/recording/output_directory.h"

#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <stdexcept>
#include <system_error>
#include <utility>

#include "hal/setup_error.h"
#include "runtime/recording/made_paths.h"

namespace runtime {

namespace fs = std::filesystem;

fs::path existing_ancestor(const fs::path& directory) {
  std::error_code unknown;
  fs::path at = fs::absolute(directory, unknown);
  while (at.has_relative_path() && !fs::exists(at, unknown)) at = at.parent_path();
  return at;
}

std::string why_not_writable(const fs::path& directory) {
  std::string file = (directory / "youbot-try-XXXXXX").string();
  const int descriptor = mkstemp(file.data());
  if (descriptor < 0) return std::generic_category().message(errno);
  close(descriptor);
  unlink(file.c_str());
  return {};
}

std::vector<fs::path> make_output_directory(const fs::path& directory) {
  std::vector<fs::path> missing;
  std::error_code error;
  for (fs::path at = directory; at.has_relative_path() && !fs::exists(at, error) && !error;
       at = at.parent_path())
    missing.insert(missing.begin(), at);
  std::vector<fs::path> made;
  for (auto path = missing.begin(); path != missing.end() && !error; ++path)
    if (fs::create_directory(*path, error)) made.push_back(*path);
  const bool is_directory = !error && fs::is_directory(directory, error);
  std::string cause;
  if (error == std::errc::no_such_file_or_directory)  // its parent is there, yet takes none: /proc, /sys
    cause = "the file system there takes no new directory";
  else if (error)
    cause = error.message();
  else if (!is_directory)
    cause = "something else has that name";
  else
    cause = why_not_writable(directory);
  if (cause.empty()) return made;
  const MadePaths taken_away(std::move(made));
  throw hal::SetupError(directory.string(), "cannot be the directory for the results: " + cause,
                        "name another one");
}

void try_output_directory(const fs::path& directory) {
  const MadePaths taken_away(make_output_directory(directory));
}

void require_no_results(const fs::path& directory, const std::vector<std::string>& files) {
  std::error_code unknown;
  for (const std::string& file : files)
    if (fs::exists(fs::symlink_status(directory / file, unknown)))  // also a link to nothing
      throw std::invalid_argument("--out: " + (directory / file).string() +
                                  " is there already and is not replaced; name a new directory");
}

void require_empty(const fs::path& directory) {
  std::error_code unknown;
  if (!fs::is_empty(directory, unknown) && !unknown)
    throw std::invalid_argument("--out: " + directory.string() + " is not empty; name a new directory");
}

}  // namespace runtime
