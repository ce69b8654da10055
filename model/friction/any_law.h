/// @file
/// A friction law selected at run time: by name, with parameters by name.
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

/// Any of the laws, with the meaning each gives to these functions; see law.h. A value type: copies are
/// independent. Setup: construction and functions with names. Cycle: the others, which neither allocate nor
/// lock.
class AnyLaw {
 public:
  using Variant = std::variant<Coulomb, Viscous, Stiction, Kfm, Regularised, Karnopp, Armstrong, Dahl,
                               Bristle, ResetIntegrator, LuGre, ElastoPlastic, Leuven, Gms, MeasuredWheel>;

 private:
  // std::visit may throw for a valueless variant. This one cannot be valueless: a type whose copy may throw
  // (a table) has a nothrow move, so an assignment succeeds or changes nothing.
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
  /// @throws std::invalid_argument listing the law's parameters if `parameter` is unknown.
  double parameter(std::string_view parameter) const;
  /// The same law with one changed value. @throws std::invalid_argument also if it is out of bounds.
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
  bool has_memory;  ///< the torque depends on more than the current velocity and applied torque
};
/// All laws, in the order of AnyLaw::Variant. Valid for the lifetime of the program.
std::span<const LawDescription> law_descriptions();
/// @throws std::invalid_argument listing the known laws.
const LawDescription& law_description(std::string_view law);

/// Other parameters keep their defaults. @throws std::invalid_argument listing the known names if the law or
/// a parameter is unknown, or naming a parameter that is out of bounds or given twice.
AnyLaw make_law(std::string_view law, std::span<const NamedValue> values);
AnyLaw make_law(std::string_view law, std::initializer_list<NamedValue> values = {});
/// All parameters, in the order of the law's description, as a fit needs them.
/// @throws std::invalid_argument also if the number of values differs from that of the parameters.
AnyLaw make_law_from_values(std::string_view law, std::span<const double> values);

}  // namespace model::friction
