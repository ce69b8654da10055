#include "identification/robot_gap/arm_subject.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <stdexcept>
#include <utility>

#include "identification/robot_gap/arm_experiment.h"
#include "identification/robot_gap/arm_noise.h"
#include "identification/robot_gap/arm_rows.h"

namespace identification::robot_gap {
namespace {

/// Share of each recording that searches, where nothing else is held out.
constexpr double kSearched = 0.75;
/// One in so many is held out of those that are too short to be divided.
constexpr std::size_t kWholeOnes = 4;
/// Blocks of all data, and their shortest length in periods of the band.
constexpr double kWantedBlocks = 60;
constexpr double kShortestBlock = 8;
constexpr int kFewestBlocks = 8;
constexpr std::size_t kRanges = 6;
constexpr std::size_t kDirections = 2;

/// The first `kSearched` of each recording, and the rest. Of those whose rest would be too short, every
/// fourth is held out as a whole.
void set_aside(std::vector<ArmRecording>& data, std::vector<ArmRecording>& held_out, double band_Hz) {
  std::vector<ArmRecording> searched;
  std::size_t undivided = 0;
  for (ArmRecording& whole : data) {
    const auto rows = static_cast<Eigen::Index>(whole.time_s.size());
    const auto first = static_cast<Eigen::Index>(kSearched * static_cast<double>(rows));
    if (rows == 0 ||
        whole.time_s.back() - whole.time_s[static_cast<std::size_t>(first)] < shortest_recording_s(band_Hz)) {
      (undivided++ % kWholeOnes == 1 ? held_out : searched).push_back(std::move(whole));
      continue;
    }
    ArmRecording rest{whole.name + ", last quarter",
                      {whole.time_s.begin() + first, whole.time_s.end()},
                      whole.position_rad.rightCols(rows - first),
                      whole.torque_Nm.rightCols(rows - first)};
    held_out.push_back(std::move(rest));
    whole.time_s.resize(static_cast<std::size_t>(first));
    whole.position_rad = whole.position_rad.leftCols(first).eval();
    whole.torque_Nm = whole.torque_Nm.leftCols(first).eval();
    searched.push_back(std::move(whole));
  }
  data = std::move(searched);
  if (held_out.empty()) {
    char text[200];
    std::snprintf(
        text, sizeof text,
        ": is too short to set a quarter of it aside: in a band of %.3g Hz that takes %.3g s without "
        "a pause; record longer, or hold out another recording",
        band_Hz, shortest_recording_s(band_Hz) / (1 - kSearched));
    throw std::invalid_argument(data.front().name + text);
  }
}

std::vector<ArmMotion> all_filtered(const std::vector<ArmRecording>& recordings, double band_Hz) {
  std::vector<ArmMotion> motions;
  motions.reserve(recordings.size());
  for (const ArmRecording& recording : recordings) motions.push_back(filtered(recording, band_Hz));
  return motions;
}

double block_s_of(const std::vector<ArmMotion>& motions, double band_Hz) {
  double sum_s = 0;
  for (const ArmMotion& motion : motions) sum_s += static_cast<double>(motion.rows()) * motion.row_s();
  return std::max(kShortestBlock / band_Hz, sum_s / kWantedBlocks);
}

std::vector<std::string> names_of(const std::vector<ArmMotion>& motions) {
  std::vector<std::string> names;
  for (const ArmMotion& motion : motions) names.push_back(motion.name);
  return names;
}

}  // namespace

ArmSubject::ArmSubject(const control::ArmDescription& arm, std::vector<ArmRecording> data,
                       std::vector<ArmRecording> held_out, const ArmOptions& options)
    : given_(arm) {
  if (data.empty()) throw std::invalid_argument("there is no recording to search");
  band_Hz_ = usable_band_Hz(held_out, usable_band_Hz(data, options.band_Hz));
  if (held_out.empty()) set_aside(data, held_out, band_Hz_);
  searched_motions_ = all_filtered(data, band_Hz_);
  held_out_motions_ = all_filtered(held_out, band_Hz_);
  searched_names_ = names_of(searched_motions_);
  held_out_names_ = names_of(held_out_motions_);
  const std::vector<double> rest = rest_speeds_rad_per_s(searched_motions_, data, band_Hz_);
  searched_ = plan_rows(searched_motions_, rest, block_s_of(searched_motions_, band_Hz_));
  held_out_ = plan_rows(held_out_motions_, rest, block_s_of(held_out_motions_, band_Hz_));
  require_motion();
  for (const control::ArmLink& link : arm.arm.links)
    channels_.push_back({link.joint, link.slides ? "N" : "N·m"});
  floor_ = noise_floor_Nm(arm, data, band_Hz_).cwiseMax(1e-9);
  longest_delay_s_ = kLongestLag_s;
  has_linear_delay_ = true;
  ArmCatalogue catalogue =
      arm_catalogue(arm, top_speeds_rad_per_s(searched_motions_), options.ripples_per_rev);
  catalogue_ = std::move(catalogue.catalogue);
  terms_ = std::move(catalogue.terms);
  searched_load_Nm_ = robot_gap::compare(arm, searched_motions_, searched_, {}).predicted;
  held_out_load_Nm_ = robot_gap::compare(arm, held_out_motions_, held_out_, {}).predicted;
}

void ArmSubject::require_motion() const {
  if (searched_.blocks() < kFewestBlocks) {
    char text[200];
    std::snprintf(text, sizeof text,
                  "the recordings are too short: %d stretches of %.1f s in motion, at least %d are needed; "
                  "record more motion",
                  searched_.blocks(), kShortestBlock / band_Hz_, kFewestBlocks);
    throw std::invalid_argument(text);
  }
  if (held_out_.rows.empty())
    throw std::invalid_argument("no joint moves in the held-out recordings: hold out others");
}

control::ArmDescription ArmSubject::changed(const Eigen::VectorXd& changes) const {
  control::ArmDescription arm = given_;
  for (std::size_t k = 0; k < terms_.size(); ++k)
    if (const double by = changes[static_cast<Eigen::Index>(k)]; by != 0) change(arm, terms_[k], by);
  return arm;
}

ComparedRows ArmSubject::compare(Part part, const Fitted& at, std::span<const std::size_t> terms) const {
  std::vector<ArmTerm> wanted;
  for (const std::size_t term : terms) wanted.push_back(terms_[term]);
  wanted.push_back({ArmTerm::Kind::kLag});
  ComparedRows rows = robot_gap::compare(changed(at.changes), motions_of(part), plan(part), wanted);
  rows.predicted += at.delay_s * rows.columns.rightCols(1);
  return rows;
}

std::vector<Coordinate> ArmSubject::coordinates(Part part, std::size_t row) const {
  const RowPlan::Row& at = plan(part).rows[row];
  const ArmMotion& motion = motions_of(part)[at.motion];
  const auto sample = static_cast<Eigen::Index>(at.at * motion.step);
  const double v = motion.velocity_rad_per_s(at.channel, sample);
  const Eigen::VectorXd& load_Nm = part == Part::kSearched ? searched_load_Nm_ : held_out_load_Nm_;
  return {{"speed", "rad/s", at.channel, std::abs(v), kRanges},
          {"direction", "", at.channel, v > 0 ? 1.0 : -1.0, kDirections},
          {"pose", "rad", at.channel, motion.position_rad(at.channel, sample), kRanges},
          {"load", channels_[static_cast<std::size_t>(at.channel)].unit, at.channel,
           load_Nm[static_cast<Eigen::Index>(row)], kRanges}};
}

double ArmSubject::time_s(Part part, std::size_t row) const {
  const RowPlan::Row& at = plan(part).rows[row];
  const ArmMotion& motion = motions_of(part)[at.motion];
  return motion.start_s + static_cast<double>(at.at) * motion.row_s();
}

std::string ArmSubject::deciding_experiment(const Eigen::VectorXd& one, const Eigen::VectorXd& other,
                                            std::uint64_t seed) const {
  return deciding_pose(changed(one), changed(other), searched_motions_, floor_, seed);
}

}  // namespace identification::robot_gap
