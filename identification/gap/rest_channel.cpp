#include "identification/gap/rest_channel.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <string>
#include <utility>
#include <vector>

#include "identification/fit/statistics.h"
#include "identification/gap/sign_test.h"
#include "identification/gap/zero_phase.h"

namespace identification::gap {
namespace {

constexpr double kWidest_Hz = 20;
/// Relative to the model's Coulomb torque: below it rests, even if breakaway is unknown.
constexpr double kHolds = 0.9;
/// Minimum swing of torque, relative to the Coulomb torque.
constexpr double kMinSwing = 0.1;
/// Stretches below and above this share of the Coulomb torque must agree.
constexpr double kLittleSwing = 0.5;
/// Minimum ratio of the slopes under small torque to those under large torque.
constexpr double kMinAgreement = 0.3;
constexpr double kMaxAgreement = 2;
/// Coasting and filter effects: left out at both ends of a rest.
constexpr double kSettleAtRest_s = 0.1;
constexpr double kMin_s = 0.25;
constexpr double kRestPiece_s = 1;
constexpr std::size_t kMinPieces = 8;
constexpr std::size_t kMinRestSamples = 10;  // of a piece
constexpr std::size_t kMinPiecesPerGroup = 3;

struct Piece {
  double slope;       // rad/(N·m)
  double square_rad;  // about the mean
  double product;     // of displacement and torque about their means
  double torque_square;
  double swing_Nm;  // half of the torque range
  double left(double compliance) const {
    return square_rad - 2 * compliance * product + compliance * compliance * torque_square;
  }
};

Piece piece_of(std::span<const double> position, std::span<const double> torque) {
  const auto n = static_cast<double>(position.size());
  double x = 0;
  double t = 0;
  for (std::size_t i = 0; i < position.size(); ++i) {
    x += position[i] / n;
    t += torque[i] / n;
  }
  Piece piece{};
  for (std::size_t i = 0; i < position.size(); ++i) {
    piece.square_rad += (position[i] - x) * (position[i] - x);
    piece.product += (position[i] - x) * (torque[i] - t);
    piece.torque_square += (torque[i] - t) * (torque[i] - t);
  }
  const auto [low, high] = std::ranges::minmax(torque);
  piece.swing_Nm = 0.5 * (high - low);
  piece.slope = piece.torque_square > 0 ? piece.product / piece.torque_square : 0;
  return piece;
}

/// Stretches of one recording in which the joint rests while the torque changes.
void add_pieces(const Signals& s, const Band& band, double coulomb_Nm, std::vector<Piece>& pieces) {
  const double cutoff_Hz = std::min(kWidest_Hz, 0.1 / s.raw_period_s);
  const std::vector<double> position = zero_phase(s.raw_position_rad, s.raw_period_s, cutoff_Hz);
  const std::vector<double> torque = zero_phase(s.raw_torque_Nm, s.raw_period_s, cutoff_Hz);
  const std::vector<double> velocity = derivative(position, s.raw_period_s);
  const auto samples = [&](double seconds) { return static_cast<std::size_t>(seconds / s.raw_period_s); };
  if (samples(kMin_s) < kMinRestSamples) return;
  const auto rests = [&](std::size_t i) {
    return std::abs(velocity[i]) <= band.slowest_rad_per_s && std::abs(torque[i]) <= kHolds * coulomb_Nm;
  };
  for (std::size_t first = 0; first < position.size();) {
    std::size_t last = first;
    while (last < position.size() && rests(last)) ++last;
    if (last - first > 2 * samples(kSettleAtRest_s)) {
      const std::size_t from = first + samples(kSettleAtRest_s);
      const std::size_t count = last - samples(kSettleAtRest_s) - from;
      const std::size_t parts = std::max<std::size_t>(1, count / samples(kRestPiece_s));
      const std::size_t length = count / parts;
      for (std::size_t p = 0; p < parts && length >= samples(kMin_s); ++p) {
        const std::size_t begin = from + p * length;
        const Piece piece =
            piece_of(std::span(position).subspan(begin, length), std::span(torque).subspan(begin, length));
        if (piece.swing_Nm >= kMinSwing * coulomb_Nm) pieces.push_back(piece);
      }
    }
    first = last + 1;
  }
}

template <class Chosen>
std::vector<double> slopes(const std::vector<Piece>& pieces, const Chosen& chosen) {
  std::vector<double> result;
  for (std::size_t i = 0; i < pieces.size(); ++i)
    if (chosen(i, pieces[i])) result.push_back(pieces[i].slope);
  return result;
}

}  // namespace

RestFindings rest_channel(std::span<const Signals> signals, const model::effects::DriveModel& base,
                          const Band& band, const Options& options) {
  RestFindings findings;
  const auto* coulomb = base.find<model::effects::Coulomb>();
  if (coulomb == nullptr) return findings;
  const double coulomb_Nm = coulomb->parameters().torque_Nm;
  std::vector<Piece> pieces;
  for (const Signals& s : signals) add_pieces(s, band, coulomb_Nm, pieces);
  findings.rests = pieces.size() >= kMinPieces;
  if (!findings.rests || base.find<model::effects::Presliding>() != nullptr) return findings;

  // Each half of the pieces is judged with the result of the other half.
  const double odd = fit::median(slopes(pieces, [](std::size_t i, const Piece&) { return i % 2 == 1; }));
  const double even = fit::median(slopes(pieces, [](std::size_t i, const Piece&) { return i % 2 == 0; }));
  std::vector<double> before;
  std::vector<double> after;
  std::vector<double> gains;
  double widest_Nm = 0;
  for (std::size_t i = 0; i < pieces.size(); ++i) {
    before.push_back(pieces[i].square_rad);
    after.push_back(pieces[i].left(i % 2 == 1 ? even : odd));
    gains.push_back(before.back() > 0 ? 1 - after.back() / before.back() : -1);
    widest_Nm = std::max(widest_Nm, pieces[i].swing_Nm);
  }
  const double compliance = fit::median(slopes(pieces, [](std::size_t, const Piece&) { return true; }));
  const double chance = chance_of(before, after);
  const double gain = fit::median(gains);
  if (!(compliance > 0) || chance > options.false_positive_rate || gain < options.least_gain) return findings;
  if (2 * compliance * widest_Nm < band.resolution_rad) return findings;

  const auto little =
      slopes(pieces, [&](std::size_t, const Piece& p) { return p.swing_Nm < kLittleSwing * coulomb_Nm; });
  const auto much =
      slopes(pieces, [&](std::size_t, const Piece& p) { return p.swing_Nm >= kLittleSwing * coulomb_Nm; });
  const bool both = little.size() >= kMinPiecesPerGroup && much.size() >= kMinPiecesPerGroup;
  if (both) {
    const double agreement = fit::median(little) / fit::median(much);
    if (!(agreement > kMinAgreement && agreement < kMaxAgreement)) return findings;
  }

  std::vector<double> off;
  for (const Piece& piece : pieces) off.push_back(piece.slope - compliance);
  const auto n = static_cast<double>(pieces.size());
  // Interval of a median. [Kendall & Stuart, vol. 1: √(π/2) times that of the mean]
  const double half = fit::student_975(n - 1) * 1.2533 * fit::robust_sigma(std::move(off)) / std::sqrt(n);
  const double stiffness = 1 / compliance;
  const auto& range = model::effects::effect_description("presliding").parameters[0];
  if (stiffness < range.lower || stiffness > range.upper) return findings;
  FoundEffect found{
      .effect = model::effects::make_effect("presliding", {{"stiffness_Nm_per_rad", stiffness}}),
      .where = {.coordinate = "torque_measured_Nm", .from = -widest_Nm, .to = widest_Nm}};
  found.measured_on = "displacement at rest";
  found.held_out_gain = gain;
  found.blocks = static_cast<int>(pieces.size());
  for (std::size_t i = 0; i < pieces.size(); ++i) found.blocks_improved += after[i] < before[i] ? 1 : 0;
  found.p_value = chance;
  const double usual_rad = compliance * widest_Nm / std::sqrt(2.0);  // of a sine
  found.gap_before = stiffness * usual_rad;
  found.gap_after = found.gap_before * std::sqrt(std::max(0.0, 1 - gain));
  found.parameters = {{.name = "stiffness_Nm_per_rad",
                       .value = stiffness,
                       .lower = 1 / (compliance + half),
                       .upper = half < compliance ? 1 / (compliance - half) : 1e8}};
  // Stretches of one size do not distinguish the two: no draw of the noise could decide.
  if (!both) found.equivalent = {"elasticity"};
  findings.presliding = std::move(found);
  return findings;
}

}  // namespace identification::gap
