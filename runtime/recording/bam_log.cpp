#include "runtime/recording/bam_log.h"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "runtime/configuration/regular_file.h"

namespace runtime {
namespace {

using nlohmann::json;

[[noreturn]] void fail(const std::string& name, const std::string& problem) {
  throw RecordingError({name + ": " + problem});
}

/// What every log has.
ColumnMap own_columns(const json& first) {
  ColumnMap map{.name = "bam's format"};
  const auto add = [&](const char* quantity, const char* key, bool needed) {
    if (needed || first.contains(key)) map.columns.push_back({.quantity = quantity, .column = key});
  };
  add("time_s", "timestamp", true);
  add("position_rad", "position", true);
  add("position_command_rad", "goal_position", false);
  add("temperature_C", "temp", false);
  if (first.contains("torque_enable")) {
    map.only_column = "torque_enable";
    map.only_value = "true";
  }
  return map;
}

json parsed(std::string_view text, const std::string& name) {
  try {
    json log = json::parse(text);
    if (!log.is_object() || !log.contains("entries") || !log["entries"].is_array())
      fail(name, "is no log of bam: an object with 'entries', a list, was expected");
    return log;
  } catch (const json::parse_error& error) {
    fail(name, "is torn, or no JSON (which has no NaN), from byte " + std::to_string(error.byte) +
                   " on; mend it there, or record or copy it again");
  } catch (const json::out_of_range&) {
    fail(name, "has a number beyond all floating-point numbers; record it again");
  }
}

/// What is nested is no value of a column, and may be nested too deep to be printed.
std::string text_of(const json& value) {
  if (value.is_structured()) return "[...]";
  return value.is_string() ? value.get<std::string>() : value.dump();
}

}  // namespace

ReadRecording parse_bam_log(std::string_view text, const std::string& name, const ColumnMap* columns) {
  const json log = parsed(text, name);
  const json& entries = log["entries"];
  if (entries.empty() || !entries.front().is_object()) fail(name, "has no entries; was anything recorded?");
  SourceTable table;
  for (const auto& [key, value] : entries.front().items()) table.names.push_back(key);
  for (const auto& [key, value] : log.items()) {
    if (value.is_structured()) continue;
    if (value.is_number()) table.header[key] = value.get<double>();
    std::string line = text_of(value);
    std::ranges::replace_if(
        line, [](char c) { return static_cast<unsigned char>(c) < 0x20; }, ' ');
    table.comments.emplace_back(key, line);
    if (key == "motor") table.comments.emplace_back("rig", line);
    if (key == "trajectory") table.comments.emplace_back("experiment", line);
  }
  std::size_t next = 0;
  std::vector<std::string> row(table.names.size());
  table.next = [&](std::vector<std::string_view>& fields) {
    if (next == entries.size()) return false;
    const json& entry = entries[next++];
    if (!entry.is_object() || entry.size() != table.names.size())
      fail(name + ":" + std::to_string(next), "the entry does not have the keys of the first one");
    fields.clear();
    for (std::size_t i = 0; i < row.size(); ++i) {
      const auto found = entry.find(table.names[i]);
      if (found == entry.end())
        fail(name + ":" + std::to_string(next), "the entry has no '" + table.names[i] + "'");
      row[i] = text_of(*found);
      fields.push_back(row[i]);
    }
    return true;
  };
  if (columns != nullptr) return parse_table(table, name, *columns);
  return parse_table(table, name, own_columns(entries.front()));
}

ReadRecording read_recording_or_log(const std::filesystem::path& path, const ReadOptions& options) {
  if (path.extension() != ".json") return read_recording(path, options);
  std::string text;
  try {
    text = read_regular_file(path, kMaxBamLog_bytes);
  } catch (const std::runtime_error& error) {
    fail(path.string(), error.what());
  }
  return parse_bam_log(text, path.string(), options.columns.get());
}

}  // namespace runtime
