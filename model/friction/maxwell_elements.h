/// @file
/// The parallel springs with sliders of Leuven and GMS, as parameters.
#pragma once
#include <array>
#include <cstddef>
#include <string_view>
#include <utility>

#include "model/friction/parameter_rows.h"

namespace model::friction {

/// Up to kMaxElements springs kᵢ, each with a slider that carries the share νᵢ of the total. An element with
/// share 0 does not exist. Shares are normalised to a sum of 1.
class MaxwellElements {
 public:
  using Values = std::array<double, kMaxElements>;
  /// Defaults of a law: σ0 = 250 N·m/rad at rest (thesis 2.5.2), four sliders that slip one after the other.
  static constexpr Values kDefaultStiffness_Nm_per_rad{130, 70, 35, 15, 1, 1, 1, 1, 1, 1};
  static constexpr Values kDefaultShare{0.25, 0.25, 0.25, 0.25};

  /// @throws std::invalid_argument naming the law if all shares are zero.
  MaxwellElements(std::string_view law, const Values& stiffness_Nm_per_rad, const Values& share);

  std::size_t count() const noexcept { return count_; }
  double stiffness_Nm_per_rad(std::size_t element) const noexcept { return stiffness_Nm_per_rad_[element]; }
  double compliance_rad_per_Nm(std::size_t element) const noexcept { return compliance_rad_per_Nm_[element]; }
  double share(std::size_t element) const noexcept { return share_[element]; }
  double total_stiffness_Nm_per_rad() const noexcept;
  /// Energy of springs that carry the torques `torque_Nm[0 … count)`.
  double energy_J(const double* torque_Nm) const noexcept;

 private:
  std::size_t count_ = 0;
  Values stiffness_Nm_per_rad_{};
  Values compliance_rad_per_Nm_{};
  Values share_{};
};

namespace rows {

inline constexpr std::array<std::string_view, kMaxElements> kStiffnessNames{
    "stiffness_1_Nm_per_rad", "stiffness_2_Nm_per_rad", "stiffness_3_Nm_per_rad", "stiffness_4_Nm_per_rad",
    "stiffness_5_Nm_per_rad", "stiffness_6_Nm_per_rad", "stiffness_7_Nm_per_rad", "stiffness_8_Nm_per_rad",
    "stiffness_9_Nm_per_rad", "stiffness_10_Nm_per_rad"};
inline constexpr std::array<std::string_view, kMaxElements> kShareNames{
    "share_1", "share_2", "share_3", "share_4", "share_5",
    "share_6", "share_7", "share_8", "share_9", "share_10"};

/// Rows for members `stiffness_Nm_per_rad` and `share` of type MaxwellElements::Values.
template <class P>
constexpr auto elements() {
  return []<std::size_t... I>(std::index_sequence<I...>) {
    return std::array<ParameterInfo<P>, 2 * kMaxElements>{
        ParameterInfo<P>{kStiffnessNames[I], entry<&P::stiffness_Nm_per_rad, I>, 1e-6, 1e8}...,
        ParameterInfo<P>{kShareNames[I], entry<&P::share, I>, 0, 1}...};
  }
  (std::make_index_sequence<kMaxElements>());
}

}  // namespace rows
}  // namespace model::friction
