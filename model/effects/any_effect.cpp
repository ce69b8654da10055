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

template <Effect E>
EffectDescription described() {
  static const auto kParameters = [] {
    std::array<ParameterDescription, E::kParameters.size()> result{};
    const typename E::Parameters defaults;
    std::transform(E::kParameters.begin(), E::kParameters.end(), result.begin(), [&](const auto& info) {
      return ParameterDescription{info.name, info.lower, info.upper, info.of(defaults)};
    });
    return result;
  }();
  return {E::kName, E::kShows, kParameters};
}

/// Calls `visit` with a null pointer to each effect of the variant, for its type.
template <class Visit, Effect... Es>
void for_each_effect(const Visit& visit, const std::variant<Es...>* /*type*/) {
  (visit(static_cast<const Es*>(nullptr)), ...);
}
template <class Visit>
void for_each_effect(const Visit& visit) {
  for_each_effect(visit, static_cast<const AnyEffect*>(nullptr));
}

template <class Items>
std::string names_of(const Items& items) {
  std::string list;
  for (const auto& item : items) (list += list.empty() ? "" : ", ") += item.name;
  return list.empty() ? "none" : list;
}

template <Effect E>
const auto& info_of(std::string_view parameter) {
  const auto found = std::find_if(E::kParameters.begin(), E::kParameters.end(),
                                  [&](const auto& info) { return info.name == parameter; });
  if (found == E::kParameters.end())
    throw std::invalid_argument("effect " + std::string(E::kName) + ": no parameter " +
                                std::string(parameter) + "; it has " + names_of(E::kParameters));
  return *found;
}

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
    for_each_effect([&]<class E>(const E*) { effects.push_back(described<E>()); });
    return effects;
  }();
  return kEffects;
}

const EffectDescription& effect_description(std::string_view effect) {
  const std::span<const EffectDescription> effects = effect_descriptions();
  const auto found =
      std::find_if(effects.begin(), effects.end(), [&](const auto& e) { return e.name == effect; });
  if (found == effects.end())
    throw std::invalid_argument("there is no effect " + std::string(effect) + "; there are " +
                                names_of(effects));
  return *found;
}

std::string_view name_of(const AnyEffect& effect) noexcept {
  return effect_descriptions()[effect.index()].name;
}

double parameter_of(const AnyEffect& effect, std::string_view parameter) {
  return std::visit(
      [&](const auto& e) -> double {
        using E = std::decay_t<decltype(e)>;
        if constexpr (E::kParameters.size() > 0)
          return info_of<E>(parameter).of(e.parameters());
        else
          throw std::invalid_argument("effect " + std::string(E::kName) + " has no parameters");
      },
      effect);
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
  (void)effect_description(effect);
  std::optional<AnyEffect> result;
  for_each_effect([&]<class E>(const E*) {
    if (E::kName != effect) return;
    typename E::Parameters parameters;
    for (const NamedValue& given : values) {
      if constexpr (E::kParameters.size() > 0)
        info_of<E>(given.name).in(parameters) = given.value;
      else
        throw std::invalid_argument("effect " + std::string(E::kName) + ": no parameter " +
                                    std::string(given.name) + "; it has none");
    }
    result.emplace(E(parameters));
  });
  return *result;
}

AnyEffect make_effect(std::string_view effect, std::initializer_list<NamedValue> values) {
  return make_effect(effect, std::span<const NamedValue>(values.begin(), values.size()));
}

}  // namespace model::effects
