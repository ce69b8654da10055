/// @file
/// A torque that was found in data and that no physical effect explains.
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

#include "model/effects/effect.h"
#include "model/even_table.h"

namespace model::effects {

/// Sum of a few terms, each a table over one quantity times a factor; against positive motion:
///
///   τ = Σ factor · table(x)
///
/// Terms with the factor direction, speed or load are friction: they act while the joint slides, carried by
/// the same contact. It has no physical name and no parameters that a fit may change. Beyond the range of a
/// table, its last value holds; over a turn, it repeats.
/// [additive models: T. Hastie, R. Tibshirani, Statistical Science 1:297, 1986]
class Empirical {
 public:
  /// Quantity x of a table. Velocity: with its sign. Load: magnitude of its torque (Sliding::load_Nm). Turn:
  /// position within one turn.
  enum class Along : std::uint8_t { kVelocity, kPosition, kTurn, kLoad, kSinceReversal };
  /// The factor. Velocity: with its sign. Load: with the sign of the velocity.
  enum class Times : std::uint8_t { kOne, kDirection, kVelocity, kLoad };
  struct Term {
    Along along;
    Times times;
    EvenTable table;
    bool is_load() const noexcept { return times == Times::kOne && along != Along::kVelocity; }
  };
  /// Names as in a model file; of a turn "position_in_turn_rad".
  static constexpr std::array<std::pair<std::string_view, Along>, 5> kAlong{
      {{"velocity_rad_per_s", Along::kVelocity},
       {"position_rad", Along::kPosition},
       {"position_in_turn_rad", Along::kTurn},
       {"load_Nm", Along::kLoad},
       {"time_since_reversal_s", Along::kSinceReversal}}};
  static constexpr std::array<std::pair<std::string_view, Times>, 4> kTimes{{{"one", Times::kOne},
                                                                             {"direction", Times::kDirection},
                                                                             {"velocity", Times::kVelocity},
                                                                             {"load", Times::kLoad}}};
  static std::string_view name_of(Along along) noexcept;
  static std::string_view name_of(Times times) noexcept;
  /// Unit of the values of a table: "N·m", "N·m·s/rad", or "" for a share of the load.
  static std::string_view unit_of(Times times) noexcept;
  /// Whether these form a term: velocity with one or load; a position with one, direction or velocity; load
  /// and time since reversal with direction.
  static bool is_term(Along along, Times times) noexcept;

  static constexpr std::string_view kName = "empirical";
  static constexpr std::string_view kShows =
      "structure in the residual over velocity, position, direction, load or time since reversal that no "
      "named effect explains";
  static constexpr std::size_t kMaxTerms = 8;
  static constexpr std::size_t kMaxValues = 256;  ///< of one table

  /// @throws std::invalid_argument for no or too many terms, a table with too many values, or one that is no
  /// term.
  explicit Empirical(std::vector<Term> terms);

  const std::vector<Term>& terms() const noexcept { return terms_; }
  /// Cycle.
  double level_Nm(const Sliding& sliding) const noexcept;
  /// Cycle.
  double load_Nm(double position_rad) const noexcept;
  /// The smallest friction at a velocity, whatever the position, the load and the time since reversal; for a
  /// compensator, which must not exceed friction.
  double least_level_Nm(double speed_rad_per_s, double direction, double largest_load_Nm) const noexcept;

 private:
  std::vector<Term> terms_;
};

}  // namespace model::effects
