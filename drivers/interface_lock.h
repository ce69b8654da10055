/// @file
/// Locks a network interface for one master and one emulator of slaves.
#pragma once
#include <cstdint>
#include <string>

#include "drivers/setup_error.h"

namespace drivers {

/// The interface is in use.
class InterfaceInUse : public SetupError {
 public:
  using SetupError::SetupError;
};

/// Two masters on one bus mistake each other's answers for their own: on EtherCAT they reset each other's
/// slaves, and a robot in operation falls; on CAN one takes the answer to the other's request as its joint's
/// position. So each locks its interface by a name in the abstract namespace of Unix sockets: that namespace
/// belongs to the network namespace, as interfaces do, and the kernel frees a name however its holder ends.
/// Programs that do not use this lock, such as other masters, are not blocked. Any user may hold a name, as
/// with a file in /run/lock, so the error message names the holder's process and user, as reported by the
/// kernel.
class InterfaceLock {
 public:
  enum class End : std::uint8_t { kEthercatMaster, kEthercatSlaves, kCanMaster };

  /// `index` is the interface's. @throws InterfaceInUse naming the holder, SetupError if the system refuses.
  InterfaceLock(const std::string& interface, int index, End end);
  InterfaceLock(InterfaceLock&& other) noexcept;
  InterfaceLock& operator=(InterfaceLock&& other) noexcept;
  ~InterfaceLock();

 private:
  int socket_ = -1;
};

}  // namespace drivers
