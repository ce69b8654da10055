#include "apps/youbotctl/export_frames.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <stdexcept>
#include <system_error>
#include <utility>

#include "control/teleoperation.h"
#include "runtime/configuration/toml_reader.h"
#include "runtime/mcap/mcap_file.h"
#include "runtime/mcap/recording_head.h"
#include "runtime/mcap/recording_rows.h"
#include "runtime/program/wording.h"

namespace youbotctl {
namespace {

using control::TeleopPhase;

constexpr double kTick_s = 5e-7;  // half of the last decimal of a time in a recording
constexpr std::size_t kFewestFrames = 2;
/// Of a quaternion whose parts have three decimals or more.
constexpr double kNormTolerance = 2e-3;

std::vector<std::string> numbered(const std::string& begin, int count, const std::string& end) {
  std::vector<std::string> names;
  for (int i = 1; i <= count; ++i) names.push_back(begin + std::to_string(i) + end);
  return names;
}

std::vector<std::string> joined(std::vector<std::string> first, const std::vector<std::string>& second) {
  first.insert(first.end(), second.begin(), second.end());
  return first;
}

std::vector<std::string> pose(const std::string& name) {
  return {name + "_x_m", name + "_y_m", name + "_z_m", name + "_qw",
          name + "_qx",  name + "_qy",  name + "_qz"};
}

std::vector<std::string> vector(const std::string& name, const std::string& unit) {
  return {name + "_x_" + unit, name + "_y_" + unit, name + "_z_" + unit};
}

/// The rows of one recording, one after the other.
class Resampler {
 public:
  Resampler(const runtime::mcap::RecordingHead& head, std::filesystem::path recording,
            const FrameOptions& options)
      : recording_(std::move(recording)), options_(options) {
    const auto find = [&](const std::string& name) {
      if (const auto column = head.column(name)) return *column;
      throw runtime::ConfigError({recording_.string() +
                                  ": is no recording of a teleoperation: it has no column " + name +
                                  "; youbotd with a haptic device records one"});
    };
    time_ = find("time_s");
    phase_ = find("phase");
    for (const Feature& feature : teleoperation_features()) {
      columns_.emplace_back();
      for (const std::string& name : feature.columns) {
        columns_.back().push_back(find(name));
        may_be_missing_.resize(std::max(may_be_missing_.size(), columns_.back().back() + 1));
        may_be_missing_[columns_.back().back()] = may_be_missing(name);
      }
    }
    newest_.resize(head.columns.size());
    sum_.resize(head.columns.size());
    mean_.resize(head.columns.size());
  }

  /// @throws std::invalid_argument for a row that no recording has.
  void add(std::span<const double> row) {
    const double t_s = row[time_];
    if (!std::isfinite(t_s) || (last_s_ && t_s <= *last_s_))
      throw std::invalid_argument(fmt::format("time_s = {} does not follow the row before", t_s));
    if (!(row[phase_] >= 0 && row[phase_] <= static_cast<double>(TeleopPhase::kFaulted)))
      throw std::invalid_argument(fmt::format("phase = {} is none of a teleoperation", row[phase_]));
    const auto phase = static_cast<TeleopPhase>(row[phase_]);
    if (last_s_) shortest_step_s_ = std::min(shortest_step_s_, t_s - *last_s_);
    if (episode_ && t_s - *last_s_ > period_s() + kTick_s) {
      if (gaps_++ == 0) first_gap_s_ = *last_s_;
      end_episode();
    }
    const bool operates = phase == TeleopPhase::kOperating;
    if (episode_ && !operates && phase != TeleopPhase::kLetGo && !options_.all_phases) {
      if (phase == TeleopPhase::kFaulted) fault_s_ = t_s;
      end_episode();
    }
    if (!episode_ && (operates || options_.all_phases)) begin_episode(t_s);
    if (episode_) {
      while (next_frame_s() < t_s - kTick_s) add_frame();
      require_frame_values(row, t_s);
      if (operates || options_.all_phases) {
        if (*last_s_operated_ < *last_s_in_episode_) let_go_s_ += t_s - *last_s_operated_;
        last_s_operated_ = t_s;
      }
      take(row, t_s);
    }
    last_s_ = t_s;
    if (std::ranges::find(phases_, phase) == phases_.end()) phases_.push_back(phase);
  }

  Demonstrations finish() {
    end_episode();
    const std::string file = recording_.string();
    if (!last_s_) throw runtime::ConfigError({file + ": has no rows"});
    if (shortest_step_s_ > period_s() + kTick_s && std::isfinite(shortest_step_s_))
      throw runtime::ConfigError({fmt::format("{}: has {:.4g} rows per second, fewer than --fps {}", file,
                                              1 / shortest_step_s_, options_.fps)});
    if (result_.episodes.empty() && !operated_)
      throw runtime::ConfigError({file + ": no row has the phase 'operating', only " + phase_names() +
                                  "; --all-phases exports these"});
    if (result_.episodes.empty())
      throw runtime::ConfigError(
          {fmt::format("{}: operates for less than two frames at --fps {}", file, options_.fps)});
    const auto warn = [&](const std::string& text) { result_.warnings.push_back(file + ": " + text); };
    if (gaps_ > 0)
      warn(fmt::format("{} longer than a frame between rows, the first after {:.3f} s: an episode ends there",
                       runtime::count_text(gaps_, "gap"), first_gap_s_));
    if (too_short_ > 0) warn(runtime::count_text(too_short_, "episode") + " of one frame left out");
    if (let_go_s_ > 0)
      warn(fmt::format("contains {:.1f} s in which the hand had let go and the set-point rested", let_go_s_));
    if (fault_s_) warn(fmt::format("a fault ended the operation at {:.3f} s", *fault_s_));
    return std::move(result_);
  }

 private:
  double period_s() const { return 1.0 / options_.fps; }
  double next_frame_s() const {
    return episode_->begin_s + static_cast<double>(episode_->frames) / options_.fps;
  }

  void begin_episode(double t_s) {
    episode_ = Episode{.recording = recording_, .begin_s = t_s, .frames = 0, .values = {}};
    episode_->values.resize(columns_.size());
    std::ranges::fill(sum_, 0.0);
    rows_ = 0;
    last_s_operated_ = last_s_in_episode_ = t_s;
    operated_ = true;
  }

  void take(std::span<const double> row, double t_s) {
    std::ranges::copy(row, newest_.begin());
    for (std::size_t i = 0; i < row.size(); ++i) sum_[i] += row[i];
    ++rows_;
    last_s_in_episode_ = t_s;
  }

  void add_frame() {
    // A step between rows may be as long as a frame.
    for (std::size_t i = 0; rows_ > 0 && i < sum_.size(); ++i)
      mean_[i] = std::exchange(sum_[i], 0.0) / static_cast<double>(rows_);
    rows_ = 0;
    for (std::size_t f = 0; f < columns_.size(); ++f) {
      const Feature& feature = teleoperation_features()[f];
      std::vector<float>& values = episode_->values[f];
      const std::size_t begin = values.size();
      for (const std::size_t column : columns_[f])
        values.push_back(
            static_cast<float>(feature.resampling == Resampling::kMean ? mean_[column] : newest_[column]));
      keep_sign(feature, values, begin);
    }
    ++episode_->frames;
  }

  /// Here and not in the frame, because this is where the line of the row is known.
  /// @throws std::invalid_argument for a value that no frame can have.
  void require_frame_values(std::span<const double> row, double t_s) const {
    for (std::size_t f = 0; f < columns_.size(); ++f) {
      const Feature& feature = teleoperation_features()[f];
      for (std::size_t i = 0; i < columns_[f].size(); ++i)
        if (const std::size_t column = columns_[f][i];
            !may_be_missing_[column] && !std::isfinite(static_cast<float>(row[column])))
          throw std::invalid_argument(fmt::format("{} is not a number at {:.3f} s", feature.columns[i], t_s));
      const auto w = first_of_rotation(feature);
      if (!w) continue;
      double square = 0;
      for (std::size_t i = 0; i < 4; ++i) square += std::pow(row[columns_[f][*w + i]], 2);
      if (std::abs(std::sqrt(square) - 1) > kNormTolerance)
        throw std::invalid_argument(
            fmt::format("{} to {} are not a rotation at {:.3f} s: their norm is {:.4f}, expected 1",
                        feature.columns[*w], feature.columns[*w + 3], t_s, std::sqrt(square)));
    }
  }

  /// Where the quaternion of a feature begins, if it has one.
  static std::optional<std::size_t> first_of_rotation(const Feature& feature) {
    const auto w =
        std::ranges::find_if(feature.columns, [](const auto& name) { return name.ends_with("_qw"); });
    if (w == feature.columns.end()) return std::nullopt;
    return static_cast<std::size_t>(w - feature.columns.begin());
  }

  /// q and -q are one rotation, and a recording changes between them where w is zero. Here the first one has
  /// w >= 0, the others are next to the one before.
  static void keep_sign(const Feature& feature, std::vector<float>& values, std::size_t begin) {
    const auto w = first_of_rotation(feature);
    if (!w) return;
    const std::size_t at = begin + *w;
    const std::span<float> q = std::span(values).subspan(at, 4);
    float along = q[0];
    if (begin > 0) {
      const std::span<const float> before = std::span(values).subspan(at - feature.columns.size(), 4);
      along = 0;
      for (std::size_t i = 0; i < 4; ++i) along += q[i] * before[i];
    }
    if (along < 0)
      for (float& part : q) part = -part;
  }

  void end_episode() {
    if (!episode_) return;
    while (next_frame_s() <= *last_s_in_episode_ + kTick_s) add_frame();
    // A hand that let go and did not return is no demonstration.
    const double operated_s = *last_s_operated_ - episode_->begin_s;
    const auto frames = static_cast<std::size_t>((operated_s + kTick_s) * options_.fps) + 1;
    if (frames < episode_->frames) {
      episode_->frames = frames;
      for (std::size_t f = 0; f < columns_.size(); ++f)
        episode_->values[f].resize(frames * columns_[f].size());
    }
    if (episode_->frames < kFewestFrames)
      ++too_short_;
    else
      result_.episodes.push_back(std::move(*episode_));
    episode_.reset();
  }

  std::string phase_names() const {
    std::string names;
    for (const TeleopPhase phase : phases_)
      names += (names.empty() ? "'" : ", '") + std::string(name(phase)) + "'";
    return names;
  }

  std::filesystem::path recording_;
  FrameOptions options_;
  std::size_t time_ = 0;
  std::size_t phase_ = 0;
  std::vector<std::vector<std::size_t>> columns_;  // of each feature, in a row
  std::vector<bool> may_be_missing_;               // by column

  // The open episode.
  std::optional<Episode> episode_;
  std::optional<double> last_s_in_episode_;
  std::optional<double> last_s_operated_;
  std::vector<double> newest_;
  std::vector<double> sum_;  // of the rows since the last frame
  std::vector<double> mean_;
  std::size_t rows_ = 0;  // in the sum

  // Of the recording.
  std::optional<double> last_s_;
  double shortest_step_s_ = std::numeric_limits<double>::infinity();
  std::vector<TeleopPhase> phases_;
  bool operated_ = false;
  long long gaps_ = 0;
  double first_gap_s_ = 0;
  long long too_short_ = 0;
  double let_go_s_ = 0;
  std::optional<double> fault_s_;
  Demonstrations result_;
};

/// Of a directory, that of its run.
std::filesystem::path recording_at(const std::filesystem::path& path) {
  std::error_code error;
  if (!std::filesystem::is_directory(path, error)) return path;
  for (const char* name : {"teleoperation.csv", "teleoperation.mcap"})
    if (std::filesystem::exists(path / name, error)) return path / name;
  throw runtime::ConfigError(
      {path.string() + ": contains no recording of a teleoperation, teleoperation.csv or .mcap"});
}

/// A refused row is named by its line or, in MCAP, by its number.
void read_rows(const std::filesystem::path& recording, runtime::mcap::RowVisitor visitor) {
  if (recording.extension() != ".mcap") return runtime::mcap::read_csv_rows(recording, visitor);
  std::uint64_t number = 0;
  visitor.row = [&number, take = std::move(visitor.row)](std::span<const double> row) {
    ++number;
    try {
      take(row);
    } catch (const std::invalid_argument& error) {
      throw std::invalid_argument(fmt::format("row {}: {}", number, error.what()));
    }
  };
  runtime::mcap::read_mcap_rows([&] { return runtime::mcap::read_file(recording); }, recording.string(),
                                {.all = true}, visitor);
}

}  // namespace

const std::vector<Feature>& teleoperation_features() {
  using enum Resampling;
  static const std::vector<Feature> features{
      {"observation.state", kNewest,
       joined(joined({"base_x_m", "base_y_m", "base_yaw_rad"}, pose("tip")),
              numbered("arm_", 5, "_position_rad"))},
      {"observation.effort", kMean,
       joined(numbered("wheel_", 4, "_torque_measured_Nm"), numbered("arm_", 5, "_torque_measured_Nm"))},
      {"observation.wrench", kMean, joined(vector("wrench_force", "N"), vector("wrench_moment", "Nm"))},
      {"observation.felt_force", kMean, vector("grip_force_held", "N")},
      {"truth.contact_force", kMean, vector("contact_force", "N")},
      {"action", kNewest, joined(pose("setpoint"), {"gripper_opening_m"})}};
  return features;
}

bool may_be_missing(const std::string& column) {
  return column == "gripper_opening_m" || column.starts_with("contact_force_");
}

Demonstrations read_demonstrations(const std::filesystem::path& path, const FrameOptions& options) {
  const std::filesystem::path recording = recording_at(path);
  std::optional<Resampler> resampler;
  std::vector<std::string> warnings;
  const runtime::mcap::RowVisitor rows{
      .head = [&](const runtime::mcap::RecordingHead& head) { resampler.emplace(head, recording, options); },
      .row = [&](std::span<const double> row) { resampler->add(row); },
      .warning = [&](const std::string& text) { warnings.push_back(text); }};
  try {
    read_rows(recording, rows);
    Demonstrations result = resampler->finish();
    result.warnings.insert(result.warnings.begin(), warnings.begin(), warnings.end());
    return result;
  } catch (const std::invalid_argument& error) {
    throw runtime::ConfigError({recording.string() + ": " + error.what()});
  }
}

}  // namespace youbotctl
