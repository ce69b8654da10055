#include "apps/youbotctl/export_lerobot.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <iterator>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <stdexcept>
#include <system_error>
#include <utility>

#include "apps/youbotctl/export_statistics.h"
#include "runtime/configuration/whole_file.h"
#include "runtime/log.h"
#include "runtime/mcap/new_file.h"
#include "runtime/parquet/parquet_writer.h"
#include "runtime/program/build_info.h"
#include "runtime/program/exit_code.h"
#include "runtime/program/wording.h"
#include "runtime/recording/made_paths.h"
#include "runtime/recording/output_directory.h"

namespace youbotctl {
namespace {

namespace fs = std::filesystem;
namespace parquet = runtime::parquet;
using nlohmann::ordered_json;

constexpr std::uint64_t kFilesPerChunk = 1000;
constexpr const char* kDataPath = "data/chunk-{chunk_index:03d}/file-{file_index:03d}.parquet";
constexpr const char* kEpisodesPath = "meta/episodes/chunk-000/file-000.parquet";

/// A column of the frames.
struct Series {
  std::string name;
  bool whole = false;              // numbers: int64; otherwise float32
  std::vector<std::string> names;  // of the dimensions; empty: one value, not a list
  std::vector<double> values;      // of all episodes, frame by frame

  std::size_t width() const { return std::max<std::size_t>(names.size(), 1); }
  parquet::Column column() const {
    return {name, whole ? parquet::Type::kInt64 : parquet::Type::kFloat,
            names.empty() ? std::nullopt : std::optional(names.size())};
  }
  ordered_json description() const {
    return {{"dtype", whole ? "int64" : "float32"},
            {"shape", {width()}},
            {"names", names.empty() ? ordered_json() : ordered_json(names)}};
  }
};

/// Where in the dataset the frames of an episode are.
struct Place {
  std::size_t begin = 0;
  std::size_t end = 0;
  std::uint64_t chunk = 0;
  std::uint64_t file = 0;
};

template <typename Number>
std::vector<Number> converted(std::span<const double> values) {
  std::vector<Number> result(values.size());
  std::ranges::transform(values, result.begin(), [](double value) { return static_cast<Number>(value); });
  return result;
}

std::span<const double> part(const Series& series, const Place& place) {
  return std::span(series.values)
      .subspan(place.begin * series.width(), (place.end - place.begin) * series.width());
}

/// Written under its final name, because nothing reads a dataset without meta/info.json, which comes last.
class ParquetFile {
 public:
  ParquetFile(const fs::path& path, std::vector<parquet::Column> columns,
              std::vector<parquet::ParquetWriter::KeyValue> metadata = {})
      : file_(path),
        writer_([this](std::string_view bytes) { file_.write(bytes); },
                std::string("youbot-hal version ") + runtime::build_version(), std::move(columns),
                std::move(metadata)) {}

  parquet::ParquetWriter& writer() noexcept { return writer_; }
  void finish() {
    writer_.finish();
    file_.finish();
  }

 private:
  runtime::mcap::NewFile file_;
  parquet::ParquetWriter writer_;
};

/// The frames of all episodes as columns, in LeRobot's order: features, then its own five.
std::vector<Series> series_of(const Demonstrations& demonstrations, int fps) {
  std::vector<Series> all;
  const std::vector<Feature>& features = teleoperation_features();
  for (std::size_t f = 0; f < features.size(); ++f) {
    const std::size_t width = features[f].columns.size();
    std::vector<std::size_t> there;  // dimensions that each frame has
    for (std::size_t d = 0; d < width; ++d) {
      std::size_t frames = 0;
      std::size_t missing = 0;
      for (const Episode& episode : demonstrations.episodes) {
        frames += episode.frames;
        for (std::size_t i = 0; i < episode.frames; ++i)
          missing += !std::isfinite(episode.values[f][i * width + d]);
      }
      if (missing == 0) there.push_back(d);
      if (missing > 0 && missing < frames)
        spdlog::warn("{} is left out: {} of {} frames have none", features[f].columns[d], missing, frames);
    }
    if (there.empty()) continue;
    Series& series = all.emplace_back();
    series.name = features[f].name;
    for (const std::size_t d : there) series.names.push_back(features[f].columns[d]);
    for (const Episode& episode : demonstrations.episodes)
      for (std::size_t i = 0; i < episode.frames; ++i)
        for (const std::size_t d : there) series.values.push_back(double{episode.values[f][i * width + d]});
  }
  Series timestamp{.name = "timestamp", .whole = false, .names = {}, .values = {}};
  Series frame_index{.name = "frame_index", .whole = true, .names = {}, .values = {}};
  Series episode_index{.name = "episode_index", .whole = true, .names = {}, .values = {}};
  Series index{.name = "index", .whole = true, .names = {}, .values = {}};
  Series task_index{.name = "task_index", .whole = true, .names = {}, .values = {}};
  for (std::size_t e = 0; e < demonstrations.episodes.size(); ++e)
    for (std::size_t i = 0; i < demonstrations.episodes[e].frames; ++i) {
      timestamp.values.push_back(double{static_cast<float>(static_cast<double>(i) / fps)});
      frame_index.values.push_back(static_cast<double>(i));
      episode_index.values.push_back(static_cast<double>(e));
      index.values.push_back(static_cast<double>(index.values.size()));
      task_index.values.push_back(0.0);
    }
  for (Series* each : {&timestamp, &frame_index, &episode_index, &index, &task_index})
    all.push_back(std::move(*each));
  return all;
}

/// The directory of a dataset. The destructor removes what was created in it unless keep() was called.
class Dataset {
 public:
  explicit Dataset(const fs::path& root) : root_(root) {
    made_.add(runtime::make_output_directory(root));
    runtime::require_empty(root);
  }
  /// With its folders.
  fs::path file(const std::string& name) {
    fs::path path = root_ / name;
    made_.add(runtime::make_output_directory(path.parent_path()));
    made_.add(path);
    return path;
  }
  void keep() noexcept { made_.keep(); }

 private:
  fs::path root_;
  runtime::MadePaths made_;
};

/// One row group for each episode, which a reader then finds at once.
std::vector<Place> write_data(const Demonstrations& demonstrations, const std::vector<Series>& all,
                              std::uint64_t file_bytes, Dataset& dataset) {
  std::vector<parquet::Column> columns;
  for (const Series& series : all) columns.push_back(series.column());
  std::vector<Place> places;
  std::optional<ParquetFile> file;
  std::uint64_t files = 0;
  std::size_t begin = 0;
  for (const Episode& episode : demonstrations.episodes) {
    if (!file) {
      file.emplace(
          dataset.file(fmt::format(fmt::runtime(kDataPath), fmt::arg("chunk_index", files / kFilesPerChunk),
                                   fmt::arg("file_index", files % kFilesPerChunk))),
          columns);
      ++files;
    }
    const Place place{.begin = begin,
                      .end = begin + episode.frames,
                      .chunk = (files - 1) / kFilesPerChunk,
                      .file = (files - 1) % kFilesPerChunk};
    std::vector<parquet::Values> values;
    for (const Series& series : all) {
      if (series.whole)
        values.emplace_back(converted<std::int64_t>(part(series, place)));
      else
        values.emplace_back(converted<float>(part(series, place)));
    }
    file->writer().add_row_group(episode.frames, values);
    places.push_back(place);
    begin = place.end;
    if (file->writer().bytes_written() >= file_bytes) {
      file->finish();
      file.reset();
    }
  }
  if (file) file->finish();
  return places;
}

/// pandas makes the texts the index of the table from `pandas`; LeRobot looks them up there.
void write_tasks(const std::string& task, const fs::path& path) {
  const auto column = [](const char* name, const char* pandas_type, const char* numpy_type) {
    return ordered_json{{"name", name},
                        {"field_name", name},
                        {"pandas_type", pandas_type},
                        {"numpy_type", numpy_type},
                        {"metadata", nullptr}};
  };
  const ordered_json pandas{
      {"index_columns", {"task"}},
      {"column_indexes", ordered_json::array()},
      {"columns", {column("task_index", "int64", "int64"), column("task", "unicode", "object")}}};
  ParquetFile file(path, {{"task_index", parquet::Type::kInt64}, {"task", parquet::Type::kText}},
                   {{"pandas", pandas.dump()}});
  file.writer().add_row_group(
      1, std::vector<parquet::Values>{std::vector<std::int64_t>{0}, std::vector<std::string>{task}});
  file.finish();
}

/// A row for each episode, with its place and the statistics of its features.
void write_episodes(const std::vector<Place>& places, const std::vector<Series>& all, const std::string& task,
                    const fs::path& path) {
  std::vector<parquet::Column> columns;
  std::vector<parquet::Values> values;
  const auto add_whole = [&](const std::string& name, auto number_of) {
    columns.push_back({name, parquet::Type::kInt64});
    std::vector<std::int64_t> numbers;
    for (std::size_t e = 0; e < places.size(); ++e)
      numbers.push_back(static_cast<std::int64_t>(number_of(e, places[e])));
    values.emplace_back(std::move(numbers));
  };
  add_whole("episode_index", [](std::size_t e, const Place&) { return e; });
  columns.push_back({"tasks", parquet::Type::kText, 1});
  values.emplace_back(std::vector<std::string>(places.size(), task));
  add_whole("length", [](std::size_t, const Place& place) { return place.end - place.begin; });
  add_whole("data/chunk_index", [](std::size_t, const Place& place) { return place.chunk; });
  add_whole("data/file_index", [](std::size_t, const Place& place) { return place.file; });
  add_whole("dataset_from_index", [](std::size_t, const Place& place) { return place.begin; });
  add_whole("dataset_to_index", [](std::size_t, const Place& place) { return place.end; });
  for (const Series& series : all) {
    const std::size_t first = columns.size();
    for (const Place& place : places) {
      const Statistics of_episode = statistics(part(series, place), series.width());
      for (std::size_t s = 0; s < of_episode.size(); ++s) {
        const auto& [name, numbers] = of_episode[s];
        const bool count = name == "count";
        if (first + s == columns.size()) {
          columns.push_back({"stats/" + series.name + "/" + name,
                             count ? parquet::Type::kInt64 : parquet::Type::kDouble, numbers.size()});
          values.emplace_back(count ? parquet::Values(std::vector<std::int64_t>())
                                    : parquet::Values(std::vector<double>()));
        }
        std::visit(
            [&numbers = numbers]<typename Number>(std::vector<Number>& column) {
              if constexpr (std::is_arithmetic_v<Number>)
                std::ranges::copy(converted<Number>(numbers), std::back_inserter(column));
            },
            values[first + s]);
      }
    }
  }
  add_whole("meta/episodes/chunk_index", [](std::size_t, const Place&) { return 0; });
  add_whole("meta/episodes/file_index", [](std::size_t, const Place&) { return 0; });
  ParquetFile file(path, std::move(columns));
  file.writer().add_row_group(places.size(), values);
  file.finish();
}

std::string stats_json(const std::vector<Series>& all) {
  ordered_json stats;
  for (const Series& series : all)
    for (const auto& [name, numbers] : statistics(series.values, series.width()))
      stats[series.name][name] =
          name == "count" ? ordered_json(converted<std::int64_t>(numbers)) : ordered_json(numbers);
  return stats.dump(4);
}

std::string info_json(const std::vector<Series>& all, const std::vector<Place>& places, int fps) {
  ordered_json features;
  for (const Series& series : all) features[series.name] = series.description();
  const ordered_json info{{"codebase_version", "v3.0"},
                          {"fps", fps},
                          {"features", features},
                          {"total_episodes", places.size()},
                          {"total_frames", places.back().end},
                          {"total_tasks", 1},
                          {"chunks_size", kFilesPerChunk},
                          {"data_files_size_in_mb", kDataFile_MB},
                          {"video_files_size_in_mb", 200},
                          {"data_path", kDataPath},
                          {"video_path", nullptr},
                          {"robot_type", "youbot"},
                          {"splits", {{"train", "0:" + std::to_string(places.size())}}}};
  return info.dump(4);
}

void require_text(const std::string& task) {
  if (task.empty()) throw std::invalid_argument("--task: a text is missing");
  try {
    static_cast<void>(ordered_json(task).dump());
  } catch (const ordered_json::exception&) {
    throw std::invalid_argument("--task: is not UTF-8");
  }
}

}  // namespace

void write_lerobot(const Demonstrations& demonstrations, const fs::path& out, const LerobotOptions& options) {
  require_text(options.task);
  const std::vector<Series> all = series_of(demonstrations, options.frames.fps);
  Dataset dataset(out);
  const std::vector<Place> places = write_data(demonstrations, all, options.data_file_bytes, dataset);
  write_tasks(options.task, dataset.file("meta/tasks.parquet"));
  write_episodes(places, all, options.task, dataset.file(kEpisodesPath));
  runtime::write_whole_file(dataset.file("meta/stats.json"), stats_json(all));
  runtime::write_whole_file(dataset.file("meta/info.json"), info_json(all, places, options.frames.fps));
  dataset.keep();
}

int export_lerobot(const std::vector<fs::path>& recordings, const fs::path& out,
                   const LerobotOptions& options, bool quiet) {
  require_text(options.task);
  runtime::try_output_directory(out);
  runtime::require_empty(out);
  Demonstrations all;
  std::map<fs::path, fs::path> seen;  // without the extension: one run may be there as CSV and as MCAP
  for (const fs::path& recording : recordings) {
    Demonstrations read = read_demonstrations(recording, options.frames);
    const fs::path& file = read.episodes.front().recording;
    std::error_code unknown;
    const auto [same, is_new] = seen.emplace(fs::weakly_canonical(file, unknown).replace_extension(), file);
    if (!is_new && same->second.extension() != file.extension())
      throw std::invalid_argument(same->second.string() + " and " + file.string() +
                                  " are one recording: give one of them");
    if (!is_new) throw std::invalid_argument(recording.string() + " is given twice");
    for (const std::string& warning : read.warnings) spdlog::warn("{}", warning);
    std::ranges::move(read.episodes, std::back_inserter(all.episodes));
  }
  write_lerobot(all, out, options);
  if (quiet) return runtime::kExitOk;
  std::size_t frames = 0;
  for (std::size_t e = 0; e < all.episodes.size(); ++e) {
    const Episode& episode = all.episodes[e];
    frames += episode.frames;
    std::printf("episode %zu: %s from %.3f s: %zu frames\n", e, episode.recording.c_str(), episode.begin_s,
                episode.frames);
  }
  std::printf("%s: %s, %zu frames at %d Hz\n", out.c_str(),
              runtime::count_text(static_cast<long long>(all.episodes.size()), "episode").c_str(), frames,
              options.frames.fps);
  return runtime::kExitOk;
}

}  // namespace youbotctl
