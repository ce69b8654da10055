#include "hal/haptic/force_dimension_link.h"

#include <array>
#include <utility>

#include "hal/haptic/rethrow.h"

namespace hal {
namespace {

using drivers::haptic::ForceDimension;
using drivers::haptic::ForceDimensionFault;
using drivers::haptic::ForceDimensionInfo;
using drivers::haptic::ForceDimensionSample;
using drivers::haptic::ForceDimensionStatus;

// HapticStatus::detail: the driver's fault above, its detail below.
constexpr unsigned kFaultShift = 24;
constexpr std::uint32_t kDetailMask = (1U << kFaultShift) - 1U;

std::uint32_t packed(const ForceDimensionStatus& status) noexcept {
  return static_cast<std::uint32_t>(status.fault) << kFaultShift |
         (static_cast<std::uint32_t>(status.detail) & kDetailMask);
}

ForceDimensionStatus unpacked(std::uint32_t detail) noexcept {
  return {.fault = static_cast<ForceDimensionFault>(detail >> kFaultShift),
          .detail = static_cast<std::int32_t>(detail & kDetailMask)};
}

HapticFault generic(ForceDimensionFault fault) noexcept {
  switch (fault) {
    case ForceDimensionFault::kNone: return HapticFault::kNone;
    case ForceDimensionFault::kNotOpen: return HapticFault::kNotActive;
    case ForceDimensionFault::kBadCommand: return HapticFault::kBadCommand;
    case ForceDimensionFault::kBadSample: return HapticFault::kBadSample;
    case ForceDimensionFault::kLate:
    case ForceDimensionFault::kStale: return HapticFault::kStale;
    case ForceDimensionFault::kUnplugged: return HapticFault::kUnplugged;
    case ForceDimensionFault::kForceOff:
    case ForceDimensionFault::kSdkError: return HapticFault::kDeviceFault;
  }
  return HapticFault::kDeviceFault;
}

Eigen::Quaterniond rotation(const ForceDimensionSample& sample) noexcept {
  Eigen::Matrix3d matrix;
  for (int row = 0; row < 3; ++row)
    for (int column = 0; column < 3; ++column)
      matrix(row, column) = sample.R_HD[static_cast<std::size_t>(row)][static_cast<std::size_t>(column)];
  return Eigen::Quaterniond(matrix).normalized();
}

}  // namespace

ForceDimensionLink::ForceDimensionLink(ForceDimensionLinkConfig config) : config_(std::move(config)) {
  info_.name = "Force Dimension omega.6";
}

void ForceDimensionLink::open() {
  close();
  if (config_.transport == ForceDimensionTransport::kUsb)
    throw SetupError(
        "Force Dimension omega.6", "open it directly over USB",
        "not supported: the vendor publishes neither its packets nor the calibration data in the "
        "device, so positions and forces would be guesses; use the vendor's SDK");
  with_hal_errors([this] {
    if (config_.look_at_bus) config_.look_at_bus();
    const drivers::haptic::ForceDimensionLibrary library(config_.sdk);
    device_ = std::make_unique<ForceDimension>(library, config_.device);
  });
  const ForceDimensionInfo& told = device_->info();
  info_ = {.name = told.name,
           .force_limit_N = told.force_limit_N,
           .senses_rotation = true,
           .warnings = told.warnings};
}

bool ForceDimensionLink::close() noexcept {
  if (device_) force_off_ = device_->stop();
  device_.reset();
  return force_off_;
}

HapticStatus ForceDimensionLink::exchange(const HapticCommand& command, std::chrono::nanoseconds now,
                                          HapticSample& sample) noexcept {
  if (!device_) return {HapticFault::kNotActive};
  const Eigen::Vector3d& f_N = command.f_D_H_N;
  const std::chrono::nanoseconds before = sample.stamp;
  ForceDimensionSample measured;
  measured.stamp = before;
  const ForceDimensionStatus status =
      device_->exchange({.enable = command.enable, .f_D_H_N = {f_N.x(), f_N.y(), f_N.z()}}, now, measured);
  if (measured.stamp != before) {
    const Eigen::Quaterniond turned = rotation(measured);
    sample.stamp = measured.stamp;
    sample.p_HD_m = {measured.p_HD_m[0], measured.p_HD_m[1], measured.p_HD_m[2]};
    sample.q_HD = turned;
    sample.buttons = measured.buttons;
  }
  const std::array<double, 3>& sent_N = status.f_D_H_N;
  return {.fault = generic(status.fault),
          .saturated = status.saturated,
          .detail = packed(status),
          .f_D_H_N = {sent_N[0], sent_N[1], sent_N[2]}};
}

std::string ForceDimensionLink::describe(const HapticStatus& status) const {
  const ForceDimensionStatus own = unpacked(status.detail);
  // What the servo found by itself has no such code.
  if (own.ok() || generic(own.fault) != status.fault) return hal::describe(status.fault);
  return drivers::haptic::describe(own);
}

}  // namespace hal
