/// @file
/// Compares the four mecanum wheels, which have three degrees of freedom: the reading of each follows from
/// the other three.
#pragma once
#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <optional>

#include "control/link_map.h"
#include "control/plausibility/sample_time.h"

namespace control {

/// Rolling wheels obey n·w = 0, with n the null space of the link map. A wheel whose reading is k times its
/// motion violates this by the same factor all the way from rest; a slipping wheel violates it by a varying
/// factor, and rolls at first. The torques identify the wheel: with its reading corrected, the wheels move as
/// they are driven. Detection takes half a radian of a wheel or more, some centimetres. The check is for a
/// fault that no check of a single joint detects: the same factor on position and velocity from the start.
/// Blocks begin and end with samples of known time. One thread. Cycle: update() and restart() neither
/// allocate nor throw.
class WheelAgreement {
 public:
  void restart() noexcept;
  /// Call with each fresh sample. Returns the wrong wheel, 0 to 3, or -1 if two wheels explain the readings
  /// equally well.
  std::optional<int> update(const WheelVector& position_rad, const WheelVector& torque_Nm,
                            const SampleTime& time) noexcept;

 private:
  struct Block {
    WheelVector way_rad = WheelVector::Zero();
    WheelVector torque_Nm_s = WheelVector::Zero();
    double duration_s = 0.0;
  };
  /// Hypothesis that one wheel's reading is a multiple of its motion.
  struct Explanation {
    bool holds = false;
    double cosine = 0.0;  ///< between the wheels' torques and their motion with that reading corrected
  };
  void merge() noexcept;
  std::optional<int> judge() const noexcept;
  Explanation explain(int wheel) const noexcept;
  /// Motion of the wheels if the reading of `wheel` is wrong.
  static WheelVector mended(const Block& block, int wheel) noexcept;
  /// Whether the wheel's reading has been the same multiple of its motion since rest.
  bool on_a_line(int wheel) const noexcept;
  static constexpr std::size_t kBlocks = 8;

  bool known_ = false;
  WheelVector position_rad_ = WheelVector::Zero();
  Block block_;                          // the current block
  std::array<Block, kBlocks> blocks_{};  // since the wheels began to turn
  std::size_t count_ = 0;
  double block_length_s_ = 0.0;
};

}  // namespace control
