/// @file
/// The 3Dconnexion devices that report six axes. What the vendor sells besides (mice, keypads, receivers of
/// those) is not listed, and left alone; the udev rules name the same devices. Source: spacenavd (src/dev.c)
/// and PySpaceMouse (devices.toml). Which of the report layouts a device has is told by its reports' length.
#pragma once
#include <array>
#include <cstdint>

namespace drivers::haptic {

struct SpaceMouseModel {
  std::uint16_t vendor;
  std::uint16_t product;
  const char* name;
};

inline constexpr std::uint16_t kVendor3Dconnexion = 0x256f;
inline constexpr std::uint16_t kVendorLogitech = 0x046d;  ///< sold 3Dconnexion's devices at first

inline constexpr std::array<SpaceMouseModel, 21> kSpaceMouseModels{{
    {kVendorLogitech, 0xc603, "SpaceMouse Plus XT"},
    {kVendorLogitech, 0xc605, "CADman"},
    {kVendorLogitech, 0xc606, "SpaceMouse Classic"},
    {kVendorLogitech, 0xc621, "SpaceBall 5000"},
    {kVendorLogitech, 0xc623, "SpaceTraveler"},
    {kVendorLogitech, 0xc625, "SpacePilot"},
    {kVendorLogitech, 0xc626, "SpaceNavigator"},
    {kVendorLogitech, 0xc627, "SpaceExplorer"},
    {kVendorLogitech, 0xc628, "SpaceNavigator for Notebooks"},
    {kVendorLogitech, 0xc629, "SpacePilot Pro"},
    {kVendorLogitech, 0xc62b, "SpaceMouse Pro"},
    {kVendor3Dconnexion, 0xc62e, "SpaceMouse Wireless (cable)"},
    {kVendor3Dconnexion, 0xc62f, "SpaceMouse Wireless (receiver)"},
    {kVendor3Dconnexion, 0xc631, "SpaceMouse Pro Wireless (cable)"},
    {kVendor3Dconnexion, 0xc632, "SpaceMouse Pro Wireless (receiver)"},
    {kVendor3Dconnexion, 0xc633, "SpaceMouse Enterprise"},
    {kVendor3Dconnexion, 0xc635, "SpaceMouse Compact"},
    {kVendor3Dconnexion, 0xc636, "SpaceMouse Module"},
    {kVendor3Dconnexion, 0xc638, "SpaceMouse Pro Wireless (Bluetooth)"},
    {kVendor3Dconnexion, 0xc63a, "SpaceMouse Wireless (Bluetooth)"},
    {kVendor3Dconnexion, 0xc652, "SpaceMouse at a Universal Receiver"},
}};

/// Null for what is none of them.
constexpr const SpaceMouseModel* space_mouse_model(std::uint16_t vendor, std::uint16_t product) noexcept {
  for (const SpaceMouseModel& model : kSpaceMouseModels)
    if (model.vendor == vendor && model.product == product) return &model;
  return nullptr;
}

}  // namespace drivers::haptic
