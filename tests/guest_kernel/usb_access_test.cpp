// Our rules, applied by udev itself to devices of the kernel.
#include <gtest/gtest.h>

#include <ostream>
#include <string>

#include "tests/guest_kernel/device_node.h"
#include "tests/guest_kernel/usbip_device.h"
#include "tests/guest_kernel/wait_until.h"

namespace guest {
namespace usb_access_test {

/// Found and named only.
class IdleFunction final : public UsbFunction {
 public:
  Handshake control(const UsbSetup& /*setup*/, Bytes& /*data*/) override { return Handshake::kStall; }
  Handshake out(std::uint8_t /*endpoint*/, std::span<const std::uint8_t> /*bytes*/) override {
    return Handshake::kStall;
  }
  Handshake in(std::uint8_t /*endpoint*/, Bytes& /*packet*/) override { return Handshake::kNak; }
};

struct Case {
  const char* name;
  std::uint16_t vendor;
  std::uint16_t product;
  NodeAccess access;
};
void PrintTo(const Case& device, std::ostream* stream) { *stream << device.name; }

const NodeAccess kOurs{0660, "plugdev"};
const NodeAccess kDebians{0664, "root"};  // 50-udev-default.rules

class UsbAccess : public testing::TestWithParam<Case> {};

TEST_P(UsbAccess, IsForPlugdevWhenTheDeviceIsOneOfOurs) {
  const auto& [name, vendor, product, access] = GetParam();
  IdleFunction function;
  const UsbipDevice device(
      {.identity = {.vendor = vendor, .product = product},
       .speed = UsbSpeed::kHigh,
       .endpoints = {{.address = 0x02, .packet_bytes = 512}, {.address = 0x81, .packet_bytes = 512}}},
      function);
  const auto node = wait_for([&] { return find_usb_node(vendor, product); });
  ASSERT_TRUE(node) << "the kernel did not find it";
  EXPECT_EQ(access_by_udev(*node), access) << *node;
  EXPECT_FALSE(opens_for_a_user(*node));
  EXPECT_EQ(opens_for_a_user(*node, "plugdev"), access == kOurs);
}

INSTANTIATE_TEST_SUITE_P(Devices, UsbAccess,
                         testing::Values(Case{"Omega", 0x1451, 0x0402, kOurs},
                                         Case{"Falcon", 0x0403, 0xcb48, kOurs},
                                         Case{"AnotherFtdiChip", 0x0403, 0x6001, kDebians},
                                         Case{"AnotherVendor", 0x1d6b, 0x0104, kDebians}),
                         [](const auto& test) { return std::string(test.param.name); });

}  // namespace usb_access_test
}  // namespace guest
