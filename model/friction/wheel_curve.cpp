#include "model/friction/wheel_curve.h"

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <stdexcept>
#include <string>

// Coefficients and segment limits are from the thesis (appendix A.1 to A.4); units N·m and rad/s throughout.
namespace model::friction {
namespace {

/// (Σ rₙ^−n)^(−1/n), the smooth minimum that joins neighbouring curves. Scaled by the smallest term, because
/// r^−n of a torque near zero overflows a double.
double smooth_min(double n, std::initializer_list<double> terms) {
  const double smallest = *std::min_element(terms.begin(), terms.end());
  double sum = 0.0;
  for (const double term : terms) sum += std::pow(smallest / term, n);
  return smallest * std::pow(sum, -1.0 / n);
}

/// a·e^(b·v) + c·e^(d·v)
double exponentials(double v, double a, double b, double c, double d) {
  return a * std::exp(b * v) + c * std::exp(d * v);
}

/// The line that connects every curve to zero torque at rest.
double through_zero(double speed) { return 5 * speed + 1e-6; }

/// Magnitude of the part common to both directions, then the corrections of the negative branch.
double wheel_1(double v) {
  if (v <= -9.52) return 0.0551 * v + 0.1812;
  if (v <= -3.59) return exponentials(v, -4.42e5, 4.899, -0.05591, -0.1906);
  if (v <= -2.6) return exponentials(v, -0.003067, -1.606, 0.0007382, -1.966);

  const double s = std::abs(v);
  const auto r2 = [s] { return exponentials(s, 0.05615, -8.68, 0.04245, 0.2383); };
  const auto r3 = [s] { return exponentials(s, 0.07022, -0.1932, 7.554e-10, 6.858); };
  const auto r4 = [s] { return 0.07582 * s - 0.1201; };
  const auto r5 = [s] { return exponentials(s, 3.243e9, -7.739, 0.07271, 0.09647); };
  const auto magnitude = [&] {
    if (s < 0.7) return smooth_min(25, {through_zero(s), r2(), 0.06 + 0.4 * s, 0.071 + 0.01 * s});
    if (s < 1.5) return smooth_min(30, {r2(), r3()});
    if (s < 2.5) return r3();
    if (s < 3.2) return smooth_min(30, {r3(), r4()});
    if (s < 3.5) return smooth_min(20, {r4(), r5()});
    if (s < 4.59) return r5();
    return 0.0125 * s + 0.05584;
  };
  return std::copysign(magnitude(), v);
}

double wheel_2(double v) {
  if (v <= -9.46) return 0.03165 * v + 0.04064;
  if (v <= -3.09) return exponentials(v, -0.06804, -0.1412, -27.68, 2.221);

  const double s = std::abs(v);
  const auto r2 = [s] { return exponentials(s, 0.05139, -6.585, 0.04364, 0.2313); };
  const auto r3 = [s] { return exponentials(s, 0.05552, -0.08399, 1.937e-6, 4.167); };
  const auto r4 = [s] { return 0.08767 * s - 0.1249; };
  const auto r5 = [s] { return exponentials(s, 7.255e4, -4.762, 0.07822, 0.09864); };
  const auto magnitude = [&] {
    if (s < 0.4) return smooth_min(25, {through_zero(s), r2(), 0.06 + 0.5 * s, 0.077 + 0.01 * s});
    if (s < 1.5) return smooth_min(45, {r2(), r3()});
    if (s < 2.2) return r3();
    if (s < 2.9) return smooth_min(45, {r3(), r4()});
    if (s < 3.5) return smooth_min(20, {r4(), r5()});
    if (s < 5.89) return r5();
    return 0.01689 * s + 0.04036;
  };
  return std::copysign(magnitude(), v);
}

double wheel_3(double v) {
  if (v <= -9.6) return 0.05377 * v + 0.1425;
  if (v <= -3.53) return exponentials(v, -0.08219, -0.1575, -250.2, 2.62);
  if (v <= -2.59) return exponentials(v, 0.0201, -1.6094, -0.0248, -1.5578);

  const double s = std::abs(v);
  const auto r2 = [s] { return (0.4187 * s - 0.3006) * s + 0.1296; };
  const auto r3 = [s] { return (0.03022 * s - 0.08004) * s + 0.1077; };
  const auto r4 = [s] { return exponentials(s, 5306, -3.548, 0.09904, 0.08162); };
  const auto magnitude = [&] {
    if (s < 0.3) return smooth_min(40, {through_zero(s), r2(), 0.08195 + 0.25 * s, 0.105 + 0.01 * s});
    if (s < 1.0) return smooth_min(45, {r2(), r3()});
    if (s < 3.0) return r3();
    if (s < 5.89) return smooth_min(12, {r3(), r4()});
    return 0.01298 * s + 0.08432;
  };
  return std::copysign(magnitude(), v);
}

double wheel_4(double v) {
  if (v <= -9.15) return 0.08636 * v + 0.3112;
  if (v <= -3.31) return exponentials(v, -0.06523, -0.2179, -1801, 3.471);
  if (v <= -2.6) return exponentials(v, -0.008942, -1.0836, 2.27e-5, -2.6953);

  const double s = std::abs(v);
  const auto r2 = [s] { return (0.6494 * s - 0.3383) * s + 0.09933; };
  const auto r3 = [s] { return (0.1069 * s - 0.1064) * s + 0.07555; };
  const auto r5 = [s] { return (((0.1098 * s - 1.174) * s + 4.627) * s - 7.879) * s + 4.948; };
  const auto r6 = [s] { return exponentials(s, 2828, -3.707, 0.08658, 0.1062); };
  const auto magnitude = [&] {
    if (s < 0.2568) return smooth_min(10, {through_zero(s), r2(), 0.06255 + 0.4255 * s});
    if (s < 0.555) return r3();
    if (s < 1.867) return 0.008156 * s + 0.0449;
    if (s < 2.7) return r5();
    if (s < 5.34) return smooth_min(30, {r5(), r6()});
    return 0.01829 * s + 0.05499;
  };
  return std::copysign(magnitude(), v);
}

}  // namespace

double wheel_curve_Nm(int wheel, double velocity_rad_per_s) {
  if (wheel < 1 || wheel > 4)
    throw std::out_of_range("wheel curve: there is no wheel " + std::to_string(wheel) + " (1 to 4)");
  if (velocity_rad_per_s == 0.0) return 0.0;
  const double v = std::clamp(velocity_rad_per_s, -kIdentifiedSpeed_rad_per_s, kIdentifiedSpeed_rad_per_s);
  switch (wheel) {
    case 1: return wheel_1(v);
    case 2: return wheel_2(v);
    case 3: return wheel_3(v);
    default: return wheel_4(v);
  }
}

}  // namespace model::friction
