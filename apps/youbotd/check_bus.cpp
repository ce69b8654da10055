#include "apps/youbotd/check_parts.h"

#include <arpa/inet.h>
#include <ifaddrs.h>
#include <net/if.h>
#include <net/if_arp.h>
#include <netinet/in.h>

#include <array>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <stdexcept>
#include <system_error>
#include <vector>

#include "drivers/ethercat/bus_error.h"
#include "drivers/ethercat/pre_op_bus.h"
#include "drivers/ethercat/raw_socket_link.h"
#include "drivers/interface_lock.h"
#include "drivers/tmcl/youbot_topology.h"
#include "drivers/usb/usb_devices.h"

namespace youbotd {
namespace {

namespace fs = std::filesystem;
namespace ethercat = drivers::ethercat;
namespace tmcl = drivers::tmcl;
using drivers::usb::first_line;
using Mark = Finding::Mark;

constexpr const char* kEndOtherMaster =
    "end the program that is the other master, or take its computer off the bus";

struct FreeAddresses {
  void operator()(ifaddrs* first) const noexcept { freeifaddrs(first); }
};

std::string names_in(const fs::path& folder) {
  std::string names;
  std::error_code unreadable;
  for (fs::directory_iterator entry(folder, unreadable), end; !unreadable && entry != end;
       entry.increment(unreadable))
    names += (names.empty() ? "" : ", ") + entry->path().filename().string();
  return names.empty() ? "none" : names;
}

/// Empty if it is not an address, or one that every interface has automatically.
std::string address_text(const sockaddr* address) {
  std::array<char, INET6_ADDRSTRLEN> text{};
  if (address == nullptr) return {};
  if (address->sa_family == AF_INET) {
    const auto* const v4 = reinterpret_cast<const sockaddr_in*>(address);
    inet_ntop(AF_INET, &v4->sin_addr, text.data(), text.size());
  } else if (address->sa_family == AF_INET6) {
    const auto* const v6 = reinterpret_cast<const sockaddr_in6*>(address);
    if (!IN6_IS_ADDR_LINKLOCAL(&v6->sin6_addr)) inet_ntop(AF_INET6, &v6->sin6_addr, text.data(), text.size());
  }
  return text.data();
}

}  // namespace

Finding check_interface(const std::string& interface, const drivers::usb::SystemPaths& paths) {
  const fs::path all = paths.sys / "class/net";
  const fs::path folder = all / interface;
  const std::string name = "interface " + interface + ": ";
  std::error_code unknown;
  if (interface.find('/') != std::string::npos || !fs::exists(folder, unknown))
    return {Mark::kFail, name + "not there; there are " + names_in(all),
            "ip -brief link; name one of them as ethercat:IFACE"};
  if (first_line(folder / "type") != std::to_string(ARPHRD_ETHER))
    return {Mark::kFail, name + "not Ethernet", "ip -brief link; name another one as ethercat:IFACE"};
  if (fs::exists(folder / "wireless", unknown) || fs::exists(folder / "phy80211", unknown))
    return {Mark::kFail, name + "wireless, and EtherCAT needs a cable",
            "ip -brief link; name another one as ethercat:IFACE"};
  // A native driver takes the frames before they reach a socket.
  if (const fs::path master = fs::read_symlink(folder / "master", unknown); !master.empty())
    return {Mark::kFail, name + "part of " + master.filename().string(),
            "sudo ip link set " + interface + " nomaster"};
  const unsigned long flags = std::strtoul(first_line(folder / "flags").c_str(), nullptr, 0);
  if ((flags & IFF_UP) == 0) return {Mark::kFail, name + "down", "sudo ip link set " + interface + " up"};
  if (first_line(folder / "carrier") != "1")
    return {Mark::kFail, name + "up, but nothing at the other end",
            "plug the cable into the robot and switch the robot on; ip link show " + interface +
                " then says LOWER_UP"};
  return {Mark::kOk, name + "up, with a carrier"};
}

Finding check_addresses(const std::string& interface) {
  ifaddrs* list = nullptr;
  (void)getifaddrs(&list);
  const std::unique_ptr<ifaddrs, FreeAddresses> first(list);
  std::string addresses;
  for (const ifaddrs* entry = list; entry != nullptr; entry = entry->ifa_next) {
    if (interface != entry->ifa_name) continue;
    if (const std::string text = address_text(entry->ifa_addr); !text.empty())
      addresses += (addresses.empty() ? "" : ", ") + text;
  }
  if (addresses.empty())
    return {Mark::kOk, "addresses of " + interface + ": none, the bus is the robot's alone"};
  return {Mark::kWarn,
          "addresses of " + interface + ": " + addresses + "; other traffic delays the robot's frames",
          "if the robot is at its other end: sudo ip address flush dev " + interface +
              ", and take it out of what gives it addresses; else name another interface"};
}

Finding check_devices(ethercat::Link& link, tmcl::YoubotKind kind) {
  const std::string what = "devices on " + link.name() + ": ";
  try {
    const ethercat::PreOpBus bus(link, nullptr, {});
    const std::vector<ethercat::Slave>& found = bus.slaves();
    // First, because a foreign device also shifts the places of the others.
    tmcl::require_youbot_boards(found);
    check_topology(found, tmcl::youbot_topology(tmcl::youbot_around(kind, found.size())), link.name());
    return {Mark::kOk, what + std::to_string(found.size()) + ", all of them a youBot's boards"};
  } catch (const ethercat::AnotherMaster& error) {
    return {Mark::kFail, what + error.what(), kEndOtherMaster};
  } catch (const ethercat::BusError& error) {
    return {Mark::kFail, what + error.what(),
            "youbot-bench scan --robot ethercat:" + link.name() + " lists what is there"};
  }
}

Findings check_raw_socket(const std::string& interface, tmcl::YoubotKind kind) {
  using ethercat::RawSocketLink;
  try {
    RawSocketLink link(interface, RawSocketLink::Wait::kBlock);
    return {{Mark::kOk, "raw socket: opens on " + interface}, check_devices(link, kind)};
  } catch (const drivers::InterfaceInUse& error) {
    return {{Mark::kFail, std::string("raw socket: ") + error.what(),
             "end that program; a service: sudo systemctl stop youbotd"}};
  } catch (const ethercat::AnotherMaster& error) {
    return {{Mark::kFail, std::string("raw socket: ") + error.what(), kEndOtherMaster}};
  } catch (const std::runtime_error& error) {
    return {{Mark::kFail, std::string("raw socket: ") + error.what(), how_to_give_rights()}};
  }
}

}  // namespace youbotd
