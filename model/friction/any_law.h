/// @file
/// A friction law chosen at run time: by name, with parameters by name.
#pragma once
#include <initializer_list>
#include <span>
#include <string_view>
#include <type_traits>
#include <utility>
#include <variant>

#include "model/catalogue.h"
#include "model/friction/armstrong.h"
#include "model/friction/bristle.h"
#include "model/friction/coulomb.h"
#include "model/friction/dahl.h"
#include "model/friction/elasto_plastic.h"
#include "model/friction/gms.h"
#include "model/friction/karnopp.h"
#include "model/friction/kfm.h"
#include "model/friction/law.h"
#include "model/friction/leuven.h"
#include "model/friction/lugre.h"
#include "model/friction/measured_wheel.h"
#include "model/friction/regularised.h"
#include "model/friction/reset_integrator.h"
#include "model/friction/stiction.h"
#include "model/friction/viscous.h"

namespace model::friction {

using model::NamedValue;
using model::ParameterDescription;

/// Any of the laws, with the meaning each gives to these functions; see law.h. A value: copies are
/// independent. Setup: construction and what has names. Cycle: the others, which neither allocate nor lock.
class AnyLaw {
 public:
  using Variant = std::variant<Coulomb, Viscous, Stiction, Kfm, Regularised, Karnopp, Armstrong, Dahl,
                               Bristle, ResetIntegrator, LuGre, ElastoPlastic, Leuven, Gms, MeasuredWheel>;

 private:
  // std::visit may throw, for a variant that lost its value. This one cannot: what may throw when copied (a
  // table) moves without, so that an assignment succeeds or changes nothing.
  template <std::size_t kIndex = 0, class Visit>
  auto visit(const Visit& of) const noexcept {
    if constexpr (kIndex + 1 < std::variant_size_v<Variant>)
      if (law_.index() != kIndex) return visit<kIndex + 1>(of);
    return of(*std::get_if<kIndex>(&law_));
  }

 public:
  template <Law L>
  explicit AnyLaw(L law) : law_(std::move(law)) {}

  std::string_view name() const noexcept;
  /// @throws std::invalid_argument listing the law's parameters when `parameter` is none of them.
  double parameter(std::string_view parameter) const;
  /// The same law with one value changed. @throws std::invalid_argument also when it is out of bounds.
  AnyLaw with(std::string_view parameter, double value) const;

  double step(State& state, const Contact& contact, double dt_s) const noexcept {
    return visit([&](const auto& law) noexcept { return law.step(state, contact, dt_s); });
  }
  double steady_Nm(double velocity_rad_per_s) const noexcept;
  /// 0 for a law without springs.
  double stored_energy_J(const State& state) const noexcept;
  /// False for a law that never holds rigidly.
  bool holds(const Contact& contact) const noexcept;
  double max_step_s(double inertia_kg_m2) const noexcept;

  const Variant& variant() const noexcept { return law_; }

 private:
  Variant law_;
  static_assert(std::is_nothrow_move_constructible_v<Variant>);
};

struct LawDescription {
  std::string_view name;
  std::span<const ParameterDescription> parameters;
  bool has_memory;  ///< the torque depends on more than the velocity and applied torque of the moment
};
/// All laws, in the order of AnyLaw::Variant. Lives as long as the program.
std::span<const LawDescription> law_descriptions();
/// @throws std::invalid_argument listing the laws there are.
const LawDescription& law_description(std::string_view law);

/// What is not named keeps its default. @throws std::invalid_argument listing what exists when the law or a
/// parameter is unknown, or naming a parameter that is out of bounds or given twice.
AnyLaw make_law(std::string_view law, std::span<const NamedValue> values);
AnyLaw make_law(std::string_view law, std::initializer_list<NamedValue> values = {});
/// Every parameter, in the order of the law's description: the point of a fit.
/// @throws std::invalid_argument also when there are more or fewer values than parameters.
AnyLaw make_law_from_values(std::string_view law, std::span<const double> values);

}  // namespace model::friction
