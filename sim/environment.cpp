#include "sim/environment.h"

#include <cmath>
#include <stdexcept>
#include <string>

#include "model/gravity.h"

namespace sim {
namespace {

/// Penetration depth of one body in another, and the direction out of it. The depth is continuous wherever
/// the first body moves, even where the direction changes: so a spring along it generates no energy.
struct Overlap {
  double depth_m;
  Eigen::Vector3d normal_W;
};

/// Overlap of a body that reaches `reach_m` from its centre towards the wall.
Overlap behind(const Wall& wall, const Eigen::Vector3d& p_W_m, double reach_m) noexcept {
  return {reach_m - wall.normal_W.dot(p_W_m - wall.p_W_m), wall.normal_W};
}

/// Overlap of a point in a block of half size `half_m` around the origin, towards the nearest face.
Overlap within(const Eigen::Vector3d& half_m, const Eigen::Vector3d& p_m) noexcept {
  Eigen::Index axis;
  const double depth_m = (half_m - p_m.cwiseAbs()).minCoeff(&axis);
  return {depth_m, std::copysign(1.0, p_m[axis]) * Eigen::Vector3d::Unit(axis)};
}

/// Of a ball.
Overlap within(const Eigen::Vector3d& half_m, const Eigen::Vector3d& p_m, double radius_m) noexcept {
  const Eigen::Vector3d away_m = p_m - p_m.cwiseMax(-half_m).cwiseMin(half_m);
  const double distance_m = away_m.norm();
  if (distance_m > 0) return {radius_m - distance_m, away_m / distance_m};
  Overlap overlap = within(half_m, p_m);
  overlap.depth_m += radius_m;
  return overlap;
}

void require(bool good, const char* name, double value) {
  if (!good)
    throw std::invalid_argument(std::string("simulated environment: ") + name + " cannot be " +
                                std::to_string(value));
}
void require_positive(double value, const char* name) {
  require(std::isfinite(value) && value > 0, name, value);
}
void require_not_negative(double value, const char* name) {
  require(std::isfinite(value) && value >= 0, name, value);
}
void require_finite(const Eigen::Vector3d& p_m, const char* name) {
  for (const double value : p_m) require(std::isfinite(value), name, value);
}

void check(const Surface& surface) {
  require_positive(surface.stiffness_N_per_m, "stiffness_N_per_m of a surface");
  require_not_negative(surface.loss_s_per_m, "loss_s_per_m of a surface");
  require_not_negative(surface.friction, "friction of a surface");
}
void check(const Block& block) {
  check(block.surface);
  require_finite(block.centre_W_m, "centre_W_m of a block");
  for (const double length_m : block.size_m) require_positive(length_m, "size_m of a block");
}

EnvironmentParameters checked(EnvironmentParameters parameters) {
  require_positive(parameters.tip_radius_m, "tip_radius_m");
  parameters.walls.insert(parameters.walls.begin(), {.surface = parameters.floor});
  for (Wall& wall : parameters.walls) {
    check(wall.surface);
    require_finite(wall.p_W_m, "p_W_m of a wall");
    require_positive(wall.normal_W.norm(), "length of normal_W of a wall");
    wall.normal_W.normalize();
  }
  for (const Block& table : parameters.tables) check(table);
  if (parameters.box) {
    check(parameters.box->block);
    require_positive(parameters.box->mass_kg, "mass_kg of the box");
  }
  if (parameters.spring) {
    require_finite(parameters.spring->p_W_m, "p_W_m of the spring");
    require_not_negative(parameters.spring->stiffness_N_per_m, "stiffness_N_per_m of the spring");
    require_not_negative(parameters.spring->damping_N_s_per_m, "damping_N_s_per_m of the spring");
  }
  return parameters;
}

}  // namespace

Environment::Environment(const EnvironmentParameters& parameters)
    : parameters_(checked(parameters)),
      tip_at_box_(parameters.box ? parameters.box->block.surface : Surface{}) {
  for (const Wall& wall : parameters_.walls)
    at_walls_.push_back({SurfaceContact(wall.surface), SurfaceContact(wall.surface)});
  for (const Block& table : parameters_.tables)
    at_tables_.push_back({SurfaceContact(table.surface), SurfaceContact(table.surface)});
  if (parameters_.box) box_p_W_m_ = parameters_.box->block.centre_W_m;
}

Eigen::Vector3d Environment::step(const Eigen::Vector3d& p_WT_m, const Eigen::Vector3d& v_WT_m_per_s,
                                  double step_s) noexcept {
  Eigen::Vector3d force_W_N = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < at_walls_.size(); ++i) {
    const Overlap overlap = behind(parameters_.walls[i], p_WT_m, parameters_.tip_radius_m);
    force_W_N += at_walls_[i].tip.step(overlap.depth_m, overlap.normal_W, v_WT_m_per_s, step_s);
  }
  for (std::size_t i = 0; i < at_tables_.size(); ++i) {
    const Block& table = parameters_.tables[i];
    const Overlap overlap = within(table.size_m / 2, p_WT_m - table.centre_W_m, parameters_.tip_radius_m);
    force_W_N += at_tables_[i].tip.step(overlap.depth_m, overlap.normal_W, v_WT_m_per_s, step_s);
  }
  if (parameters_.spring)
    force_W_N += parameters_.spring->stiffness_N_per_m * (parameters_.spring->p_W_m - p_WT_m) -
                 parameters_.spring->damping_N_s_per_m * v_WT_m_per_s;
  if (parameters_.box) force_W_N += step_box(p_WT_m, v_WT_m_per_s, step_s);
  return force_W_N;
}

Eigen::Vector3d Environment::step_box(const Eigen::Vector3d& p_WT_m, const Eigen::Vector3d& v_WT_m_per_s,
                                      double step_s) noexcept {
  const FreeBox& box = *parameters_.box;
  const Eigen::Vector3d half_m = box.block.size_m / 2;
  const Overlap at_tip = within(half_m, p_WT_m - box_p_W_m_, parameters_.tip_radius_m);
  Eigen::Vector3d on_tip_W_N =
      tip_at_box_.step(at_tip.depth_m, at_tip.normal_W, v_WT_m_per_s - box_v_W_m_per_s_, step_s);

  Eigen::Vector3d force_W_N = -on_tip_W_N - box.mass_kg * model::kGravity_m_per_s2 * Eigen::Vector3d::UnitZ();
  for (std::size_t i = 0; i < at_walls_.size(); ++i) {
    const Wall& wall = parameters_.walls[i];
    const Overlap overlap = behind(wall, box_p_W_m_, wall.normal_W.cwiseAbs().dot(half_m));
    force_W_N += at_walls_[i].box.step(overlap.depth_m, overlap.normal_W, box_v_W_m_per_s_, step_s);
  }
  for (std::size_t i = 0; i < at_tables_.size(); ++i) {
    const Block& table = parameters_.tables[i];
    // Two blocks overlap if the centre of one is in the other enlarged by it.
    const Overlap overlap = within(half_m + table.size_m / 2, box_p_W_m_ - table.centre_W_m);
    force_W_N += at_tables_[i].box.step(overlap.depth_m, overlap.normal_W, box_v_W_m_per_s_, step_s);
  }
  box_v_W_m_per_s_ += step_s / box.mass_kg * force_W_N;
  box_p_W_m_ += step_s * box_v_W_m_per_s_;
  return on_tip_W_N;
}

}  // namespace sim
