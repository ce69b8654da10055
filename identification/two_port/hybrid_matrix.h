/// @file
/// The hybrid matrix of a teleoperator, estimated from recordings.
///
/// Convention: [F_h; -V_s] = H·[V_m; F_e] with F_h the force of the hand on the haptic device, V_m the
/// device's velocity, V_s the slave's, F_e the force of the slave on its environment, F_e = Z_e·V_s. N and
/// m/s in one direction at both ends; h11 [N·s/m], h12 [1], h21 [1], h22 [m/(N·s)]. Ideal: h11 = h22 = 0, h12
/// = 1, h21 = -1. [B. Hannaford, IEEE Trans. Robotics and Automation 5:426, 1989]
#pragma once
#include <Eigen/Core>
#include <array>
#include <complex>
#include <cstddef>
#include <string>
#include <vector>

namespace identification::two_port {

/// Both ports, evenly sampled in step with the excitation: whole periods, all in steady state.
struct PortRecord {
  std::vector<double> excitation_N;  ///< force intended to be added to the hand's; may be only part of F_h
  std::vector<double> hand_force_N;
  std::vector<double> master_velocity_m_per_s;
  std::vector<double> environment_force_N;
  std::vector<double> slave_velocity_m_per_s;
};

/// The same environment in all of its records; the phases of the excitation should differ.
struct PortExperiment {
  std::string environment;  ///< "free", "clamped", for messages
  std::vector<PortRecord> records;
};

/// The four signals of a record without the excitation, in its order.
inline constexpr std::size_t kChannels = 4;

struct HybridPoint {
  double frequency_Hz = 0.0;
  Eigen::Matrix2cd H = Eigen::Matrix2cd::Zero();
  /// Standard deviation of each element of H, from the differences between the periods, assuming independent
  /// channel noise.
  Eigen::Matrix2d deviation = Eigen::Matrix2d::Zero();
  /// |Σ Y·R*|²/(Σ|Y|²·Σ|R|²) over all periods, R the excitation; the minimum over the experiments. An
  /// experiment in which a channel is silent is excluded: force without contact, velocity of a clamp.
  std::array<double, kChannels> coherence{};
  /// Condition number of the scaled [V_m; F_e] over the experiments: how different they are.
  double condition = 0.0;
  bool ok = false;  ///< false: discarded because of coherence or condition
};

struct EstimateLimits {
  double lowest_coherence = 0.9;
  double largest_condition = 1e3;
  /// A channel with less than this share of its power in another experiment is silent: noise of 3 % of the
  /// result, less after averaging.
  double silent_share = 1e-3;
};

/// One point for each of `harmonics` (multiples of 1/period), ascending. From averages over all periods
/// against the excitation, so that sensor noise cancels instead of causing a bias; least squares if there are
/// more than two experiments.
/// @throws std::invalid_argument naming the experiment and record that does not fit, or if there are fewer
/// than two experiments, or fewer than two periods in one of them.
std::vector<HybridPoint> estimate_hybrid_matrix(const std::vector<PortExperiment>& experiments,
                                                const std::vector<std::size_t>& harmonics,
                                                std::size_t samples_per_period, double sample_s,
                                                const EstimateLimits& limits = {});

}  // namespace identification::two_port
