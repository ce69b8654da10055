#include "runtime/mcap/recording_head.h"

#include <time.h>

#include <algorithm>
#include <charconv>
#include <cstdio>
#include <ctime>
#include <utility>

#include "runtime/mcap/decimals.h"
#include "runtime/recording/recording_reader.h"

namespace runtime::mcap {
namespace {

constexpr std::string_view kComments = "comments";
constexpr std::string_view kColumns = "columns";
constexpr std::string_view kDecimals = "decimals";

std::vector<std::string_view> split(std::string_view text, char separator) {
  std::vector<std::string_view> parts;
  for (;;) {
    const std::size_t end = text.find(separator);
    parts.push_back(text.substr(0, end));
    if (end == text.npos) return parts;
    text.remove_prefix(end + 1);
  }
}

const std::string& entry(const StringMap& map, std::string_view key) {
  const auto found = map.find(std::string(key));
  if (found == map.end()) throw BadRecord("no '" + std::string(key) + "' in the metadata");
  return found->second;
}

}  // namespace

std::string_view RecordingHead::comment(std::string_view key) const noexcept {
  const auto found = std::ranges::find(comments, key, &RecordingFile::Comment::key);
  return found == comments.end() ? std::string_view() : std::string_view(found->value);
}

std::optional<std::size_t> RecordingHead::column(std::string_view column_name) const noexcept {
  const auto found = std::ranges::find(columns, column_name, &RecordingFile::Column::name);
  if (found == columns.end()) return std::nullopt;
  return static_cast<std::size_t>(found - columns.begin());
}

std::uint64_t RecordingHead::start_ns() const {
  std::tm utc{};
  const std::string text(comment("started"));
  int length = 0;  // of the whole seconds
  if (std::sscanf(text.c_str(), "%4d-%2d-%2dT%2d:%2d:%2d%n", &utc.tm_year, &utc.tm_mon, &utc.tm_mday,
                  &utc.tm_hour, &utc.tm_min, &utc.tm_sec, &length) != 6)
    return 0;
  std::string_view rest = std::string_view(text).substr(static_cast<std::size_t>(length));
  std::uint64_t fraction_ns = 0;
  if (rest.starts_with('.')) {
    rest.remove_prefix(1);
    std::uint64_t unit_ns = 100'000'000;
    for (; !rest.empty() && rest.front() >= '0' && rest.front() <= '9'; rest.remove_prefix(1)) {
      fraction_ns += unit_ns * static_cast<std::uint64_t>(rest.front() - '0');
      unit_ns /= 10;
    }
  }
  if (rest != "Z") return 0;
  utc.tm_year -= 1900;
  utc.tm_mon -= 1;
  const std::time_t seconds = timegm(&utc);
  constexpr std::time_t kLast = 9'000'000'000;  // year 2255
  if (seconds < 0 || seconds > kLast) return 0;
  return static_cast<std::uint64_t>(seconds) * 1'000'000'000 + fraction_ns;
}

Attachment toml_attachment(const std::string& name, const std::string& text, std::uint64_t time_ns) {
  return {.name = name,
          .media_type = "application/toml",
          .log_time_ns = time_ns,
          .create_time_ns = time_ns,
          .data = text};
}

StringMap metadata_of(const RecordingHead& head) {
  StringMap map;
  std::string all;
  for (const auto& [key, value] : head.comments) {
    map.emplace(key, value);
    all += key + ": " + value + '\n';
  }
  map.insert_or_assign(std::string(kComments), all);
  return map;
}

StringMap channel_metadata_of(const RecordingHead& head) {
  std::string names;
  std::string decimals;
  for (const auto& [column, digits] : head.columns) {
    names += (names.empty() ? "" : ",") + column;
    decimals += (digits ? std::to_string(*digits) : "") + ',';
  }
  if (!decimals.empty()) decimals.pop_back();
  return {{std::string(kColumns), names}, {std::string(kDecimals), decimals}};
}

RecordingHead head_from(const StringMap& recording, const StringMap& channel) {
  RecordingHead head;
  if (const auto comments = recording.find(std::string(kComments)); comments != recording.end())
    for (const std::string_view line : split(comments->second, '\n'))
      if (const std::size_t colon = line.find(": "); colon != line.npos)
        head.comments.push_back({std::string(line.substr(0, colon)), std::string(line.substr(colon + 2))});
  const std::string& columns = entry(channel, kColumns);
  if (static_cast<std::size_t>(std::ranges::count(columns, ',')) >= kMaxRecordingColumns)
    throw BadRecord("more than " + std::to_string(kMaxRecordingColumns) + " columns");
  const auto names = split(columns, ',');
  const auto decimals = split(entry(channel, kDecimals), ',');
  if (names.size() != decimals.size())
    throw BadRecord(std::to_string(names.size()) + " columns, but decimals of " +
                    std::to_string(decimals.size()));
  for (std::size_t i = 0; i < names.size(); ++i) {
    RecordingFile::Column column{std::string(names[i])};
    const std::string_view text = decimals[i];
    if (!text.empty()) {
      int digits = -1;
      const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), digits);
      if (error != std::errc() || end != text.data() + text.size() || digits < 0 ||
          digits > RecordingFile::kMaxDecimals)
        throw BadRecord("column " + column.name + " with '" + std::string(text.substr(0, 20)) + "' decimals");
      column.decimals = digits;
    }
    head.columns.push_back(std::move(column));
  }
  return head;
}

std::vector<JointColumns> joints_of(const RecordingHead& head) {
  constexpr std::string_view kPosition = "position_rad";
  std::vector<JointColumns> joints;
  for (std::size_t i = 0; i < head.columns.size(); ++i) {
    const std::string& column = head.columns[i].name;
    if (!column.ends_with(kPosition)) continue;
    const std::string prefix = column.substr(0, column.size() - kPosition.size());
    if (!prefix.empty() && (!prefix.ends_with('_') || prefix.size() == 1)) continue;
    const std::string_view rig = head.comment("rig");
    const std::string joint =
        !prefix.empty() ? prefix.substr(0, prefix.size() - 1) : std::string(rig.empty() ? "joint" : rig);
    joints.push_back(
        {joint, i, head.column(prefix + "velocity_rad_per_s"), head.column(prefix + "torque_measured_Nm")});
  }
  return joints;
}

}  // namespace runtime::mcap
