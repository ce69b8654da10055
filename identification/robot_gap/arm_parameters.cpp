#include "identification/robot_gap/arm_parameters.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

namespace identification::robot_gap {
namespace {

// Of CAD data: cables, screws and covers are missing in them.
constexpr double kMassShare = 0.2;
constexpr double kCentre_m = 0.02;
/// Of the geometric mean of the two moments of inertia that belong to an entry.
constexpr double kInertiaShare = 0.25;
/// Of data sheets.
constexpr double kRotorShare = 0.3;
/// Friction and offset: motions determine them.
constexpr double kFrictionSigma = 1;

constexpr std::array<std::array<int, 2>, 6> kInertiaPlaces{{{0, 0}, {0, 1}, {0, 2}, {1, 1}, {1, 2}, {2, 2}}};

void add_link(const control::LinkInertia& body, int link, std::vector<ArmParameter>& all) {
  if (!(body.mass_kg > 0)) return;
  all.push_back({{ArmTerm::Kind::kLinkMass, link}, kMassShare * body.mass_kg});
  for (int axis = 0; axis < 3; ++axis) all.push_back({{ArmTerm::Kind::kLinkCentre, link, axis}, kCentre_m});
  for (int entry = 0; entry < 6; ++entry) {
    const auto& [row, column] = kInertiaPlaces[static_cast<std::size_t>(entry)];
    const double square = body.about_C_kg_m2(row, row) * body.about_C_kg_m2(column, column);
    if (square > 0)
      all.push_back({{ArmTerm::Kind::kLinkInertia, link, entry}, kInertiaShare * std::sqrt(square)});
  }
}

void add_drive(const control::ArmDrive& drive, int joint, std::vector<ArmParameter>& all) {
  if (drive.rotor_inertia_kg_m2 > 0)
    all.push_back({{ArmTerm::Kind::kRotorInertia, joint}, kRotorShare * drive.rotor_inertia_kg_m2});
  all.push_back({{ArmTerm::Kind::kCoulomb, joint}, std::max(kFrictionSigma, drive.coulomb_Nm)});
  all.push_back({{ArmTerm::Kind::kViscous, joint}, std::max(kFrictionSigma, drive.viscous_Nm_s_per_rad)});
  all.push_back({{ArmTerm::Kind::kOffset, joint}, kFrictionSigma});
}

}  // namespace

std::vector<ArmParameter> arm_parameters(const control::ArmDescription& arm) {
  std::vector<ArmParameter> all;
  for (std::size_t i = 0; i < arm.drives.size(); ++i) {
    add_link(arm.arm.links[i].inertia, static_cast<int>(i), all);
    add_drive(arm.drives[i], static_cast<int>(i), all);
  }
  return all;
}

}  // namespace identification::robot_gap
