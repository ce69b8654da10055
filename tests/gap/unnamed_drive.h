/// @file
/// Drives with friction and torques that no effect library lists: one mass, friction that stops it exactly, a
/// speed loop of the bench. Independent of model/ and sim/.
#pragma once
#include <cstdint>
#include <string_view>
#include <vector>

#include "identification/gap/gap.h"

namespace gap_test {

enum class Oddity : std::uint8_t {
  kNone,
  kSpeedWave,          ///< friction that rises and falls with speed
  kSpeedStep,          ///< more friction above a speed, at once
  kDetent,             ///< one catch in a turn, which pulls in and holds back
  kRelaxation,         ///< friction that decays after each reversal
  kEccentricViscous,   ///< viscous friction that differs around the turn
  kTwisted,            ///< friction that differs around the turn and grows with speed, by another law each
  kLoadTimesSpeed,     ///< friction in proportion to a weight's torque and to speed
  kWaveAndRelaxation,  ///< two of them
};
inline constexpr std::size_t kOddities = 9;
std::string_view name_of(Oddity oddity);

struct OddDrive {
  Oddity oddity = Oddity::kNone;
  double amount_Nm = 0.01;
  std::uint64_t seed = 1;  ///< of its shape
  double inertia_kg_m2 = 0.0112;
  double coulomb_Nm = 0.045;
  double viscous_Nm_s_per_rad = 0.0125;
  double weight_Nm = 0;  ///< of an arm; hangs at 0
  double noise_Nm = 1.5e-3;
};

/// `seed`: of the motion and the noise. A staircase of speeds, both ways, or a sum of sines of speed.
identification::gap::Source recording_of(const OddDrive& drive, bool staircase, std::uint64_t seed,
                                         double duration_s = 24);

}  // namespace gap_test
