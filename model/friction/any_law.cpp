#include "model/friction/any_law.h"

#include <algorithm>
#include <array>
#include <optional>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

namespace model::friction {
namespace {

template <Law L>
constexpr bool kRemembers = !(std::same_as<L, Viscous> || std::same_as<L, Regularised> || HoldsRigidly<L>);

template <Law L>
LawDescription described() {
  static const auto kDescriptions = [] {
    std::array<ParameterDescription, L::kParameters.size()> result{};
    const typename L::Parameters defaults;
    std::transform(L::kParameters.begin(), L::kParameters.end(), result.begin(), [&](const auto& info) {
      return ParameterDescription{info.name, info.lower, info.upper, info.of(defaults)};
    });
    return result;
  }();
  return {L::kName, kDescriptions, kRemembers<L>};
}

/// Calls `visit` with a null pointer to each law of the variant, for its type.
template <class Visit, Law... Ls>
void for_each_law(const Visit& visit, const std::variant<Ls...>* /*type*/) {
  (visit(static_cast<const Ls*>(nullptr)), ...);
}
template <class Visit>
void for_each_law(const Visit& visit) {
  for_each_law(visit, static_cast<const AnyLaw::Variant*>(nullptr));
}

template <class Items>
std::string names_of(const Items& items) {
  std::string list;
  for (const auto& item : items) (list += list.empty() ? "" : ", ") += item.name;
  return list;
}

[[noreturn]] void refuse(std::string_view law, std::string_view parameter, const std::string& why) {
  throw std::invalid_argument("friction law " + std::string(law) + ": parameter " + std::string(parameter) +
                              " " + why);
}

template <Law L>
const ParameterInfo<typename L::Parameters>& info_of(std::string_view parameter) {
  const auto found = std::find_if(L::kParameters.begin(), L::kParameters.end(),
                                  [&](const auto& info) { return info.name == parameter; });
  if (found == L::kParameters.end())
    refuse(L::kName, parameter, "is unknown; it has " + names_of(L::kParameters));
  return *found;
}

/// The law called `name`, from what `fill(type, Parameters&)` makes of its defaults.
template <class Fill>
AnyLaw made(std::string_view name, const Fill& fill) {
  std::optional<AnyLaw> result;
  for_each_law([&]<class L>(const L* type) {
    if (L::kName != name) return;
    typename L::Parameters parameters;
    fill(type, parameters);
    result.emplace(L(parameters));
  });
  if (!result)
    throw std::invalid_argument("there is no friction law " + std::string(name) + "; there are " +
                                names_of(law_descriptions()));
  return *std::move(result);
}

}  // namespace

std::string_view AnyLaw::name() const noexcept {
  return visit([](const auto& law) noexcept { return std::decay_t<decltype(law)>::kName; });
}

double AnyLaw::parameter(std::string_view parameter) const {
  return std::visit(
      [&](const auto& law) { return info_of<std::decay_t<decltype(law)>>(parameter).of(law.parameters()); },
      law_);
}

AnyLaw AnyLaw::with(std::string_view parameter, double value) const {
  return std::visit(
      [&](const auto& law) {
        using L = std::decay_t<decltype(law)>;
        typename L::Parameters changed = law.parameters();
        info_of<L>(parameter).in(changed) = value;
        return AnyLaw(L(changed));
      },
      law_);
}

double AnyLaw::steady_Nm(double velocity_rad_per_s) const noexcept {
  return visit([&](const auto& law) noexcept { return law.steady_Nm(velocity_rad_per_s); });
}

double AnyLaw::stored_energy_J(const State& state) const noexcept {
  return visit([&](const auto& law) noexcept {
    if constexpr (StoresEnergy<std::decay_t<decltype(law)>>)
      return law.stored_energy_J(state);
    else
      return 0.0;
  });
}

bool AnyLaw::holds(const Contact& contact) const noexcept {
  return visit([&](const auto& law) noexcept {
    if constexpr (HoldsRigidly<std::decay_t<decltype(law)>>)
      return law.holds(contact);
    else
      return false;
  });
}

double AnyLaw::max_step_s(double inertia_kg_m2) const noexcept {
  return visit([&](const auto& law) noexcept { return law.max_step_s(inertia_kg_m2); });
}

std::span<const LawDescription> law_descriptions() {
  static const auto kLaws = [] {
    std::vector<LawDescription> laws;
    for_each_law([&]<class L>(const L*) { laws.push_back(described<L>()); });
    return laws;
  }();
  return kLaws;
}

const LawDescription& law_description(std::string_view law) {
  const std::span<const LawDescription> laws = law_descriptions();
  const auto found = std::find_if(laws.begin(), laws.end(), [&](const auto& l) { return l.name == law; });
  if (found == laws.end())
    throw std::invalid_argument("there is no friction law " + std::string(law) + "; there are " +
                                names_of(laws));
  return *found;
}

AnyLaw make_law(std::string_view law, std::span<const NamedValue> values) {
  return made(law, [&]<class L>(const L*, typename L::Parameters& parameters) {
    for (auto given = values.begin(); given != values.end(); ++given) {
      const bool twice =
          std::any_of(values.begin(), given, [&](const NamedValue& v) { return v.name == given->name; });
      if (twice) refuse(L::kName, given->name, "is given twice");
      info_of<L>(given->name).in(parameters) = given->value;
    }
  });
}

AnyLaw make_law(std::string_view law, std::initializer_list<NamedValue> values) {
  return make_law(law, std::span<const NamedValue>(values.begin(), values.size()));
}

AnyLaw make_law_from_values(std::string_view law, std::span<const double> values) {
  return made(law, [&]<class L>(const L*, typename L::Parameters& parameters) {
    if (values.size() != L::kParameters.size())
      throw std::invalid_argument("friction law " + std::string(law) + ": " + std::to_string(values.size()) +
                                  " values for its " + std::to_string(L::kParameters.size()) +
                                  " parameters, " + names_of(L::kParameters));
    for (std::size_t i = 0; i < values.size(); ++i) L::kParameters[i].in(parameters) = values[i];
  });
}

}  // namespace model::friction
