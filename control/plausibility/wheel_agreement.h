/// @file
/// Four mecanum wheels have three degrees of freedom: what one of them reports follows from the other three.
#pragma once
#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <optional>

#include "control/link_map.h"
#include "control/plausibility/sample_time.h"

namespace control {

/// Rolling wheels obey n·w = 0, with n the null space of the link map. A wheel whose reading is k times its
/// motion breaks that by the same factor all the way from rest; a wheel that slips breaks it by a varying
/// one, and begins by rolling. Which wheel it is follows from the torques: with its reading mended, the
/// wheels move as they are driven. It takes half a radian of a wheel or more, some centimetres, and is for
/// what no check of a single joint sees: a factor on position and velocity alike from the beginning on.
/// Blocks begin and end with samples whose time is known. One thread. Cycle: update() and restart() neither
/// allocate nor throw.
class WheelAgreement {
 public:
  void restart() noexcept;
  /// With each fresh sample. A wheel, 0 to 3, or -1 where two explain it equally well.
  std::optional<int> update(const WheelVector& position_rad, const WheelVector& torque_Nm,
                            const SampleTime& time) noexcept;

 private:
  struct Block {
    WheelVector way_rad = WheelVector::Zero();
    WheelVector torque_Nm_s = WheelVector::Zero();
    double duration_s = 0.0;
  };
  /// That one wheel's reading is a multiple of its motion.
  struct Explanation {
    bool holds = false;
    double cosine = 0.0;  ///< between the wheels' torques and their motion with that reading mended
  };
  void merge() noexcept;
  std::optional<int> judge() const noexcept;
  Explanation explain(int wheel) const noexcept;
  /// The wheels' way if `wheel` is the one that lies.
  static WheelVector mended(const Block& block, int wheel) noexcept;
  /// That the wheel's reading has been the same multiple of its way since rest.
  bool on_a_line(int wheel) const noexcept;
  static constexpr std::size_t kBlocks = 8;

  bool known_ = false;
  WheelVector position_rad_ = WheelVector::Zero();
  Block block_;                          // the one that is being filled
  std::array<Block, kBlocks> blocks_{};  // since the wheels began to turn
  std::size_t count_ = 0;
  double block_length_s_ = 0.0;
};

}  // namespace control
