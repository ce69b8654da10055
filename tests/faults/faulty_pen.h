/// @file
/// A haptic device with faults from a script.
#pragma once
#include <limits>
#include <memory>
#include <utility>

#include "hal/haptic_link.h"

namespace faults {

struct PenFaults {
  bool unplugged = false;
  bool broken = false;  ///< reports a fault of its own
  bool stale = false;   ///< no new sample
  bool frozen = false;  ///< the same position in new samples
  bool not_finite = false;
  bool not_ready = false;
  bool refuses_force = false;  ///< the device's motors are off, whatever it is sent
  double scale = 1.0;          ///< of the position
  Eigen::Vector3d jump_m = Eigen::Vector3d::Zero();
  std::uint32_t buttons_stuck = 0;
  bool buttons_bounce = false;
};

/// `faults` must outlive the link.
class FaultyPen final : public hal::HapticLink {
 public:
  FaultyPen(std::unique_ptr<hal::HapticLink> pen, const PenFaults& faults)
      : pen_(std::move(pen)), faults_(faults) {}

  const hal::HapticInfo& info() const noexcept override { return pen_->info(); }
  void open() override;
  bool close() noexcept override { return pen_->close() && !faults_.unplugged; }
  hal::HapticStatus exchange(const hal::HapticCommand& command, std::chrono::nanoseconds now,
                             hal::HapticSample& sample) noexcept override;

 private:
  std::unique_ptr<hal::HapticLink> pen_;
  const PenFaults& faults_;
  bool lost_ = false;  // until it is opened again
  hal::HapticSample last_;
  unsigned exchanges_ = 0;
};

}  // namespace faults
