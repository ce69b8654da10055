#include "model/effects/basis.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <vector>

namespace model::effects {

double sliding_torque_Nm(const EffectChain& effects, double velocity_rad_per_s) noexcept {
  const double direction = std::copysign(1.0, velocity_rad_per_s);
  return direction * effects.signed_level_Nm(
                         {.speed_rad_per_s = std::abs(velocity_rad_per_s), .direction = direction}) +
         effects.load_Nm(0);
}

std::span<const std::string_view> amplitudes_of(const AnyEffect& effect) {
  return std::visit(
      [](const auto& e) -> std::span<const std::string_view> {
        using E = std::decay_t<decltype(e)>;
        if constexpr (std::is_same_v<E, Custom>)
          return {&description_of(AnyEffect(e)).parameters.front().name, 1};
        else if constexpr (Linear<E>)
          return E::kAmplitudes;
        else
          return {};
      },
      effect);
}

AnyEffect basis_of(const AnyEffect& effect, std::string_view amplitude) {
  const std::span<const std::string_view> amplitudes = amplitudes_of(effect);
  const auto is_amplitude = [&](std::string_view name) {
    return std::ranges::find(amplitudes, name) != amplitudes.end();
  };
  if (!is_amplitude(amplitude))
    throw std::invalid_argument("effect " + std::string(name_of(effect)) + " is not linear in " +
                                std::string(amplitude));
  if (const Custom* custom = std::get_if<Custom>(&effect)) return custom->with_unit_amplitude();
  std::vector<double> values = values_of(effect);
  const auto& parameters = description_of(effect).parameters;
  for (std::size_t i = 0; i < values.size(); ++i)
    if (is_amplitude(parameters[i].name)) values[i] = parameters[i].name == amplitude ? 1 : 0;
  return with_values(effect, values);
}

}  // namespace model::effects
