/// @file
/// A friction law as an effect: LuGre, GMS, a measured wheel curve.
///
///     [[effect]]
///     type = "lugre"
///     stiffness_Nm_per_rad = 250
#pragma once
#include <cmath>
#include <memory>
#include <utility>

#include "model/effects/effect.h"
#include "model/friction/any_law.h"

namespace model::effects {

/// Friction by one of the laws of model/friction, in addition to that of the other effects. A law without
/// memory is a level of sliding friction, which the friction contact carries as it does that of the other
/// effects. A law with memory has its own springs: the simulation steps it beside the contact
/// (EffectChain::laws_Nm); elsewhere its level is its steady one. The laws named coulomb and viscous are the
/// effects of those names. Copies share the law, which is immutable.
class FrictionLaw {
 public:
  explicit FrictionLaw(friction::AnyLaw law)
      : law_(std::make_shared<const friction::AnyLaw>(std::move(law))),
        has_memory_(friction::law_description(law_->name()).has_memory) {}

  const friction::AnyLaw& law() const noexcept { return *law_; }
  bool has_memory() const noexcept { return has_memory_; }
  double level_Nm(const Sliding& sliding) const noexcept {
    return sliding.direction * law_->steady_Nm(std::copysign(sliding.speed_rad_per_s, sliding.direction));
  }

 private:
  std::shared_ptr<const friction::AnyLaw> law_;
  bool has_memory_;
};

}  // namespace model::effects
