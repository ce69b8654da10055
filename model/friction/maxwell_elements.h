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
  /// Those of `values`, one for each row of the law's table, that belong to elements with a share.
  Values of_elements(const Values& values) const noexcept {
    Values result{};
    for (std::size_t i = 0; i < count_; ++i) result[i] = values[row_[i]];
    return result;
  }
  double total_stiffness_Nm_per_rad() const noexcept;
  /// Energy of springs that carry the torques `torque_Nm[0 … count)`.
  double energy_J(const double* torque_Nm) const noexcept;

 private:
  std::size_t count_ = 0;
  Values stiffness_Nm_per_rad_{};
  Values compliance_rad_per_Nm_{};
  Values share_{};
  std::array<std::size_t, kMaxElements> row_{};
};

namespace rows {

inline constexpr std::array<std::string_view, kMaxElements> kStiffnessNames{
    "stiffness_1_Nm_per_rad", "stiffness_2_Nm_per_rad", "stiffness_3_Nm_per_rad", "stiffness_4_Nm_per_rad",
    "stiffness_5_Nm_per_rad", "stiffness_6_Nm_per_rad", "stiffness_7_Nm_per_rad", "stiffness_8_Nm_per_rad",
    "stiffness_9_Nm_per_rad", "stiffness_10_Nm_per_rad"};
inline constexpr std::array<std::string_view, kMaxElements> kDampingNames{
    "damping_1_Nm_s_per_rad", "damping_2_Nm_s_per_rad", "damping_3_Nm_s_per_rad", "damping_4_Nm_s_per_rad",
    "damping_5_Nm_s_per_rad", "damping_6_Nm_s_per_rad", "damping_7_Nm_s_per_rad", "damping_8_Nm_s_per_rad",
    "damping_9_Nm_s_per_rad", "damping_10_Nm_s_per_rad"};
inline constexpr std::array<std::string_view, kMaxElements> kAttractionNames{
    "attraction_1_Nm_per_s", "attraction_2_Nm_per_s", "attraction_3_Nm_per_s", "attraction_4_Nm_per_s",
    "attraction_5_Nm_per_s", "attraction_6_Nm_per_s", "attraction_7_Nm_per_s", "attraction_8_Nm_per_s",
    "attraction_9_Nm_per_s", "attraction_10_Nm_per_s"};
inline constexpr std::array<std::string_view, kMaxElements> kShareNames{
    "share_1", "share_2", "share_3", "share_4", "share_5",
    "share_6", "share_7", "share_8", "share_9", "share_10"};

/// Rows for members `damping_Nm_s_per_rad` and `attraction_Nm_per_s` of type MaxwellElements::Values.
template <class P>
constexpr auto slip_of_elements() {
  return []<std::size_t... I>(std::index_sequence<I...>) {
    return std::array<ParameterInfo<P>, 2 * kMaxElements>{
        ParameterInfo<P>{kDampingNames[I], entry<&P::damping_Nm_s_per_rad, I>, 0, 1e5}...,
        ParameterInfo<P>{kAttractionNames[I], entry<&P::attraction_Nm_per_s, I>, 1e-9, 1e9}...};
  }
  (std::make_index_sequence<kMaxElements>());
}

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
