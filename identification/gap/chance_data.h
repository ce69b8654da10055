/// @file
/// Residuals redrawn by chance.
#pragma once
#include <Eigen/Core>
#include <cstdint>
#include <random>

namespace identification::gap {

/// Draws from a residual: its stretches are moved, each with a random sign. This keeps its size and spectrum
/// and destroys its relation to the motion. [block bootstrap; H. R. Künsch, Ann. Statist. 17, 1989]
class ChanceData {
 public:
  ChanceData(Eigen::VectorXd residual, std::uint64_t seed);
  Eigen::VectorXd draw();

 private:
  Eigen::VectorXd residual_;
  std::mt19937_64 random_;
  Eigen::Index stretch_;
};

}  // namespace identification::gap
