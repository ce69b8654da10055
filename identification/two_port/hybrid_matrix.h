/// @file
/// The hybrid matrix of a teleoperator, estimated from recordings.
///
/// Convention: [F_h; -V_s] = H·[V_m; F_e] with F_h the force of the hand on the master, V_m the master's
/// velocity, V_s the slave's, F_e the force of the slave on its environment, F_e = Z_e·V_s. N and m/s in one
/// direction at both ends; h11 [N·s/m], h12 [1], h21 [1], h22 [m/(N·s)]. Ideal: h11 = h22 = 0, h12 = 1,
/// h21 = -1. [B. Hannaford, IEEE Trans. Robotics and Automation 5:426, 1989]
#pragma once
#include <Eigen/Core>
#include <array>
#include <complex>
#include <cstddef>
#include <string>
#include <vector>

namespace identification::two_port {

/// Both ports in even time, in step with the excitation: whole periods, all after everything has settled.
struct PortRecord {
  std::vector<double> excitation_N;  ///< what was meant to be added to the hand; need not be all of F_h
  std::vector<double> hand_force_N;
  std::vector<double> master_velocity_m_per_s;
  std::vector<double> environment_force_N;
  std::vector<double> slave_velocity_m_per_s;
};

/// The same environment in all of its records, the phases of the excitation better not.
struct PortExperiment {
  std::string environment;  ///< "free", "clamped", for messages
  std::vector<PortRecord> records;
};

/// The four signals of a record but the excitation, in its order.
inline constexpr std::size_t kChannels = 4;

struct HybridPoint {
  double frequency_Hz = 0.0;
  Eigen::Matrix2cd H = Eigen::Matrix2cd::Zero();
  /// Standard deviation of each element of H, from how much the periods differ; as if noise of the channels
  /// were independent.
  Eigen::Matrix2d deviation = Eigen::Matrix2d::Zero();
  /// |Σ Y·R*|²/(Σ|Y|²·Σ|R|²) over all periods, R the excitation; the lowest of the experiments. One in
  /// which a channel is silent does not count: the force on nothing, the velocity of a clamp.
  std::array<double, kChannels> coherence{};
  /// Of [V_m; F_e] over the experiments, scaled: how differently they went.
  double condition = 0.0;
  bool ok = false;  ///< false: discarded, for coherence or condition
};

struct EstimateLimits {
  double lowest_coherence = 0.9;
  double largest_condition = 1e3;
  /// A channel with less than this share of the power that it has in another experiment is silent: noise of
  /// 3 % of what is solved for, and less by averaging.
  double silent_share = 1e-3;
};

/// One point for each of `harmonics` (multiples of 1/period), rising as they do. From averages over all
/// periods against the excitation, so that noise of the sensors cancels instead of making a bias; least
/// squares where there are more than two experiments.
/// @throws std::invalid_argument naming the experiment and record that does not fit, or when there are fewer
/// than two experiments, or fewer than two periods in one of them.
std::vector<HybridPoint> estimate_hybrid_matrix(const std::vector<PortExperiment>& experiments,
                                                const std::vector<std::size_t>& harmonics,
                                                std::size_t samples_per_period, double sample_s,
                                                const EstimateLimits& limits = {});

}  // namespace identification::two_port
