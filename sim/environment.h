/// @file
/// What the tip of the simulated robot touches: floor, walls, tables, a box that can be pushed, a spring.
///
/// Frame W (control/planar.h); the floor is z = 0. The tip is a ball. SI units. Errors: std::invalid_argument
/// from the constructor. One thread; step() neither allocates nor locks.
#pragma once
#include <Eigen/Core>
#include <optional>
#include <vector>

#include "sim/surface_contact.h"

namespace sim {

/// Everything behind a plane.
struct Wall {
  Eigen::Vector3d p_W_m = Eigen::Vector3d::Zero();
  Eigen::Vector3d normal_W = Eigen::Vector3d::UnitZ();  ///< out of the wall; its length does not matter
  Surface surface{};
};

/// A body with edges along the axes of W.
struct Block {
  Eigen::Vector3d centre_W_m = Eigen::Vector3d::Zero();
  Eigen::Vector3d size_m = Eigen::Vector3d::Ones();
  Surface surface{};
};

/// A block that is free. It slides and falls but does not turn: a table carries it until all of it is past
/// the edge.
struct FreeBox {
  Block block{};
  double mass_kg = 0.5;
};

/// Holds the tip from all sides, as somebody does who keeps it.
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

/// Where two bodies meet, the surface of the one that stands counts; between tip and box that of the box.
class Environment {
 public:
  /// @throws std::invalid_argument naming what is not finite or not positive.
  explicit Environment(const EnvironmentParameters& parameters = {});

  /// One step with the tip there and moving so; returns the force on the tip, in W. Sets the box in motion.
  Eigen::Vector3d step(const Eigen::Vector3d& p_WT_m, const Eigen::Vector3d& v_WT_m_per_s,
                       double step_s) noexcept;

  /// Of the box; meaningless without one.
  const Eigen::Vector3d& box_p_W_m() const noexcept { return box_p_W_m_; }
  const Eigen::Vector3d& box_v_W_m_per_s() const noexcept { return box_v_W_m_per_s_; }
  void push_box(const Eigen::Vector3d& velocity_m_per_s) noexcept { box_v_W_m_per_s_ = velocity_m_per_s; }

 private:
  /// Of tip and box with one body that stands.
  struct Touch {
    SurfaceContact tip;
    SurfaceContact box;
  };
  Eigen::Vector3d step_box(const Eigen::Vector3d& p_WT_m, const Eigen::Vector3d& v_WT_m_per_s,
                           double step_s) noexcept;

  EnvironmentParameters parameters_;  // of the walls the first is the floor
  std::vector<Touch> at_walls_;
  std::vector<Touch> at_tables_;
  SurfaceContact tip_at_box_;
  Eigen::Vector3d box_p_W_m_ = Eigen::Vector3d::Zero();
  Eigen::Vector3d box_v_W_m_per_s_ = Eigen::Vector3d::Zero();
};

}  // namespace sim
