/// @file
/// The handle in the operator's hand: that of the emulated Falcon, or of the stand-in omega.6.
#pragma once
#include <fcntl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <Eigen/Core>
#include <cerrno>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <new>
#include <system_error>

#include "sim/devices/emulated_falcon.h"
#include "sim/devices/force_dimension_stand_in.h"
#include "tests/support/mock_falcon.h"

namespace end_to_end {

/// Positions in the device's frame H: x towards the operator, y to the operator's right, z up, from the
/// origin.
class Grip {
 public:
  virtual ~Grip() = default;
  virtual void put(const Eigen::Vector3d& p_HD_m) = 0;
  virtual void press(bool gripper_button) = 0;
};

/// On a mocked kernel's USB.
class FalconGrip final : public Grip {
 public:
  explicit FalconGrip(support::MockUsbBus& bus) : falcon_(bus, {.firmware_running = true}) {}
  /// As requested by the light.
  void pull_and_push() {
    falcon_.with([](sim::devices::EmulatedFalcon& device) { device.pull_and_push(); });
  }
  void put(const Eigen::Vector3d& p_HD_m) override {
    // Its own axes: x right, y up, z out towards the user, from its base.
    constexpr double kOrigin_m = 0.13;
    falcon_.with([&](sim::devices::EmulatedFalcon& device) {
      device.move_grip({p_HD_m.y(), p_HD_m.z(), p_HD_m.x() + kOrigin_m});
    });
  }
  void press(bool gripper_button) override {
    falcon_.with([&](sim::devices::EmulatedFalcon& device) { device.press(gripper_button ? 1 : 0); });
  }

 private:
  support::MockFalcon falcon_;
};

/// In the stand-in for the vendor's library, which youbotd loads, with the device on a mocked kernel's USB.
class OmegaGrip final : public Grip {
 public:
  /// Configures, through the environment, the programs that are started from now on.
  OmegaGrip(support::MockUsbBus& bus, const std::filesystem::path& file)
      : omega_(bus, {.vendor = 0x1451, .product = 0x0402, .product_name = "omega.x haptic device"}) {
    const int descriptor = ::open(file.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0600);
    if (descriptor < 0 || ::ftruncate(descriptor, sizeof(sim::devices::DistantHand)) != 0)
      throw std::system_error(errno, std::generic_category(), file.string());
    void* const mapped =
        ::mmap(nullptr, sizeof(sim::devices::DistantHand), PROT_READ | PROT_WRITE, MAP_SHARED, descriptor, 0);
    ::close(descriptor);
    if (mapped == MAP_FAILED) throw std::system_error(errno, std::generic_category(), file.string());
    hand_ = new (mapped) sim::devices::DistantHand{};
    ::setenv(sim::devices::kDistantHandVariable, file.c_str(), 1);
  }
  OmegaGrip(const OmegaGrip&) = delete;
  OmegaGrip& operator=(const OmegaGrip&) = delete;
  ~OmegaGrip() override {
    ::unsetenv(sim::devices::kDistantHandVariable);
    ::munmap(hand_, sizeof(sim::devices::DistantHand));
  }
  void put(const Eigen::Vector3d& p_HD_m) override {
    for (std::size_t i = 0; i < 3; ++i) hand_->p_HD_m[i] = p_HD_m[static_cast<Eigen::Index>(i)];
  }
  void press(bool gripper_button) override { hand_->buttons = gripper_button ? 1 : 0; }

 private:
  support::MockUsbDevice omega_;
  sim::devices::DistantHand* hand_ = nullptr;
};

}  // namespace end_to_end
