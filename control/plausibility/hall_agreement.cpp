#include "control/plausibility/hall_agreement.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace control {
namespace {

/// Half a sector of the three Hall sensors, and the tolerance of their edges: mounting, hysteresis, and the
/// age of the encoder's count.
constexpr double kHalfSector_turn = 1.0 / 12;
constexpr double kTolerance_turn = 25.0 / 360;
/// A reading is compared with all that the encoder showed meanwhile. Over this span, it still excludes a
/// sixth of the constants.
constexpr double kJudgedSpan_turn = 0.5;
/// Number of contradictions that excludes a constant.
constexpr double kEnough = 3;
constexpr double kRemembered = 6;
/// A valid constant has fewer contradictions than this; a judgement older than half a second does not count.
constexpr double kHolds = 1;
constexpr double kFresh_s = 0.5;
/// The contradictions are multiplied by kKept each time the motor has turned by this much.
constexpr double kForgetting_turn = 1.0 / 16;
constexpr double kKept = 0.94;

/// Distance of two angles the shorter way round.
double distance_turn(double a, double b) noexcept {
  const double difference = a - b;
  return std::abs(difference - std::round(difference));
}

}  // namespace

void HallAgreement::restart() noexcept {
  for (auto& sense : contradicted_) sense.fill(0.0);
  begun_ = false;
}

bool HallAgreement::update(const hal::RotorReading& reading, double elapsed_s) noexcept {
  unjudged_s_ += elapsed_s;
  unread_s_ += elapsed_s;
  if (reading.number == number_) return false;
  number_ = reading.number;
  unread_s_ = 0.0;
  if (number_ == 0) return false;
  // The first reading after a restart may have begun before it.
  if (!begun_) {
    begun_ = true;
    encoder_turn_ = reading.encoder_low_turn;
    return false;
  }
  // Negated so that NaN is not judged.
  if (!(reading.encoder_high_turn - reading.encoder_low_turn <= kJudgedSpan_turn)) return false;
  unjudged_s_ = 0.0;
  judge(reading);
  if (!turns(reading.hall_turn)) return false;
  return std::min(least_contradicted(0), least_contradicted(1)) >= kEnough;
}

int HallAgreement::sense() const noexcept {
  if (unjudged_s_ > kFresh_s) return 0;
  if (least_contradicted(0) < kHolds && least_contradicted(1) >= kEnough) return 1;
  if (least_contradicted(1) < kHolds && least_contradicted(0) >= kEnough) return -1;
  return 0;
}

bool HallAgreement::contradicted() const noexcept {
  return places_ > 2 && std::min(least_contradicted(0), least_contradicted(1)) >= kHolds;
}

double HallAgreement::least_contradicted(std::size_t sense) const noexcept {
  return *std::ranges::min_element(contradicted_[sense]);
}

void HallAgreement::judge(const hal::RotorReading& reading) noexcept {
  const double encoder_turn = std::midpoint(reading.encoder_low_turn, reading.encoder_high_turn);
  const double half_span_turn = (reading.encoder_high_turn - reading.encoder_low_turn) / 2;
  const double allowed_turn = kHalfSector_turn + kTolerance_turn + half_span_turn + 0.5 / kOffsets;
  const bool moved = std::abs(encoder_turn - encoder_turn_) >= kForgetting_turn;
  if (moved) encoder_turn_ = encoder_turn;
  for (std::size_t sense = 0; sense < contradicted_.size(); ++sense) {
    const double turned = sense == 0 ? encoder_turn : -encoder_turn;
    for (std::size_t i = 0; i < kOffsets; ++i) {
      const double offset = static_cast<double>(i) / kOffsets;
      double& times = contradicted_[sense][i];
      if (moved) times *= kKept;
      if (distance_turn(reading.hall_turn, turned + offset) > allowed_turn)
        times = std::min(times + 1, kRemembered);
    }
  }
}

/// Whether the Hall sensors have shown three different angles.
bool HallAgreement::turns(double hall_turn) noexcept {
  constexpr double kElsewhere_turn = 0.1;
  if (places_ > 2) return true;
  for (int i = 0; i < places_; ++i)
    if (distance_turn(seen_[static_cast<std::size_t>(i)], hall_turn) < kElsewhere_turn) return false;
  if (places_ < 2) seen_[static_cast<std::size_t>(places_)] = hall_turn;
  return ++places_ > 2;
}

}  // namespace control
