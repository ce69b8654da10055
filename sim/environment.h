/// @file
/// Objects that the simulated end effector can touch: floor, walls, tables, a movable box, a spring.
///
/// Frame W (control/planar.h); the floor is z = 0. The end effector is a ball. SI units. Errors:
/// std::invalid_argument from the constructor. One thread; step() neither allocates nor locks.
#pragma once
#include <Eigen/Core>
#include <optional>
#include <vector>

#include "sim/surface_contact.h"

namespace sim {

/// The half space behind a plane.
struct Wall {
  Eigen::Vector3d p_W_m = Eigen::Vector3d::Zero();
  Eigen::Vector3d normal_W = Eigen::Vector3d::UnitZ();  ///< out of the wall; any length
  Surface surface{};
};

/// A block with edges along the axes of W.
struct Block {
  Eigen::Vector3d centre_W_m = Eigen::Vector3d::Zero();
  Eigen::Vector3d size_m = Eigen::Vector3d::Ones();
  Surface surface{};
};

/// A free block. It slides and falls but does not turn: a table supports it until all of it is past the edge.
struct FreeBox {
  Block block{};
  double mass_kg = 0.5;
};

/// Holds the end effector from all sides, like a person who holds it.
struct TetherSpring {
  Eigen::Vector3d p_W_m = Eigen::Vector3d::Zero();
  double stiffness_N_per_m = 500.0;
  double damping_N_s_per_m = 0.0;
};

struct EnvironmentParameters {
  double tip_radius_m = 0.01;
  Surface floor{};
  std::vector<Wall> walls{};
  std::vector<Block> tables{};
  std::optional<FreeBox> box{};
  std::optional<TetherSpring> spring{};
};

/// Between two bodies, the surface properties of the fixed one apply; between end effector and box those of
/// the box.
class Environment {
 public:
  /// @throws std::invalid_argument naming the value that is not finite or not positive.
  explicit Environment(const EnvironmentParameters& parameters = {});

  /// One step with the end effector at this pose and velocity; returns the force on it, in W. Moves the box.
  Eigen::Vector3d step(const Eigen::Vector3d& p_WT_m, const Eigen::Vector3d& v_WT_m_per_s,
                       double step_s) noexcept;

  /// Of the box; undefined without one.
  const Eigen::Vector3d& box_p_W_m() const noexcept { return box_p_W_m_; }
  const Eigen::Vector3d& box_v_W_m_per_s() const noexcept { return box_v_W_m_per_s_; }
  void push_box(const Eigen::Vector3d& velocity_m_per_s) noexcept { box_v_W_m_per_s_ = velocity_m_per_s; }

 private:
  /// Contact of end effector and box with one fixed body.
  struct Touch {
    SurfaceContact tip;
    SurfaceContact box;
  };
  Eigen::Vector3d step_box(const Eigen::Vector3d& p_WT_m, const Eigen::Vector3d& v_WT_m_per_s,
                           double step_s) noexcept;

  EnvironmentParameters parameters_;  // the first wall is the floor
  std::vector<Touch> at_walls_;
  std::vector<Touch> at_tables_;
  SurfaceContact tip_at_box_;
  Eigen::Vector3d box_p_W_m_ = Eigen::Vector3d::Zero();
  Eigen::Vector3d box_v_W_m_per_s_ = Eigen::Vector3d::Zero();
};

}  // namespace sim
