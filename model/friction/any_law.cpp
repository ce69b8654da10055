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

struct Family {
  static constexpr std::string_view kName = "friction law";
};
using Laws = Catalogue<Family, AnyLaw::Variant>;

template <Law L>
constexpr bool kRemembers = !(std::same_as<L, Viscous> || std::same_as<L, Regularised> || HoldsRigidly<L>);

/// The law called `name`, with `fill(type, parameters)` applied to its defaults.
template <class Fill>
AnyLaw made(std::string_view name, const Fill& fill) {
  (void)law_description(name);  // throws with the list
  return *Laws::make<AnyLaw>(name, fill);
}

}  // namespace

std::string_view AnyLaw::name() const noexcept {
  return visit([](const auto& law) noexcept { return std::decay_t<decltype(law)>::kName; });
}

double AnyLaw::parameter(std::string_view parameter) const {
  return std::visit([&](const auto& law) { return Laws::parameter(law, parameter); }, law_);
}

AnyLaw AnyLaw::with(std::string_view parameter, double value) const {
  return std::visit(
      [&](const auto& law) {
        using L = std::decay_t<decltype(law)>;
        typename L::Parameters changed = law.parameters();
        Laws::set<L>(changed, parameter, value);
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
    Laws::for_each([&]<class L>(const L*) {
      laws.push_back({L::kName, Laws::parameters_of<L>(), kRemembers<L>});
    });
    return laws;
  }();
  return kLaws;
}

const LawDescription& law_description(std::string_view law) { return Laws::find(law_descriptions(), law); }

AnyLaw make_law(std::string_view law, std::span<const NamedValue> values) {
  return made(law, [&]<class L>(const L*, typename L::Parameters& parameters) {
    for (auto given = values.begin(); given != values.end(); ++given) {
      if (std::any_of(values.begin(), given, [&](const NamedValue& v) { return v.name == given->name; }))
        throw std::invalid_argument("friction law " + std::string(law) + ": parameter " +
                                    std::string(given->name) + " is given twice");
      Laws::set<L>(parameters, given->name, given->value);
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
                                  " values for its " + std::to_string(L::kParameters.size()) + " parameters");
    for (std::size_t i = 0; i < values.size(); ++i) L::kParameters[i].in(parameters) = values[i];
  });
}

}  // namespace model::friction
