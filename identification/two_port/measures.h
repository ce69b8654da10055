/// @file
/// Transparency and tracking measures from a teleoperator's hybrid matrix.
///
/// Convention and units of H as in identification/two_port/hybrid_matrix.h. Measures after D. A. Lawrence,
/// IEEE Trans. Robotics and Automation 9:624, 1993 (transparency); J. E. Colgate, J. M. Brown, ICRA 1994
/// (Z-width); M. C. Çavuşoğlu and others, IEEE Trans. Robotics and Automation 18:641, 2002 (fidelity).
#pragma once
#include <Eigen/Core>
#include <complex>
#include <optional>
#include <string>
#include <vector>

#include "identification/two_port/hybrid_matrix.h"

namespace identification::two_port {

/// Z_e = m·s + b + k/s.
struct PortEnvironment {
  std::string name;
  double stiffness_N_per_m = 0.0;
  double damping_N_s_per_m = 0.0;
  double mass_kg = 0.0;

  std::complex<double> impedance_N_s_per_m(double frequency_Hz) const;
};
/// Soft, medium and hard: 200, 1000 and 5000 N/m, damping 2, 5 and 10 N·s/m [assumption].
std::vector<PortEnvironment> usual_environments();

/// Impedance felt by the hand: Z_t = h11 - h12·h21·Z_e/(1 + h22·Z_e).
std::complex<double> transmitted_impedance(const Eigen::Matrix2cd& H, std::complex<double> Z_e);
/// dZ_t/dZ_e = -h12·h21/(1 + h22·Z_e)²: how well a change of Z_e is felt; ideal 1.
std::complex<double> transmitted_change(const Eigen::Matrix2cd& H, std::complex<double> Z_e);
/// Z_t of a clamped slave minus that of a free one, -h12·h21/h22.
std::complex<double> impedance_width(const Eigen::Matrix2cd& H);
/// Llewellyn's η = (2·Re h11·Re h22 - Re(h12·h21))/|h12·h21|. Stable with every passive hand and environment
/// if η is at least 1 and neither Re h11 nor Re h22 is negative.
double llewellyn_stability(const Eigen::Matrix2cd& H);
bool unconditionally_stable(const Eigen::Matrix2cd& H);

/// How well one end follows the other.
struct Tracking {
  double low_frequency_gain = 0.0;  ///< mean over the lowest measured octave
  /// Frequency at which the gain has first fallen by 3 dB from that; empty if it never does within the band.
  std::optional<double> bandwidth_Hz;
};

struct FeltEnvironment {
  std::string name;
  /// |ln(Z_t/Z_e)|, mean over the logarithm of frequency: 0.1 is 10 % or 6°. Ideal 0.
  double transparency_error = 0.0;
  /// Root mean square of |dZ_t/dZ_e| from the lowest frequency to `fidelity_band_Hz`. Ideal 1.
  double fidelity = 0.0;
};

struct TwoPortMeasures {
  Tracking position;             ///< -h21
  Tracking force;                ///< h12
  double scaling_product = 0.0;  ///< of the two gains at low frequency; at 1 power is conserved
  std::vector<FeltEnvironment> environments;
  /// Share of the points at which Llewellyn's criterion holds, and the first at which it does not.
  double stable_share = 0.0;
  std::optional<double> unstable_from_Hz;
  std::size_t discarded = 0;  ///< number of ignored points
};

/// Ignores points that are not ok. The functions above give the free-air impedance |h11|, Z-width and Z_t
/// over frequency.
/// @throws std::invalid_argument if fewer than three points are ok.
TwoPortMeasures measure(const std::vector<HybridPoint>& measured,
                        const std::vector<PortEnvironment>& environments, double fidelity_band_Hz = 40.0);

}  // namespace identification::two_port
