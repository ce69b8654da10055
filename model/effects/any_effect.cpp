#include "model/effects/any_effect.h"

#include <algorithm>
#include <array>
#include <optional>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <vector>

namespace model::effects {
namespace {

struct Family {
  static constexpr std::string_view kName = "effect";
};
using Effects = Catalogue<Family, AnyEffect>;

}  // namespace

void require_within(std::string_view effect, std::string_view parameter, double value, double lower,
                    double upper) {
  if (value >= lower && value <= upper) return;
  throw std::invalid_argument("effect " + std::string(effect) + ": " + std::string(parameter) + " = " +
                              std::to_string(value) + " is not within " + std::to_string(lower) + " to " +
                              std::to_string(upper));
}

std::span<const EffectDescription> effect_descriptions() {
  static const auto kEffects = [] {
    std::vector<EffectDescription> effects;
    Effects::for_each([&]<class E>(const E*) {
      effects.push_back({E::kName, E::kShows, Effects::parameters_of<E>()});
    });
    return effects;
  }();
  return kEffects;
}

const EffectDescription& effect_description(std::string_view effect) {
  return Effects::find(effect_descriptions(), effect);
}

std::string_view name_of(const AnyEffect& effect) noexcept {
  return effect_descriptions()[effect.index()].name;
}

double parameter_of(const AnyEffect& effect, std::string_view parameter) {
  return std::visit([&](const auto& e) { return Effects::parameter(e, parameter); }, effect);
}

std::vector<double> values_of(const AnyEffect& effect) {
  return std::visit(
      [](const auto& e) {
        std::vector<double> values;
        for (const auto& info : std::decay_t<decltype(e)>::kParameters)
          values.push_back(info.of(e.parameters()));
        return values;
      },
      effect);
}

AnyEffect with_values(const AnyEffect& effect, std::span<const double> values) {
  return std::visit(
      [&](const auto& e) {
        using E = std::decay_t<decltype(e)>;
        typename E::Parameters parameters = e.parameters();
        auto value = values.begin();
        for (const auto& info : E::kParameters) info.in(parameters) = *value++;
        return AnyEffect(E(parameters));
      },
      effect);
}

AnyEffect make_effect(std::string_view effect, std::span<const NamedValue> values) {
  (void)effect_description(effect);  // throws with the list
  return *Effects::make<AnyEffect>(effect, [&]<class E>(const E*, typename E::Parameters& parameters) {
    for (const NamedValue& given : values) Effects::set<E>(parameters, given.name, given.value);
  });
}

AnyEffect make_effect(std::string_view effect, std::initializer_list<NamedValue> values) {
  return make_effect(effect, std::span<const NamedValue>(values.begin(), values.size()));
}

}  // namespace model::effects
