#include "control/speed_proof.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>
#include <vector>

namespace control {
namespace speed_proof_test {

struct Sample {
  double position_rad;
  SampleBounds taken;
};

/// Between two of the samples up to the last the joint went further than the limit allows in the longest time
/// that can have passed.
bool proven(const std::vector<Sample>& samples, double limit_rad_per_s) {
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const double longest_s = samples.back().taken.latest_s - samples[i].taken.earliest_s;
    if (std::abs(samples.back().position_rad - samples[i].position_rad) > limit_rad_per_s * longest_s + 1e-12)
      return true;
  }
  return false;
}

/// Samples of a joint at this speed, each taken at any time within bounds as wide as `most_s`.
std::vector<Sample> samples_at(double speed_rad_per_s, double most_s, std::mt19937_64& random) {
  std::uniform_real_distribution<double> wide(0, most_s);
  std::vector<Sample> samples;
  double earliest_s = 0;
  for (int n = 0; n < 300; ++n) {
    const double latest_s = earliest_s + wide(random);
    const double taken_s = std::uniform_real_distribution(earliest_s, latest_s)(random);
    samples.push_back({speed_rad_per_s * taken_s, {earliest_s, latest_s}});
    earliest_s = latest_s + 0.001;
  }
  return samples;
}

TEST(SpeedProof, FindsWhatAnyTwoSamplesProveAndNothingElse) {
  std::mt19937_64 random(1);
  constexpr double kLimit = 3.0;
  int found = 0;
  for (const double most_s : {0.0, 0.002, 0.02})
    for (const double speed : {1.0, 2.9, -2.9, 3.1, -3.1, 4.0, -6.0, 20.0}) {
      SpeedProof proof(kLimit);
      std::vector<Sample> so_far;
      bool any = false;
      for (const Sample& sample : samples_at(speed, most_s, random)) {
        so_far.push_back(sample);
        proof.update(sample.position_rad, sample.taken);
        EXPECT_EQ(proof.too_fast(), proven(so_far, kLimit)) << speed << " rad/s, " << so_far.size();
        any = any || proof.too_fast();
      }
      if (std::abs(speed) < kLimit) {
        EXPECT_FALSE(any) << speed;
      }
      found += any ? 1 : 0;
    }
  EXPECT_EQ(found, 15) << "each speed above the limit";
}

TEST(SpeedProof, ForgetsWhatCameBeforeARestart) {
  SpeedProof proof(3.0);
  proof.update(0.0, {0.0, 0.0});
  proof.restart();
  proof.update(2.0, {0.001, 0.001});
  EXPECT_FALSE(proof.too_fast());
  proof.update(2.004, {0.002, 0.002});
  EXPECT_TRUE(proof.too_fast());
}

TEST(SpeedProof, AFilteredVelocityIsJudgedByTheProofAndWhatIsNoNumberIsTooFast) {
  SpeedProof proof(3.0);
  proof.update(0.0, {0.0, 0.0});
  EXPECT_FALSE(is_too_fast(5.0, 3.0, proof));
  EXPECT_TRUE(is_too_fast(std::numeric_limits<double>::quiet_NaN(), 3.0, proof));
  proof.update(0.1, {0.001, 0.002});
  EXPECT_TRUE(is_too_fast(5.0, 3.0, proof));
  EXPECT_TRUE(is_too_fast(-5.0, 3.0, proof));
  EXPECT_FALSE(is_too_fast(2.0, 3.0, proof)) << "what the filter does not see may be one wrong reading";
}

}  // namespace speed_proof_test
}  // namespace control
