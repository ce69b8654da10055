// The rules in udev/: valid for udev, narrow, and for the devices that the drivers support.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <stdexcept>
#include <string>

#include "drivers/haptic/space_mouse_models.h"
#include "tests/support/built_paths.h"
#include "tests/udev/rules_file.h"

namespace udev {
namespace rules_test {

using drivers::haptic::kSpaceMouseModels;

std::vector<std::filesystem::path> rules_files() {
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::directory_iterator(support::source_dir() + "/udev"))
    if (entry.path().extension() == ".rules") files.push_back(entry.path());
  return files;
}

std::string text_of(const std::filesystem::path& file) {
  std::ostringstream text;
  text << std::ifstream(file).rdbuf();
  return text.str();
}

std::string hex(std::uint16_t id, const char* format) {
  std::array<char, 8> text{};
  (void)std::snprintf(text.data(), text.size(), format, id);
  return text.data();
}

Device usb_device(std::uint16_t vendor, std::uint16_t product) {
  return {
      {{"SUBSYSTEM", "usb"},
       {"KERNEL", "1-1"},
       {"ATTR{idVendor}", hex(vendor, "%04x")},
       {"ATTR{idProduct}", hex(product, "%04x")}},
      {{"SUBSYSTEM", "usb"}, {"KERNEL", "usb1"}, {"ATTR{idVendor}", "1d6b"}, {"ATTR{idProduct}", "0002"}}};
}

constexpr const char* kUsb = "0003";  // as the kernel counts buses
constexpr const char* kBluetooth = "0005";

Device hid_node(const std::string& bus, std::uint16_t vendor, std::uint16_t product,
                const char* kernel = "hidraw0") {
  const std::string name = bus + ":" + hex(vendor, "%04X") + ":" + hex(product, "%04X") + ".0001";
  Device device{{{"SUBSYSTEM", "hidraw"}, {"KERNEL", kernel}}, {{"SUBSYSTEM", "hid"}, {"KERNEL", name}}};
  if (bus == kUsb) {
    device.push_back({{"SUBSYSTEM", "usb"}, {"KERNEL", "1-1:1.0"}});
    device.push_back(usb_device(vendor, product).front());
  }
  return device;
}

bool gets_access(const Device& device) {
  for (const auto& file : rules_files())
    for (const Rule& rule : parse_rules(text_of(file)))
      if (matches(rule, device)) return true;
  return false;
}

TEST(UdevRules, EachFileHasANumberBelow73AndSaysHowToInstallIt) {
  ASSERT_EQ(rules_files().size(), 3U);
  for (const auto& file : rules_files()) {
    const std::string name = file.filename();
    // 73-seat-late.rules is what gives access to the user at the machine.
    EXPECT_EQ(name[2], '-') << name;
    EXPECT_LT(std::stoi(name.substr(0, 2)), 73) << name;
    const std::string text = text_of(file);
    EXPECT_EQ(text[0], '#') << name;
    EXPECT_NE(text.find("copy to /etc/udev/rules.d"), std::string::npos) << name;
    EXPECT_FALSE(parse_rules(text).empty()) << name;
  }
}

TEST(UdevRules, EachRuleNamesAVendorAndOpensItsDevicesToOneGroup) {
  for (const auto& file : rules_files())
    for (const Rule& rule : parse_rules(text_of(file)))
      EXPECT_EQ(problems(rule), std::vector<std::string>{}) << file;
}

TEST(UdevRules, AllDevicesThatTheDriversKnowGetAccess) {
  EXPECT_TRUE(gets_access(usb_device(0x0403, 0xcb48))) << "Novint Falcon";
  for (const int product : {0x0301, 0x0401, 0x0402, 0x0403, 0x040c})
    EXPECT_TRUE(gets_access(usb_device(0x1451, static_cast<std::uint16_t>(product)))) << "Force Dimension";
  for (const auto& model : kSpaceMouseModels)
    for (const char* bus : {kUsb, kBluetooth})
      EXPECT_TRUE(gets_access(hid_node(bus, model.vendor, model.product))) << model.name;
  EXPECT_TRUE(gets_access(hid_node(kUsb, 0x256f, 0xc635, "hidraw12")));
}

TEST(UdevRules, NoOtherDevicesGetAccess) {
  EXPECT_FALSE(gets_access(usb_device(0x0403, 0x6001))) << "FTDI's serial converter";
  EXPECT_FALSE(gets_access(usb_device(0x045e, 0xcb48)));
  EXPECT_FALSE(gets_access(usb_device(0x1d6b, 0x0002))) << "root hub";
  EXPECT_FALSE(gets_access(hid_node(kUsb, 0x046d, 0xc077))) << "Logitech's mouse";
  EXPECT_FALSE(gets_access(hid_node(kBluetooth, 0x046d, 0xb342))) << "Logitech's keyboard";
  // Of Logitech's products with an id like theirs none but theirs.
  for (int product = 0xc600; product < 0xc700; ++product) {
    const auto id = static_cast<std::uint16_t>(product);
    EXPECT_EQ(gets_access(hid_node(kUsb, 0x046d, id)),
              drivers::haptic::space_mouse_model(0x046d, id) != nullptr)
        << std::hex << product;
  }
  // Their number as a product, or in another place.
  EXPECT_FALSE(gets_access(hid_node(kUsb, 0x1234, 0x256f)));
  EXPECT_FALSE(gets_access(hid_node("256F", 0x1234, 0xc635)));
  // A SpaceMouse needs neither raw USB access nor its input device.
  EXPECT_FALSE(gets_access(usb_device(0x256f, 0xc635)));
  Device input = hid_node(kUsb, 0x256f, 0xc635, "event7");
  input.front()["SUBSYSTEM"] = "input";
  EXPECT_FALSE(gets_access(input));
}

// The basis of the checks above.

constexpr const char* kGood =
    R"(SUBSYSTEM=="usb", ATTR{idVendor}=="1451", MODE="0660", GROUP="plugdev", TAG+="uaccess")";

std::vector<std::string> problems_with(const std::string& part, const std::string& other) {
  std::string rule = kGood;
  rule.replace(rule.find(part), part.size(), other);
  return problems(parse_rule(rule));
}

TEST(UdevRulesFile, ReportsMistakesInARule) {
  using Words = std::vector<std::string>;
  EXPECT_EQ(problems(parse_rule(kGood)), Words{});
  EXPECT_EQ(problems_with("0660", "0666"), (Words{"MODE is 0666 instead of 0660"}));
  EXPECT_EQ(problems_with("GROUP=\"plugdev\", ", ""), (Words{"GROUP has to stand there once"}));
  EXPECT_EQ(problems_with("TAG+=", "TAG="), (Words{"TAG wants +="}));
  EXPECT_EQ(problems_with("MODE=", "MODE=="), (Words{"MODE wants ="}));
  EXPECT_EQ(problems_with("ATTR{idVendor}==", "ATTR{idVendor}="),
            (Words{"ATTR{idVendor} wants ==", "no vendor is named"}));
  EXPECT_EQ(problems_with("1451", "*"), (Words{"no vendor is named"}));
  EXPECT_EQ(problems_with("ATTR{idVendor}", "ATTR{idProduct}"), (Words{"no vendor is named"}));
  EXPECT_EQ(problems_with(R"(ATTR{idVendor}=="1451")", R"(KERNELS=="*:256F:*.*|*")"),
            (Words{"no vendor is named"}));
  EXPECT_EQ(problems_with("SUBSYSTEM", "SUBSYSTEMS").size(), 2U);
  for (const char* bad :
       {"SUBSYSTEM==usb", R"(SUBSYSTEM=="usb" MODE="0660")", R"(SUBSYSTEM=="usb",)", "MODE"})
    EXPECT_THROW((void)parse_rule(bad), std::runtime_error) << bad;
}

TEST(UdevRulesFile, MatchesParentsByAllTermsOnOneOfThem) {
  const Device device{{{"SUBSYSTEM", "usb"}, {"KERNEL", "a"}},
                      {{"KERNEL", "b"}, {"ATTR{x}", "1"}},
                      {{"KERNEL", "c"}, {"ATTR{x}", "2"}}};
  EXPECT_TRUE(matches(parse_rule(R"(KERNELS=="c", ATTRS{x}=="2")"), device));
  EXPECT_FALSE(matches(parse_rule(R"(KERNELS=="b", ATTRS{x}=="2")"), device));
  EXPECT_TRUE(matches(parse_rule(R"(KERNELS=="a")"), device));  // the device counts, too
  EXPECT_FALSE(matches(parse_rule(R"(KERNEL=="b")"), device));
  EXPECT_TRUE(matches(parse_rule(R"(KERNELS=="z|[bc]*")"), device));
  EXPECT_FALSE(matches(parse_rule(R"(ATTR{x}=="1")"), device));
}

}  // namespace rules_test
}  // namespace udev
