#include "runtime/station/station_values.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace runtime {
namespace {

using drivers::station::ForceState;
using drivers::station::HandleState;

constexpr double kQ30 = 1 << 30;

template <typename Integer>
Integer rounded(double value) noexcept {
  if (std::isnan(value)) return 0;
  // Of the 64-bit limits only powers of two are exact as a double.
  constexpr double kLimit =
      sizeof(Integer) == 8 ? 0x1p62 : static_cast<double>(std::numeric_limits<Integer>::max());
  return static_cast<Integer>(std::llround(std::clamp(value, -kLimit, kLimit)));
}

std::array<std::int32_t, 3> scaled(const Eigen::Vector3d& v, double scale) noexcept {
  return {rounded<std::int32_t>(scale * v.x()), rounded<std::int32_t>(scale * v.y()),
          rounded<std::int32_t>(scale * v.z())};
}

Eigen::Vector3d unscaled(const std::array<std::int32_t, 3>& v, double scale) noexcept {
  return scale * Eigen::Vector3d(v[0], v[1], v[2]);
}

}  // namespace

HandleState to_link(const hal::HapticSample& sample, const Eigen::Vector3d& held_N,
                    std::chrono::nanoseconds age) noexcept {
  HandleState state;
  const auto age_us = std::chrono::duration_cast<std::chrono::microseconds>(age).count();
  state.age_us = static_cast<std::uint32_t>(std::clamp<std::int64_t>(age_us, 0, UINT32_MAX));
  state.position_nm = scaled(sample.p_HD_m, 1e9);
  const Eigen::Quaterniond& q = sample.q_HD;
  const double norm = q.norm();
  if (norm > 0 && std::isfinite(norm))
    state.rotation_q30 = {
        rounded<std::int32_t>(kQ30 * q.w() / norm), rounded<std::int32_t>(kQ30 * q.x() / norm),
        rounded<std::int32_t>(kQ30 * q.y() / norm), rounded<std::int32_t>(kQ30 * q.z() / norm)};
  state.buttons = sample.buttons;
  state.force_uN = scaled(held_N, 1e6);
  return state;
}

ForceState to_link(const Eigen::Vector3d& force_N) noexcept { return {scaled(force_N, 1e6)}; }

std::int64_t energy_to_link(double energy_J) noexcept { return rounded<std::int64_t>(1e9 * energy_J); }

void from_link(const HandleState& state, hal::HapticSample& sample) noexcept {
  sample.p_HD_m = unscaled(state.position_nm, 1e-9);
  const auto& q = state.rotation_q30;
  sample.q_HD = Eigen::Quaterniond(q[0] / kQ30, q[1] / kQ30, q[2] / kQ30, q[3] / kQ30).normalized();
  sample.buttons = state.buttons;
}

Eigen::Vector3d force_from_link(const std::array<std::int32_t, 3>& force_uN) noexcept {
  return unscaled(force_uN, 1e-6);
}

}  // namespace runtime
