#include "model/effects/any_effect.h"

#include <algorithm>
#include <cmath>
#include <deque>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

namespace model::effects {
namespace {

struct Family {};
using Library = Catalogue<Family, Effects::Library>;

/// A custom effect with what its description refers to.
struct Added {
  CustomEffect effect;
  std::vector<ParameterDescription> parameters;
};

struct Registry {
  std::vector<EffectDescription> descriptions;
  std::deque<Added> added;  // its elements stay where they are

  Registry() {
    descriptions.reserve(std::variant_size_v<Effects::Library> + kMaxCustomEffects);
    Library::for_each([&]<class E>(const E*) {
      descriptions.push_back({E::kName, E::kShows, Library::parameters_of<E>()});
    });
  }
};
Registry& registry() {
  static Registry registry;
  return registry;
}

/// How a law appears in measured data.
std::string_view shown_by(std::string_view law) {
  constexpr auto kShows = std::to_array<std::pair<std::string_view, std::string_view>>(
      {{"stiction", "a torque to break away that is higher than the sliding torque"},
       {"kfm", "breakaway, a fall near standstill and a rise with speed"},
       {"regularised", "creep under any torque, and the kinetic curve above a low speed"},
       {"karnopp", "rest within a band of low speeds, and the kinetic curve above it"},
       {"armstrong", "breakaway that grows with the time at rest, and friction that follows speed late"},
       {"dahl", "friction that turns over a distance after a reversal"},
       {"bristle", "friction that fluctuates with position around its level"},
       {"reset_integrator", "a spring until breakaway, from which friction drops to the sliding level"},
       {"lugre", "presliding hysteresis, and friction that is higher while the joint accelerates"},
       {"elasto_plastic", "as lugre, without drift under small torques"},
       {"leuven", "as lugre, with closed inner loops"},
       {"gms", "closed inner loops before breakaway, and friction that follows speed late"},
       {"measured_wheel", "the measured curve of a youBot wheel"}});
  return std::ranges::find(kShows, law, [](const auto& row) { return row.first; })->second;
}

template <class Items>
void append_names(const Items& items, std::string& list) {
  for (const auto& item : items) (list += list.empty() ? "" : ", ") += item.name;
}

std::size_t index_of(const EffectDescription& effect, std::string_view parameter) {
  const auto found = std::ranges::find(effect.parameters, parameter, &ParameterDescription::name);
  if (found != effect.parameters.end()) return static_cast<std::size_t>(found - effect.parameters.begin());
  std::string list;
  for (const ParameterDescription& known : effect.parameters)
    (list += list.empty() ? "" : ", ") += known.name;
  throw std::invalid_argument("effect " + std::string(effect.name) + ": parameter " + std::string(parameter) +
                              " is unknown; it has " + (list.empty() ? "none" : list));
}

const EffectDescription* find_in(std::span<const EffectDescription> descriptions, std::string_view name) {
  const auto at = std::ranges::find(descriptions, name, &EffectDescription::name);
  return at == descriptions.end() ? nullptr : &*at;
}

AnyEffect with_defaults(std::string_view effect) {
  if (find_in(friction_law_effects(), effect) != nullptr) return FrictionLaw(friction::make_law(effect));
  for (const Added& custom : registry().added)
    if (custom.effect.name == effect)
      return Custom(custom.effect, custom.effect.amplitude.initial,
                    custom.effect.shape ? custom.effect.shape->initial : 0);
  return *Library::make<AnyEffect>(effect, [](const auto*, const auto&) {});
}

/// Empty when there is nothing wrong.
std::string problem_of(const CustomEffect& effect) {
  const auto is_letter = [](char c) { return (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || c == '_'; };
  if (effect.name == Empirical::kName) return "that is the name of structure without a name";
  if (effect.name.empty() || !std::ranges::all_of(effect.name, is_letter))
    return "its name takes lower-case letters, digits and underscores";
  if (find_in(effect_descriptions(), effect.name) != nullptr) return "there is an effect of that name";
  if (find_in(friction_law_effects(), effect.name) != nullptr) return "there is a friction law of that name";
  if (registry().added.size() >= kMaxCustomEffects)
    return "there are " + std::to_string(kMaxCustomEffects) + " custom effects, which is the maximum";
  if (effect.level == nullptr && effect.load == nullptr) return "it has neither level nor load";
  const auto is_word = [&](const std::string& name) {  // a key of a model file
    return !name.empty() && name != "type" &&
           std::ranges::all_of(name, [&](char c) { return is_letter(c) || (c >= 'A' && c <= 'Z'); });
  };
  const auto is_usable = [&](const CustomEffect::Parameter& p) {
    return is_word(p.name) && std::isfinite(p.lower) && std::isfinite(p.upper) && p.lower < p.upper &&
           p.lower <= p.initial && p.initial <= p.upper;
  };
  if (!is_usable(effect.amplitude) || (effect.shape && !is_usable(*effect.shape)))
    return "a parameter needs a name of letters, digits and underscores, finite bounds and a default within "
           "them";
  if (effect.shape && effect.shape->name == effect.amplitude.name) return "amplitude and shape have one name";
  if (!effect.shape && !effect.tried_shapes.empty()) return "it has tried_shapes but no shape";
  for (const double shape : effect.tried_shapes)
    if (!(shape >= effect.shape->lower && shape <= effect.shape->upper))
      return "tried_shapes are not within the bounds of the shape";
  return "";
}

}  // namespace

void require_within(std::string_view effect, std::string_view parameter, double value, double lower,
                    double upper) {
  if (value >= lower && value <= upper) return;
  throw std::invalid_argument("effect " + std::string(effect) + ": " + std::string(parameter) + " = " +
                              std::to_string(value) + " is not within " + std::to_string(lower) + " to " +
                              std::to_string(upper));
}

Custom::Custom(const CustomEffect& kind, double amplitude, double shape)
    : kind_(&kind), amplitude_(amplitude), shape_(shape) {
  require_within(kind.name, kind.amplitude.name, amplitude, kind.amplitude.lower, kind.amplitude.upper);
  if (kind.shape) require_within(kind.name, kind.shape->name, shape, kind.shape->lower, kind.shape->upper);
}

void add_custom_effect(CustomEffect effect) {
  if (const std::string problem = problem_of(effect); !problem.empty())
    throw std::invalid_argument("custom effect " + effect.name + ": " + problem);
  if (effect.shape && effect.tried_shapes.empty()) effect.tried_shapes = {effect.shape->initial};
  Registry& all = registry();
  Added& added = all.added.emplace_back(Added{.effect = std::move(effect), .parameters = {}});
  const auto describe = [&added](const CustomEffect::Parameter& p) {
    added.parameters.push_back({p.name, p.lower, p.upper, p.initial});
  };
  describe(added.effect.amplitude);
  if (added.effect.shape) describe(*added.effect.shape);
  all.descriptions.push_back({added.effect.name, added.effect.shows, added.parameters});
}

std::vector<const CustomEffect*> custom_effects() {
  std::vector<const CustomEffect*> effects;
  for (const Added& added : registry().added) effects.push_back(&added.effect);
  return effects;
}

std::span<const EffectDescription> effect_descriptions() { return registry().descriptions; }

std::span<const EffectDescription> friction_law_effects() {
  static const auto kLaws = [] {
    std::vector<EffectDescription> laws;
    for (const friction::LawDescription& law : friction::law_descriptions())
      if (law.name != Coulomb::kName && law.name != Viscous::kName)
        laws.push_back({law.name, shown_by(law.name), law.parameters});
    return laws;
  }();
  return kLaws;
}

const EffectDescription& effect_description(std::string_view effect) {
  for (const auto& descriptions : {effect_descriptions(), friction_law_effects()})
    if (const EffectDescription* description = find_in(descriptions, effect)) return *description;
  std::string names, laws;
  append_names(effect_descriptions(), names);
  append_names(friction_law_effects(), laws);
  throw std::invalid_argument("there is no effect " + std::string(effect) + "; there are " + names +
                              " and the friction laws " + laws);
}

const EffectDescription& description_of(const AnyEffect& effect) noexcept {
  static const EffectDescription kEmpirical{Empirical::kName, Empirical::kShows, {}};
  if (std::holds_alternative<Empirical>(effect)) return kEmpirical;
  const std::vector<EffectDescription>& all = registry().descriptions;
  if (const auto* law = std::get_if<FrictionLaw>(&effect))
    return *find_in(friction_law_effects(), law->law().name());
  if (const auto* custom = std::get_if<Custom>(&effect))
    return *std::ranges::find(all, custom->kind().name, &EffectDescription::name);
  return all[effect.index()];
}

std::string_view name_of(const AnyEffect& effect) noexcept { return description_of(effect).name; }

double parameter_of(const AnyEffect& effect, std::string_view parameter) {
  return values_of(effect)[index_of(description_of(effect), parameter)];
}

std::vector<double> values_of(const AnyEffect& effect) {
  return std::visit(
      [](const auto& e) {
        using E = std::decay_t<decltype(e)>;
        std::vector<double> values;
        if constexpr (std::is_same_v<E, Custom>) {
          values.push_back(e.amplitude());
          if (e.kind().shape) values.push_back(e.shape());
        } else if constexpr (std::is_same_v<E, FrictionLaw>) {
          for (const auto& parameter : friction::law_description(e.law().name()).parameters)
            values.push_back(e.law().parameter(parameter.name));
        } else if constexpr (!std::is_same_v<E, Empirical>) {
          for (const auto& info : E::kParameters) values.push_back(info.of(e.parameters()));
        }
        return values;
      },
      effect);
}

AnyEffect with_values(const AnyEffect& effect, std::span<const double> values) {
  return std::visit(
      [&](const auto& e) {
        using E = std::decay_t<decltype(e)>;
        if constexpr (std::is_same_v<E, Custom>) {
          return AnyEffect(Custom(e.kind(), values[0], values.size() > 1 ? values[1] : 0));
        } else if constexpr (std::is_same_v<E, FrictionLaw>) {
          return AnyEffect(FrictionLaw(friction::make_law_from_values(e.law().name(), values)));
        } else if constexpr (std::is_same_v<E, Empirical>) {
          return AnyEffect(e);
        } else {
          typename E::Parameters parameters = e.parameters();
          auto value = values.begin();
          for (const auto& info : E::kParameters) info.in(parameters) = *value++;
          return AnyEffect(E(parameters));
        }
      },
      effect);
}

AnyEffect make_effect(std::string_view effect, std::span<const NamedValue> values) {
  const EffectDescription& description = effect_description(effect);  // throws with the list
  const AnyEffect defaults = with_defaults(effect);
  std::vector<double> all = values_of(defaults);
  for (const NamedValue& given : values) all[index_of(description, given.name)] = given.value;
  return with_values(defaults, all);
}

AnyEffect make_effect(std::string_view effect, std::initializer_list<NamedValue> values) {
  return make_effect(effect, std::span<const NamedValue>(values.begin(), values.size()));
}

}  // namespace model::effects
