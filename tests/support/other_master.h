/// @file
/// Another EtherCAT master on a network interface: a program that is unaware of ours.
#pragma once
#include <linux/if_packet.h>
#include <net/if.h>
#include <sys/socket.h>
#include <unistd.h>

#include <chrono>
#include <string>
#include <thread>

#include "drivers/ethercat/registers.h"
#include "tests/drivers/ethercat_fakes.h"

namespace support {

/// Reads the state of all slaves once per millisecond, from SOEM's source address. Needs root.
class OtherMaster {
 public:
  explicit OtherMaster(const std::string& interface)
      : socket_(socket(AF_PACKET, SOCK_RAW | SOCK_CLOEXEC, 0)),
        thread_([this, interface](const std::stop_token& stop) { run(interface, stop); }) {}
  OtherMaster(const OtherMaster&) = delete;
  OtherMaster& operator=(const OtherMaster&) = delete;
  ~OtherMaster() {
    thread_ = {};
    close(socket_);
  }

 private:
  void run(const std::string& interface, const std::stop_token& stop) const {
    namespace ethercat = drivers::ethercat;
    sockaddr_ll address{};
    address.sll_family = AF_PACKET;
    address.sll_ifindex = static_cast<int>(if_nametoindex(interface.c_str()));
    const ethercat::test::Bytes frame = ethercat::test::frame_of_another_master(
        ethercat::Command::kBrd, ethercat::address_of(0, ethercat::reg::kAlStatus));
    while (!stop.stop_requested()) {
      (void)!sendto(socket_, frame.data(), frame.size(), 0, reinterpret_cast<const sockaddr*>(&address),
                    sizeof address);
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
  }

  int socket_;
  std::jthread thread_;
};

}  // namespace support
