/// @file
/// Who has a network interface: one master, and one that answers for the slaves.
#pragma once
#include <cstdint>
#include <string>

#include "drivers/setup_error.h"

namespace drivers {

/// Somebody else has it.
class InterfaceInUse : public SetupError {
 public:
  using SetupError::SetupError;
};

/// Two masters on one bus take each other's answers for their own: on EtherCAT they reset each other's
/// slaves, and a robot under way falls; on CAN one takes what the other asked for as its joint's position.
/// So each holds its interface, by a name in the abstract space of Unix sockets: that space belongs to the
/// network namespace, as interfaces do, and the kernel frees a name however its holder ends. Programs that do
/// not ask for it, such as other masters, are not kept away. Any user may hold a name, as they could a file
/// in /run/lock: so the message of a refusal names the holder's process and user, as the kernel knows them.
class InterfaceLock {
 public:
  enum class End : std::uint8_t { kEthercatMaster, kEthercatSlaves, kCanMaster };

  /// `index` is the interface's. @throws InterfaceInUse naming the holder, SetupError when the system
  /// refuses.
  InterfaceLock(const std::string& interface, int index, End end);
  InterfaceLock(InterfaceLock&& other) noexcept;
  InterfaceLock& operator=(InterfaceLock&& other) noexcept;
  ~InterfaceLock();

 private:
  int socket_ = -1;
};

}  // namespace drivers
