#include "analysis/inputs.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <limits>
#include <map>
#include <memory>
#include <stdexcept>
#include <system_error>
#include <utility>

#include "runtime/configuration/drive_model_file.h"
#include "runtime/recording/bam_log.h"
#include "runtime/recording/recording_reader.h"

namespace analysis {
namespace {

namespace fs = std::filesystem;

void add_files(std::vector<fs::path>& files, const fs::path& path, const std::string& option) {
  std::error_code error;
  if (!fs::is_directory(path, error)) {
    files.push_back(path);
    return;
  }
  std::vector<fs::path> found;
  std::vector<fs::path> logs;
  for (auto entry = fs::directory_iterator(path, error); !error && entry != fs::directory_iterator();
       entry.increment(error)) {
    if (runtime::is_recording(*entry)) found.push_back(entry->path());
    if (entry->path().extension() == ".json") logs.push_back(entry->path());
  }
  if (error) throw std::invalid_argument(option + ": " + path.string() + ": " + error.message());
  // Beside recordings there may be a gap.json.
  if (found.empty()) found = std::move(logs);
  if (found.empty())
    throw std::invalid_argument(option + ": there is no .csv, .mcap or .json in " + path.string());
  std::ranges::sort(found);
  files.insert(files.end(), found.begin(), found.end());
}

std::vector<fs::path> files_of(const std::vector<fs::path>& paths, const std::string& option) {
  std::vector<fs::path> files;
  for (const fs::path& path : paths) add_files(files, path, option);
  return files;
}

/// Data used twice for the fit makes everything look more certain than it is; data used for both fit and
/// judgement proves nothing.
void require_distinct(const std::vector<fs::path>& data, const std::vector<fs::path>& held_out) {
  struct Given {
    fs::path path;
    const char* option;
  };
  std::map<fs::path, Given> seen;
  const auto add = [&seen](const fs::path& path, const char* option) {
    std::error_code error;
    fs::path file = fs::weakly_canonical(path, error);
    if (error) file = path;
    if (file.extension() == ".mcap") file.replace_extension(".csv");  // `youbotctl convert` leaves both
    const auto [there, is_new] = seen.emplace(file, Given{path, option});
    if (is_new) return;
    const Given& first = there->second;
    const bool is_copy = first.path.extension() != path.extension();
    if (first.option == std::string(option))
      throw std::invalid_argument(
          std::string(option) + ": " +
          (is_copy ? first.path.string() + " and " + path.string() + " are one recording: give one of them"
                   : path.string() + " is given twice"));
    throw std::invalid_argument("--held-out: " + path.string() + " is also in --data" +
                                (is_copy ? ", as " + first.path.string() : "") +
                                "; what the search sees cannot judge it: name the other files in --data");
  };
  for (const fs::path& path : data) add(path, "--data");
  for (const fs::path& path : held_out) add(path, "--held-out");
}

/// Motion between rows is interpolated and integrated in steps of a millisecond: rows further apart contain
/// no information on a drive, and would take forever.
constexpr double kLongestStep_s = 1.0;

/// @throws runtime::ConfigError naming the line of the first row that is too late.
void require_dense(const runtime::ReadRecording& read, const fs::path& path) {
  const auto time_s = read.recording.column("time_s");
  for (std::size_t i = 1; i < time_s.size(); ++i)
    if (const double step_s = time_s[i] - time_s[i - 1]; !(step_s <= kLongestStep_s))
      throw runtime::ConfigError({fmt::format(
          "{}:{}: time_s is {} s after the row before; rows may be up to {} s apart: is time_s in seconds? "
          "Split the file at a pause",
          path.string(), read.first_row_line + i, step_s, kLongestStep_s)});
}

/// The last `parts` components of a path.
std::string tail(const fs::path& path, std::size_t parts) {
  const std::vector<fs::path> all(path.begin(), path.end());
  fs::path result;
  for (std::size_t i = all.size() - std::min(parts, all.size()); i < all.size(); ++i) result /= all[i];
  return result.string();
}

/// The shortest path suffixes that differ.
std::vector<std::string> short_names(const std::vector<fs::path>& paths) {
  std::vector<std::string> names;
  for (std::size_t parts = 1;; ++parts) {
    names.clear();
    std::size_t longest = 0;
    for (const fs::path& path : paths) {
      names.push_back(tail(path, parts));
      longest = std::max(longest, static_cast<std::size_t>(std::distance(path.begin(), path.end())));
    }
    std::vector<std::string> sorted = names;
    std::ranges::sort(sorted);
    if (std::ranges::adjacent_find(sorted) == sorted.end() || parts >= longest) return names;
  }
}

/// The common rig of all recordings that name theirs.
std::string common_rig(const std::vector<identification::gap::Source>& sources,
                       const std::vector<fs::path>& paths) {
  std::string rig;
  std::size_t named = 0;
  for (std::size_t i = 0; i < sources.size(); ++i) {
    const std::string& own = sources[i].recording.rig;
    if (own.empty() || own == rig) continue;
    if (!rig.empty())
      throw std::invalid_argument(paths[i].string() + ": is of rig '" + own + "', but " +
                                  paths[named].string() + " is of rig '" + rig +
                                  "'; explain one drive at a time");
    rig = own;
    named = i;
  }
  return rig;
}

}  // namespace

RecordingFiles recording_files(const std::vector<fs::path>& data, const std::vector<fs::path>& held_out) {
  RecordingFiles files{files_of(data, "--data"), files_of(held_out, "--held-out"), {}};
  require_distinct(files.data, files.held_out);
  std::vector<fs::path> all = files.data;
  all.insert(all.end(), files.held_out.begin(), files.held_out.end());
  files.names = short_names(all);
  return files;
}

Inputs read_inputs(const InputPaths& paths,
                   const std::function<void(std::string_view what, double done)>& progress) {
  Inputs inputs;
  const RecordingFiles chosen = recording_files(paths.data, paths.held_out);
  std::vector<fs::path> files = chosen.data;
  const std::size_t data_count = files.size();
  files.insert(files.end(), chosen.held_out.begin(), chosen.held_out.end());

  // All files are read before any is rejected, so that all errors are reported at once.
  std::vector<std::string> problems;
  const auto collect = [&problems](const auto& read) {
    try {
      read();
    } catch (const runtime::ConfigError& error) {
      problems.insert(problems.end(), error.problems().begin(), error.problems().end());
    }
  };
  collect([&] { inputs.model = runtime::read_drive_model(paths.model); });
  std::shared_ptr<const runtime::ColumnMap> columns;
  if (!paths.columns.empty())
    collect([&] { columns = std::make_shared<runtime::ColumnMap>(runtime::read_column_map(paths.columns)); });
  const std::vector<std::string>& names = chosen.names;
  std::vector<identification::gap::Source> sources;
  for (std::size_t i = 0; i < files.size(); ++i)
    collect([&] {
      if (progress)
        progress(fmt::format("reading recording {} of {}", i + 1, files.size()),
                 std::numeric_limits<double>::quiet_NaN());
      if (!columns && !paths.columns.empty()) return;  // all files would be misread
      runtime::ReadRecording read = runtime::read_recording_or_log(
          files[i], {.joint = paths.joint, .one_drive = true, .columns = columns});
      require_dense(read, files[i]);
      inputs.warnings.insert(inputs.warnings.end(), read.warnings.begin(), read.warnings.end());
      sources.push_back({names[i], std::move(read.recording), files[i].string()});
    });
  if (!problems.empty()) throw runtime::ConfigError(std::move(problems));

  inputs.rig = common_rig(sources, files);
  if (!inputs.rig.empty() && !inputs.model.name.empty() && inputs.rig != inputs.model.name)
    inputs.warnings.push_back(paths.model.string() + ": is a model of '" + inputs.model.name +
                              "'; the recordings are of rig '" + inputs.rig + "'");
  const auto first_held_out = sources.begin() + static_cast<std::ptrdiff_t>(data_count);
  inputs.held_out.assign(std::move_iterator(first_held_out), std::move_iterator(sources.end()));
  sources.erase(first_held_out, sources.end());
  inputs.data = std::move(sources);
  return inputs;
}

}  // namespace analysis
