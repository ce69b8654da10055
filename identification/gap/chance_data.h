/// @file
/// Residuals as chance might have dealt them.
#pragma once
#include <Eigen/Core>
#include <cstdint>
#include <random>

namespace identification::gap {

/// Draws from a residual: its stretches stand elsewhere, each with a random sign. That keeps its size and
/// colour and destroys what it has to do with the motion. [block bootstrap; H. R. Künsch, Ann. Statist. 17,
/// 1989]
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
