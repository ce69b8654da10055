#include "control/plausibility/wheel_agreement.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace control {
namespace {

/// Null space of LinkMap: no motion of the base turns the wheels like this, whatever the geometry.
const WheelVector kNullSpace{1, -1, -1, 1};

/// Length of the first blocks; they grow while the motion continues.
constexpr double kBlock_s = 0.010;
/// A block in which no wheel turns faster counts as rest.
constexpr double kRest_rad_per_s = 0.1;
/// Tolerated disagreement of the wheels for other reasons: rollers, radii, counts.
constexpr double kDisagreement_rad = 0.02;
constexpr double kDisagreementShare = 0.2;
/// Factors between these could also be slip or unequal wheels.
constexpr double kSmallestFactor = 0.6;
constexpr double kLargestFactor = 1.7;
/// A factor counts only if it is the same at every speed from rest on: each slipping wheel breaks away at its
/// own time and accelerates according to its own friction. Over shorter distances some of them agree by
/// chance.
struct Proof {
  double way_rad;      ///< of the wheel that turns most
  double unexplained;  ///< share of the wheel's motion in each block that its factor does not explain
  double speed_range;  ///< fastest block to slowest
};
constexpr Proof kScaled{1.6, 0.005, 4.0};
/// An encoder whose edges are lost or counted twice shows a whole multiple or part; slip shows any factor.
constexpr Proof kMiscounted{0.5, 0.006, 4.0};
constexpr double kMiscountedTolerance = 0.05;
constexpr double kWholeFactors = 4.0;
/// A driven wheel does not slip backwards.
constexpr Proof kReversed{0.1, 0.02, 2.5};
/// Tolerance between the motion of a scaled wheel, from rest to any block, and its factor: compliance of gear
/// and rollers, and a share of both motions for rollers that are not round.
constexpr double kGive_rad = 0.001;
constexpr double kRoundness = 0.004;
/// Minimum lead in the cosine between torques and motion: over an explanation that holds, and over one that
/// does not, such as a wheel that would have to stand still while it shows a motion.
constexpr double kClearlyBetter = 0.3;
constexpr double kBetter = 0.05;

bool miscounted(double factor) noexcept {
  const double multiple = factor > 1 ? factor : 1 / factor;
  const double whole = std::round(multiple);
  return whole <= kWholeFactors && std::abs(multiple - whole) < kMiscountedTolerance * whole;
}

}  // namespace

void WheelAgreement::restart() noexcept {
  known_ = false;
  count_ = 0;
  block_length_s_ = kBlock_s;
  block_ = {};
}

std::optional<int> WheelAgreement::update(const WheelVector& position_rad, const WheelVector& torque_Nm,
                                          const SampleTime& time) noexcept {
  if (known_) {
    block_.way_rad += position_rad - position_rad_;
    block_.torque_Nm_s += time.elapsed_s * torque_Nm;
    block_.duration_s += time.elapsed_s;
  } else if (time.unsure_s() > 0) {
    return std::nullopt;
  }
  known_ = true;
  position_rad_ = position_rad;
  if (block_.duration_s < block_length_s_ || time.unsure_s() > 0) return std::nullopt;

  if (block_.way_rad.cwiseAbs().maxCoeff() < kRest_rad_per_s * block_.duration_s) {
    count_ = 0;
    block_length_s_ = kBlock_s;
    block_ = {};
    return std::nullopt;
  }
  blocks_[count_++] = block_;
  block_ = {};
  const std::optional<int> wheel = judge();
  if (count_ == kBlocks) merge();
  return wheel;
}

void WheelAgreement::merge() noexcept {
  for (std::size_t i = 0; i < kBlocks / 2; ++i) {
    const Block& a = blocks_[2 * i];
    const Block& b = blocks_[2 * i + 1];
    blocks_[i] = {a.way_rad + b.way_rad, a.torque_Nm_s + b.torque_Nm_s, a.duration_s + b.duration_s};
  }
  count_ = kBlocks / 2;
  block_length_s_ *= 2;
}

std::optional<int> WheelAgreement::judge() const noexcept {
  if (count_ < kBlocks / 2) return std::nullopt;
  double disagreement_rad = 0.0;
  double way_rad = 0.0;
  for (std::size_t b = 0; b < count_; ++b) {
    disagreement_rad += kNullSpace.dot(blocks_[b].way_rad);
    way_rad += blocks_[b].way_rad.cwiseAbs().maxCoeff();
  }
  if (!(std::abs(disagreement_rad) > kDisagreement_rad + kDisagreementShare * way_rad)) return std::nullopt;

  std::array<Explanation, 4> explanations;
  for (std::size_t wheel = 0; wheel < 4; ++wheel) explanations[wheel] = explain(static_cast<int>(wheel));
  if (std::none_of(explanations.begin(), explanations.end(), [](const Explanation& e) { return e.holds; }))
    return std::nullopt;
  const auto best =
      std::max_element(explanations.begin(), explanations.end(),
                       [](const Explanation& a, const Explanation& b) { return a.cosine < b.cosine; });
  const bool clear = std::all_of(explanations.begin(), explanations.end(), [&best](const Explanation& other) {
    return &other == &*best || other.cosine < best->cosine - (other.holds ? kClearlyBetter : kBetter);
  });
  return best->holds && clear ? static_cast<int>(best - explanations.begin()) : -1;
}

WheelAgreement::Explanation WheelAgreement::explain(int wheel) const noexcept {
  double xx = 0.0;
  double xy = 0.0;
  double yy = 0.0;
  double way_rad = 0.0;
  double slowest = std::numeric_limits<double>::infinity();
  double fastest = 0.0;
  double power = 0.0;
  double torque = 0.0;
  double motion = 0.0;
  for (std::size_t b = 0; b < count_; ++b) {
    const Block& block = blocks_[b];
    const WheelVector mended_rad = mended(block, wheel);
    const double x = mended_rad[wheel];
    const double y = block.way_rad[wheel];
    xx += x * x;
    xy += x * y;
    yy += y * y;
    way_rad += block.way_rad.cwiseAbs().maxCoeff();
    slowest = std::min(slowest, std::abs(x) / block.duration_s);
    fastest = std::max(fastest, std::abs(x) / block.duration_s);
    power += block.torque_Nm_s.dot(mended_rad);
    torque += block.torque_Nm_s.squaredNorm();
    motion += mended_rad.squaredNorm();
  }
  if (!(xx > 0 && yy > 0 && torque > 0)) return {};
  const double factor = xy / xx;
  // Residual of y with the best factor, relative.
  const double unexplained = std::sqrt(std::max(0.0, yy - xy * xy / xx) / yy);
  const bool scaled = (factor > 0 && factor < kSmallestFactor) || factor > kLargestFactor;
  const Proof& proof = factor < 0 ? kReversed : miscounted(factor) ? kMiscounted : kScaled;
  return {(scaled ? on_a_line(wheel) : factor < 0) && way_rad > proof.way_rad &&
              unexplained < proof.unexplained && fastest > proof.speed_range * slowest,
          power / std::sqrt(torque * motion)};
}

WheelVector WheelAgreement::mended(const Block& block, int wheel) noexcept {
  WheelVector way_rad = block.way_rad;
  way_rad[wheel] -= kNullSpace[wheel] * kNullSpace.dot(block.way_rad);
  return way_rad;
}

bool WheelAgreement::on_a_line(int wheel) const noexcept {
  std::array<double, kBlocks> true_rad{};  // from rest to the end of each block
  std::array<double, kBlocks> read_rad{};
  double x = 0.0;
  double y = 0.0;
  double xx = 0.0;
  double xy = 0.0;
  for (std::size_t b = 0; b < count_; ++b) {
    true_rad[b] = x += mended(blocks_[b], wheel)[wheel];
    read_rad[b] = y += blocks_[b].way_rad[wheel];
    xx += x * x;
    xy += x * y;
  }
  if (!(xx > 0)) return false;
  for (std::size_t b = 0; b < count_; ++b)
    if (!(std::abs(read_rad[b] - xy / xx * true_rad[b]) <
          kGive_rad + kRoundness * (std::abs(true_rad[b]) + std::abs(read_rad[b]))))
      return false;
  return true;
}

}  // namespace control
