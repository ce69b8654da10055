#include "drivers/usb/usb_access.h"

#include <grp.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <filesystem>
#include <functional>
#include <string>

#include "drivers/usb/system_paths.h"
#include "tests/support/skip.h"
#include "tests/support/temporary_directory.h"

namespace drivers::usb {
namespace usb_access_test {

namespace fs = std::filesystem;

#define EXPECT_SAYS(text, part) \
  EXPECT_NE((text).find(part), std::string::npos) << (text) << "\nlacks: " << (part)

const UsbDevice kFalcon{.vendor = 0x0403,
                        .product = 0xcb48,
                        .bus = 1,
                        .address = 5,
                        .port_path = "1-2",
                        .product_name = "FALCON HAPTIC"};

/// All is well.
AccessFacts good_facts() {
  AccessFacts facts;
  facts.device = kFalcon;
  facts.on_bus = true;
  facts.node = "/dev/bus/usb/001/005";
  facts.node_folder_there = true;
  facts.node_there = true;
  facts.may_use_node = true;
  facts.node_mode = 0660;
  facts.node_owner = "root";
  facts.node_group = "plugdev";
  facts.user = "ada";
  facts.in_group = true;
  facts.listed_in_group = true;
  facts.rules_file = "60-novint-falcon.rules";
  facts.rules_installed = "/etc/udev/rules.d/60-novint-falcon.rules";
  facts.all_processes_seen = true;
  return facts;
}

/// As without a rule: root's, others may read.
AccessFacts denied_facts() {
  AccessFacts facts = good_facts();
  facts.may_use_node = false;
  facts.node_mode = 0664;
  facts.node_group = "root";
  facts.in_group = false;
  facts.listed_in_group = false;
  facts.rules_installed = "";
  return facts;
}

TEST(UsbAccess, FreeDeviceNeedsNoAdvice) {
  const AccessVerdict verdict = judge_access(good_facts());
  EXPECT_EQ(verdict.access, Access::kFree);
  EXPECT_EQ(verdict.hint, "");
  EXPECT_SAYS(verdict.found, "/dev/bus/usb/001/005");
}

TEST(UsbAccess, AbsentDevicePointsAtCableAndPowerAndNamesWhatTheVendorHasThere) {
  AccessFacts facts;
  facts.device = {.vendor = 0x1451, .product = 0x0402};
  AccessVerdict verdict = judge_access(facts);
  EXPECT_EQ(verdict.access, Access::kNotOnBus);
  EXPECT_EQ(verdict.found, "no 1451:0402 on the bus");
  EXPECT_SAYS(verdict.hint, "switched on");
  EXPECT_SAYS(verdict.hint, "cable");
  facts.same_vendor = {"omega.x (1451:0301) at 1-1", "sigma.7 (1451:0403) at 1-3"};
  verdict = judge_access(facts);
  EXPECT_SAYS(verdict.found,
              "of this vendor there is omega.x (1451:0301) at 1-1, sigma.7 (1451:0403) at 1-3");
}

TEST(UsbAccess, AMissingNodeIsDistinguishedFromItsFolder) {
  AccessFacts facts = good_facts();
  facts.node_there = false;
  EXPECT_EQ(judge_access(facts).access, Access::kNoNode);
  EXPECT_SAYS(judge_access(facts).found, "no node /dev/bus/usb/001/005");
  EXPECT_SAYS(judge_access(facts).hint, "plug it in again");
  facts.node_folder_there = false;
  EXPECT_EQ(judge_access(facts).access, Access::kNoNode);
  EXPECT_SAYS(judge_access(facts).hint, "give it /dev/bus/usb");
  EXPECT_SAYS(judge_access(facts).hint, "189");
}

TEST(UsbAccess, DeniedReportsModeOwnerAndGroup) {
  const AccessVerdict verdict = judge_access(denied_facts());
  EXPECT_EQ(verdict.access, Access::kDenied);
  EXPECT_EQ(verdict.found,
            "/dev/bus/usb/001/005 with mode 0664, owner root, group root, and user ada not in that group");
}

TEST(UsbAccess, WithoutItsRuleTheRuleIsToBeInstalled) {
  AccessFacts facts = denied_facts();
  EXPECT_SAYS(judge_access(facts).hint,
              "install the rule udev/60-novint-falcon.rules: copy it to /etc/udev/rules.d");
  EXPECT_SAYS(judge_access(facts).hint, "udevadm control --reload");
  EXPECT_SAYS(judge_access(facts).hint, "plug the device in again");
  facts.rules_file = "";
  EXPECT_SAYS(judge_access(facts).hint, "a udev rule for 0403:cb48");
}

TEST(UsbAccess, RuleThatCameAfterTheDeviceNeedsItPluggedInAgain) {
  AccessFacts facts = denied_facts();
  facts.rules_installed = "/lib/udev/rules.d/60-novint-falcon.rules";
  EXPECT_SAYS(judge_access(facts).hint,
              "/lib/udev/rules.d/60-novint-falcon.rules is installed but was not applied");
  facts.node_group = "plugdev";
  facts.node_mode = 0600;
  EXPECT_SAYS(judge_access(facts).hint, "was not applied");
}

TEST(UsbAccess, UserOutsideTheGroupIsToJoinItOrToLogInAgain) {
  AccessFacts facts = good_facts();
  facts.may_use_node = false;
  facts.in_group = false;
  EXPECT_SAYS(judge_access(facts).hint,
              "ada is in group plugdev but this session began before that: log out");
  facts.listed_in_group = false;
  EXPECT_SAYS(judge_access(facts).hint, "sudo adduser ada plugdev");
  facts.in_group = true;
  EXPECT_SAYS(judge_access(facts).hint, "security module");
  EXPECT_SAYS(judge_access(facts).found, "user ada in that group");
}

TEST(UsbAccess, KernelsDriverIsNamedWithTheWayToTakeItOff) {
  AccessFacts facts = good_facts();
  facts.driver = "ftdi_sio";
  facts.interface = 1;
  const AccessVerdict verdict = judge_access(facts);
  EXPECT_EQ(verdict.access, Access::kDriverBound);
  EXPECT_SAYS(verdict.found, "driver ftdi_sio bound to interface 1");
  EXPECT_SAYS(verdict.hint, "echo -n 1-2:1.1 | sudo tee /sys/bus/usb/drivers/ftdi_sio/unbind");
}

TEST(UsbAccess, ProgramThatHasItIsNamed) {
  AccessFacts facts = good_facts();
  facts.holders = {{4711, "HapticDesk", false}};
  EXPECT_EQ(judge_access(facts).access, Access::kFree) << "open is not claimed";
  facts.driver = "usbfs";
  EXPECT_EQ(judge_access(facts).access, Access::kInUse);
  EXPECT_EQ(judge_access(facts).found, "interface 0 in use by HapticDesk (pid 4711)");
  facts.holders.push_back({12, "youbotd", true});
  EXPECT_SAYS(judge_access(facts).found, "HapticDesk (pid 4711), this program itself");
}

TEST(UsbAccess, ProgramThatCannotBeSeenIsAnotherUsers) {
  AccessFacts facts = good_facts();
  facts.claim_refused = true;
  EXPECT_EQ(judge_access(facts).access, Access::kInUse);
  EXPECT_SAYS(judge_access(facts).found, "by another program");
  facts.all_processes_seen = false;
  EXPECT_SAYS(judge_access(facts).found, "by another user's program");
  EXPECT_SAYS(judge_access(facts).hint, "sudo lsof /dev/bus/usb/001/005");
}

TEST(UsbAccess, TheFirstObstacleIsReportedFirst) {
  AccessFacts facts = denied_facts();
  facts.driver = "ftdi_sio";
  facts.claim_refused = true;
  EXPECT_EQ(judge_access(facts).access, Access::kDenied);
  facts.node_there = false;
  EXPECT_EQ(judge_access(facts).access, Access::kNoNode);
  facts.on_bus = false;
  EXPECT_EQ(judge_access(facts).access, Access::kNotOnBus);
}

/// A machine in a folder.
class UsbAccessFacts : public testing::Test {
 protected:
  UsbAccessFacts() {
    paths_ = {.sys = machine_ / "sys",
              .proc = machine_ / "proc",
              .dev = machine_ / "dev",
              .rule_directories = {machine_ / "etc/udev/rules.d", machine_ / "lib/udev/rules.d"}};
    (void)machine_.write("sys/bus/usb/devices/1-2/devnum", "5\n");
    (void)machine_.write("sys/bus/usb/devices/1-2/bConfigurationValue", "1\n");
    node_ = machine_.write("dev/bus/usb/001/005", "");
    fs::permissions(node_, static_cast<fs::perms>(0640));
    fs::create_directories(paths_.proc);
  }
  AccessFacts facts() const {
    return collect_access_facts(UsbContext(paths_), kFalcon, 0, "60-novint-falcon.rules");
  }
  void bind(const std::string& driver) const {
    const fs::path interface = paths_.sys / "bus/usb/devices/1-2:1.0";
    fs::create_directories(interface);
    fs::create_directory_symlink("../../drivers/" + driver, interface / "driver");
  }
  void open_in(const std::string& pid, const std::string& command) const {
    (void)machine_.write("proc/" + pid + "/comm", command + "\n");
    fs::create_directories(paths_.proc / pid / "fd");
    fs::create_symlink("/dev/null", paths_.proc / pid / "fd/0");
    fs::create_symlink(node_, paths_.proc / pid / "fd/3");
  }

  support::TemporaryDirectory machine_;
  SystemPaths paths_;
  fs::path node_;
};

TEST_F(UsbAccessFacts, NodeIsReadFromTheFileSystem) {
  const AccessFacts found = facts();
  EXPECT_TRUE(found.on_bus);
  EXPECT_TRUE(found.node_folder_there);
  EXPECT_TRUE(found.node_there);
  EXPECT_EQ(found.node, node_.string());
  EXPECT_EQ(found.node_mode, 0640U);
  EXPECT_EQ(found.rules_installed, "");
  EXPECT_EQ(found.driver, "");
  EXPECT_TRUE(found.holders.empty());
}

TEST_F(UsbAccessFacts, WhatIsMissingIsSeen) {
  fs::remove(node_);
  EXPECT_FALSE(facts().node_there);
  EXPECT_TRUE(facts().node_folder_there);
  fs::remove_all(paths_.dev);
  EXPECT_FALSE(facts().node_folder_there);
  (void)machine_.write("sys/bus/usb/devices/1-2/devnum", "6\n");
  EXPECT_FALSE(facts().on_bus) << "plugged in again, it is another one";
}

TEST_F(UsbAccessFacts, RuleIsFoundWhereverUdevLooks) {
  (void)machine_.write("lib/udev/rules.d/60-force-dimension.rules", "");
  EXPECT_EQ(facts().rules_installed, "") << "another device's";
  const fs::path rules = machine_.write("lib/udev/rules.d/60-novint-falcon.rules", "");
  EXPECT_EQ(facts().rules_installed, rules.string());
}

TEST_F(UsbAccessFacts, DriverIsNamedFromItsLink) {
  bind("ftdi_sio");
  EXPECT_EQ(facts().driver, "ftdi_sio");
  EXPECT_EQ(kernel_driver_of(kFalcon, 1, paths_), "");
}

TEST_F(UsbAccessFacts, HoldersAreFoundAmongTheProcesses) {
  open_in("4711", "HapticDesk");
  open_in(std::to_string(getpid()), "test");
  (void)machine_.write("proc/12/comm", "other\n");
  fs::create_directories(paths_.proc / "12/fd");
  fs::create_directories(paths_.proc / "sys/fd");
  const AccessFacts found = facts();
  ASSERT_EQ(found.holders.size(), 2U);
  for (const NodeHolder& holder : found.holders) {
    EXPECT_EQ(holder.is_this_process, holder.pid == getpid());
    EXPECT_EQ(holder.command, holder.is_this_process ? "test" : "HapticDesk");
  }
  EXPECT_TRUE(found.all_processes_seen);
}

/// Runs `check` as a user without rights; 0 if it passed.
int as_nobody(const std::function<bool()>& check) {
  const pid_t child = fork();
  if (child == 0) {
    constexpr uid_t kNobody = 65534;
    const bool became = setgroups(0, nullptr) == 0 && setgid(kNobody) == 0 && setuid(kNobody) == 0;
    _exit(became && check() ? 0 : 1);
  }
  int status = -1;
  waitpid(child, &status, 0);
  return status;
}

TEST_F(UsbAccessFacts, UserNobodyIsDeniedWithTheReason) {
  SKIP_UNLESS(geteuid() == 0, "needs root, to become nobody");
  fs::permissions(machine_.path(), static_cast<fs::perms>(0755));
  // libusb starts a thread, which a child may not do under the thread sanitizer: so before.
  const UsbContext context(paths_);
  EXPECT_EQ(as_nobody([&] {
              const AccessFacts found = collect_access_facts(context, kFalcon, 0, "60-novint-falcon.rules");
              const AccessVerdict verdict = judge_access(found);
              return !found.may_use_node && !found.in_group && verdict.access == Access::kDenied &&
                     verdict.found.find("mode 0640, owner root, group root") != std::string::npos;
            }),
            0);
  const auto may_use = [&] {
    return collect_access_facts(context, kFalcon, 0, "60-novint-falcon.rules").may_use_node;
  };
  fs::permissions(node_, static_cast<fs::perms>(0664));
  EXPECT_NE(as_nobody(may_use), 0) << "reading is not enough";
  fs::permissions(node_, static_cast<fs::perms>(0666));
  EXPECT_EQ(as_nobody(may_use), 0);
}

TEST_F(UsbAccessFacts, ProcessesOfOthersAreNotOverlooked) {
  SKIP_UNLESS(geteuid() == 0, "needs root, to become nobody");
  fs::permissions(machine_.path(), static_cast<fs::perms>(0755));
  open_in("4711", "HapticDesk");
  fs::permissions(paths_.proc / "4711/fd", static_cast<fs::perms>(0700));
  const UsbContext context(paths_);
  EXPECT_EQ(as_nobody([&] {
              const AccessFacts found = collect_access_facts(context, kFalcon, 0, "");
              return found.holders.empty() && !found.all_processes_seen;
            }),
            0);
}

}  // namespace usb_access_test
}  // namespace drivers::usb
