#include "apps/youbot_bench/thesis/law_sweep.h"

#include <algorithm>
#include <cmath>

namespace youbot_bench::thesis {

LawSweep sweep(const model::friction::AnyLaw& law, const std::function<double(double)>& position_rad,
               double duration_s, double step_s) {
  LawSweep swept;
  model::friction::State state;
  const auto steps = static_cast<long long>(std::llround(duration_s / step_s));
  double before_rad = position_rad(0);
  for (long long n = 1; n <= steps; ++n) {
    const double time_s = static_cast<double>(n) * step_s;
    const double now_rad = position_rad(time_s);
    const double velocity = (now_rad - before_rad) / step_s;
    swept.time_s.push_back(time_s);
    swept.position_rad.push_back(now_rad);
    swept.velocity_rad_per_s.push_back(velocity);
    swept.torque_Nm.push_back(law.step(state, {.velocity_rad_per_s = velocity}, step_s));
    before_rad = now_rad;
  }
  return swept;
}

LawSweep through(const model::friction::AnyLaw& law, std::span<const double> points_rad,
                 double speed_rad_per_s, double step_s) {
  std::vector<double> times_s{0};
  for (std::size_t i = 1; i < points_rad.size(); ++i)
    times_s.push_back(times_s.back() + std::abs(points_rad[i] - points_rad[i - 1]) / speed_rad_per_s);
  const auto position_rad = [&](double time_s) {
    const auto next = std::ranges::upper_bound(times_s, time_s);
    if (next == times_s.end()) return points_rad.back();
    const auto i = static_cast<std::size_t>(next - times_s.begin());
    const double share = (time_s - times_s[i - 1]) / (times_s[i] - times_s[i - 1]);
    return std::lerp(points_rad[i - 1], points_rad[i], share);
  };
  return sweep(law, position_rad, times_s.back(), step_s);
}

}  // namespace youbot_bench::thesis
